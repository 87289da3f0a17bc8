"""Generators: what makes traces from a recipe, found by name among the installed packages.

A generator is a function registered in the entry-point group ``sysid.generators``. A change of the code that it runs
in its package makes cached traces void; where its module has a ``GENERATOR_VERSION``, a change of that does.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import sysid
from sysid.errors import SysidError
from sysid.plugins import find_entry
from sysid.traces import Channel, Trace

GROUP = "sysid.generators"


class Generate(Protocol):
    """The call that every generator answers."""

    def __call__(
        self,
        *,
        case: str,
        recipe: Mapping[str, Any],
        options: Mapping[str, Any],
        channels: tuple[Channel, ...],
        sample_time: float,
    ) -> Trace:
        """Make one trace with these channels at this sample time, not rounded."""
        ...


@dataclass(frozen=True, kw_only=True)
class Generator:
    """A generator that was found.

    Args:
        name: Its name.
        version: Versions of the workbench, the generator's package and the generator, as one text.
        generate: The function.
    """

    name: str
    version: str
    generate: Generate

    def make(
        self,
        *,
        case: str,
        recipe: Mapping[str, Any],
        options: Mapping[str, Any],
        channels: tuple[Channel, ...],
        sample_time: float,
    ) -> Trace:
        """Make one trace and check that it is the one asked for.

        Args:
            case: Its name.
            recipe: What to make it from.
            options: Options of the generator.
            channels: The channels wanted.
            sample_time: Seconds between samples.

        Returns:
            The trace, not rounded.

        Raises:
            SysidError: If the generator returns something else.
        """
        trace = self.generate(case=case, recipe=recipe, options=options, channels=channels, sample_time=sample_time)
        wanted, got = (case, sample_time, channels), (trace.name, trace.sample_time, trace.channels)
        if wanted != got:
            raise SysidError(
                f"the generator {self.name} returned another trace than it was asked for",
                where=f"case {case}",
                expected=wanted,
                got=got,
                remedy="report this to the author of the generator",
            )
        return trace


def find_generator(name: str, *, where: object) -> Generator:
    """The generator of a name.

    Args:
        name: For example ``"abdx"``.
        where: The file that asks for it, for errors.

    Returns:
        The generator.

    Raises:
        ConfigError: If none of that name is installed; those that are known are listed.
    """
    entry = find_entry(GROUP, name, what="generator", where=where)
    generate: Callable[..., Trace] = entry.load()
    package = entry.dist.version if entry.dist is not None else ""
    return Generator(name=name, version=f"{sysid.__version__}/{package}/{_own_version(generate)}", generate=generate)


def _own_version(generate: Callable[..., Trace]) -> str:
    """What a generator says that it is, or the digest of its code; nothing where there is no source to read."""
    declared = getattr(sys.modules.get(generate.__module__), "GENERATOR_VERSION", None)
    if declared is not None:
        return str(declared)
    from sysid.code_digest import code_digest  # who reads a file asks for no generator

    try:
        return code_digest(generate if hasattr(generate, "__qualname__") else type(generate))[:16]
    except (LookupError, OSError, SyntaxError, ValueError):
        return ""
