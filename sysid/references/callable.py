"""A Python function as a reference."""

from __future__ import annotations

import hashlib
import importlib
import inspect
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.code_digest import code_digest
from sysid.errors import ConfigError
from sysid.references.config import ReferenceConfig
from sysid.references.kinds import RunError, checked, with_files


class CallableReference:
    """A function that takes times, inputs and parameters, and gives outputs.

    Args:
        config: What it is.

    Raises:
        ConfigError: If the function cannot be imported.
    """

    def __init__(self, config: ReferenceConfig) -> None:
        self.config = config
        module, _, name = str(config.python).partition(":")
        sys.path.insert(0, config.folder)
        try:
            self.function = getattr(importlib.import_module(module), name)
        except Exception as error:  # noqa: BLE001 - whatever the module does when it is imported
            raise ConfigError(
                "the function of the reference cannot be imported",
                where=f"python: {config.python}", expected=f"{name} in {module}, in {config.folder} or installed",
                got=f"{type(error).__name__}: {error}", remedy="correct the name, or give its folder under folder",
            ) from None  # fmt: skip
        if not callable(self.function):
            raise ConfigError(
                "what the reference names is no function", where=f"python: {config.python}",
                expected="a function of times, inputs and parameters", got=type(self.function).__name__,
                remedy="name a function, or an object that can be called like one",
            )  # fmt: skip

    @property
    def digest(self) -> str:
        """Of its name, the code that it runs in its package or else its file, and the files named beside it."""
        sha = hashlib.sha256(str(self.config.python).encode())
        try:
            sha.update(code_digest(self.function).encode())
        except (LookupError, OSError, SyntaxError, ValueError, TypeError, AttributeError):
            own = inspect.getsourcefile(sys.modules[self.function.__module__])
            sha.update(Path(own).read_bytes() if own else b"")
        return with_files(sha.hexdigest(), self.config, self.config.files)

    def run(
        self, inputs: NDArray[np.float64], parameters: Mapping[str, float]
    ) -> tuple[NDArray[np.float64] | None, NDArray[np.float64]]:
        """Call it once; see :class:`sysid.references.kinds.Loaded`."""
        time = self.config.sample_time * np.arange(len(inputs), dtype=np.float64)
        try:
            values = self.function(time, inputs, dict(parameters))
        except Exception as error:
            words = " ".join(str(error).split())
            raise RunError(f"it raised {type(error).__name__}{': ' + words if words else ''}") from error
        return None, checked(values, self.config, len(inputs))
