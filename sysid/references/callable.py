"""A Python function as a reference."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType

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
        module, _, name = str(config.python).rpartition(":")
        sys.path.insert(0, config.folder)
        before = set(sys.modules)
        try:
            self.function = getattr(_imported(module, Path(config.folder)), name)
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
        _takes_three(self.function, str(config.python))
        self.beside = _beside(set(sys.modules) - before, Path(config.folder), self.function.__module__)

    @property
    def digest(self) -> str:
        """Of its name, the code that it runs in its package or else its file, and the files that it needs beside it."""
        sha = hashlib.sha256(str(self.config.python).encode())
        try:
            sha.update(code_digest(self.function).encode())
        except (LookupError, OSError, SyntaxError, ValueError, TypeError, AttributeError):
            own = getattr(sys.modules.get(self.function.__module__), "__file__", None)
            sha.update(Path(own).read_bytes() if own else b"")
        return with_files(sha.hexdigest(), self.config, (*self.beside, *self.config.files))

    def run(
        self, inputs: NDArray[np.float64], parameters: Mapping[str, float]
    ) -> tuple[NDArray[np.float64] | None, NDArray[np.float64]]:
        """Call it once; see :class:`sysid.references.kinds.Loaded`."""
        time = self.config.sample_time * np.arange(len(inputs), dtype=np.float64)
        try:
            values = self.function(time, inputs, dict(parameters))
        except Exception as error:
            words = " ".join(str(error).split())
            last = traceback.extract_tb(error.__traceback__)[-1]
            where = f" ({Path(last.filename).name}, line {last.lineno})"
            raise RunError(f"it raised {type(error).__name__}{': ' + words if words else ''}{where}") from error
        return None, checked(values, self.config, len(inputs))


def _takes_three(function: Callable[..., object], named: str) -> None:
    """Refuse a function that cannot be called with times, inputs and parameters, before any run counts as failed."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # compiled code may say nothing of its arguments: the first run will
        return
    try:
        signature.bind(None, None, None)
    except TypeError:
        name = named.rpartition(":")[2]
        raise ConfigError(
            "the function of the reference takes other arguments", where=f"python: {named}",
            expected=f"{name}(time, inputs, parameters), with times (n,) in s, inputs (n, n_inputs) and parameters by "
            "name, that gives outputs (n, n_outputs)",
            got=f"{name}({', '.join(signature.parameters)})",
            remedy=f"write a function of these three that calls {name}, and name that one",
        ) from None  # fmt: skip


def _imported(module: str, folder: Path) -> ModuleType:
    """A module by its name, or by its file: whatever that is called, it stands for no module that is there already."""
    if not module.endswith(".py"):
        return importlib.import_module(module)
    file = folder / module
    sys.path.insert(0, str(file.parent))
    name = file.stem if file.stem not in sys.modules else f"reference_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"no file {file}")
    found = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def _beside(imported: set[str], folder: Path, own: str) -> tuple[str, ...]:
    """The files of a folder that a module of it has imported, but for those of its own package: these are followed."""
    files = [
        Path(file).resolve()
        for name in imported - {own}
        if name.partition(".")[0] != own.partition(".")[0] and (file := getattr(sys.modules[name], "__file__", None))
    ]
    place = folder.resolve()
    return tuple(sorted(str(one) for one in files if place in one.parents and "site-packages" not in one.parts))
