"""The digest of code, for the key of a stored result: changed code never reuses what older code computed.

It covers what a function really runs: its definition, every definition of its package that this names, theirs, and so
on, wherever they stand. Words are not code: comments, docstrings, the annotations of functions, ``__all__``, imports
and the names of files are left out. A result outlives a better docstring, a moved file, a divided module, and a new
function that nobody calls.

The unit is a definition: a function, a class, a method, or another statement at the top of a module. What a name means
is read from the imports, in functions too; a name that a package's ``__init__`` hands on leads to where it is defined
and to nothing else of the package. A method counts where its class is reached and anything that is reached asks an
object for something of its name. What cannot be told apart counts: better a result too many computed again.
"""

from __future__ import annotations

import ast
import builtins
import gc
import hashlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from sysid.code_text import (
    Target,
    chain_of,
)
from sysid.code_units import Module, Unit, parsed, sha
from sysid.kept_digests import kept_or_taken

ROUNDS = 3
"""How many steps away it is seen that a name means another definition of the same words."""

QUIET_BASES = frozenset({"ABC", "Protocol", "Generic", "BaseModel", "Enum", "StrEnum", "IntEnum", "NamedTuple"}) | {
    name for name, value in vars(builtins).items() if isinstance(value, type)
}
"""Classes of other packages that call no method of theirs by a name that we have given it."""


def code_digest(*roots: Callable[..., Any] | str, without: tuple[str, ...] = (), files: tuple[str, ...] = ()) -> str:
    """SHA-256 over the code that some functions run.

    It is taken once in a process: what runs is what was imported then, whatever is written meanwhile.

    Args:
        roots: Functions or classes, or their addresses as ``"package.module:name"``, or a whole ``"package.module"``.
            Of a class every method counts. A class of which an object is passed in, where only its base is named, is
            to be among them.
        without: Addresses, modules or packages that are not followed, such as configurations, whose values are in the
            key, or a table of which the entry that is used is among the roots.
        files: Folders of templates, styles and the like that the result depends on too, such as
            ``"sysid/reporting/templates"``; every file in them that is not Python counts.

    Returns:
        64 hexadecimal digits.

    Raises:
        LookupError: If there is no such module, or no such name in it.

    Example:
        >>> code_digest("sysid.units:convert") == code_digest("sysid.units:convert", "sysid.units:convert")
        True
    """
    return _digest(_addresses(roots), without, files)


@cache
def _digest(addresses: tuple[str, ...], without: tuple[str, ...], files: tuple[str, ...]) -> str:
    beside = b"".join(_contents(files))

    def take() -> str:
        with _no_search_for_garbage():
            return hashlib.sha256("\n".join(_labels(addresses, without)).encode() + beside).hexdigest()

    if any(address.replace(":", ".").split(".")[0] != "sysid" for address in addresses):
        return take()
    return kept_or_taken(_home("sysid"), (addresses, without, hashlib.sha256(beside).hexdigest()), take)


@contextmanager
def _no_search_for_garbage() -> Iterator[None]:
    """Trees of syntax are kept, all of them: to search them for garbage again and again took a third of the time."""
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()


def _contents(files: Iterable[str]) -> Iterator[bytes]:
    for folder in files:
        top, _, rest = folder.partition("/")
        for file in sorted((_home(top) / rest).rglob("*")):
            if file.is_file() and file.suffix not in {".py", ".pyc"}:
                yield f"\n{file.name}\n".encode()
                yield file.read_bytes()


def look_again() -> None:
    """Forget what was taken, so that code that was written meanwhile counts."""
    _digest.cache_clear()
    _sources.cache_clear()


def _home(package: str) -> Path:
    """The folder of a top-level package."""
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        raise LookupError(f"no package {package}")
    return Path(spec.origin).parent


def reached(*roots: Callable[..., Any] | str, without: tuple[str, ...] = ()) -> set[str]:
    """The definitions that :func:`code_digest` covers.

    Args:
        roots: As there.
        without: As there.

    Returns:
        Their addresses.
    """
    return {unit.address for unit in _closure(_addresses(roots), without)[1]}


def _addresses(roots: Iterable[Callable[..., Any] | str]) -> tuple[str, ...]:
    named = {root if isinstance(root, str) else f"{root.__module__}:{root.__qualname__}" for root in roots}
    return tuple(sorted(named))


def _labels(addresses: Sequence[str], without: Sequence[str]) -> list[str]:
    """What each definition that is reached does, sorted, whatever its place."""
    sources, units = _closure(addresses, without)
    labels = {unit: unit.digest for unit in units}
    for _ in range(ROUNDS):
        labels = {unit: _label(labels, sources.meaning(unit).names, labels[unit]) for unit in units}
    return sorted(set(labels.values()))


def _closure(addresses: Sequence[str], without: Sequence[str]) -> tuple[_Sources, list[Unit]]:
    """Every definition that is reached, and where they were found."""
    sources = _sources(frozenset({"sysid", *(address.split(":")[0].split(".")[0] for address in addresses)}))
    found: dict[Unit, None] = {}
    asked: set[str] = set()
    unasked: defaultdict[str, list[Unit]] = defaultdict(list)
    roots = {unit for address in addresses for unit in sources.at_address(address)}
    waiting = list(roots)
    while waiting:
        unit = waiting.pop()
        if unit in found or (unit not in roots and unit.is_in(without)):
            continue
        found[unit] = None
        meaning = sources.meaning(unit)
        waiting += [other for means in meaning.names.values() for other in means if isinstance(other, Unit)]
        waiting += sources.loose(unit.module)
        for name in meaning.asked - asked:
            waiting += unasked.pop(name, [])
        asked |= meaning.asked
        for name, method in sources.methods(unit).items():
            (waiting if name in asked else unasked[name]).append(method)
    return sources, list(found)


@cache
def _sources(ours: frozenset[str]) -> _Sources:
    """The modules of some packages; what their names mean is worked out once for all digests of a process."""
    return _Sources(ours=ours)


def _label(labels: dict[Unit, str], names: dict[str, list[Unit | str]], own: str) -> str:
    """A definition's label with what its names mean."""
    said = sorted(
        f"{name}={','.join(sorted(one if isinstance(one, str) else labels.get(one, '') for one in found))}"
        for name, found in names.items()
    )
    return sha("\n".join([own, *said]))


def _bases(unit: Unit) -> list[ast.expr]:
    return [base for node in unit.nodes if isinstance(node, ast.ClassDef) for base in node.bases]


@dataclass(frozen=True, kw_only=True)
class _Meaning:
    """What the names in a definition mean: definitions, or addresses in other packages; what it asks objects for."""

    names: dict[str, list[Unit | str]]
    asked: set[str]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Sources:
    """The modules of some packages, parsed when they are asked for."""

    ours: frozenset[str]
    _known: dict[str, Module | None] = field(default_factory=dict)
    _understood: dict[Unit, _Meaning] = field(default_factory=dict)

    def module(self, name: str) -> Module | None:
        """A module; ``None`` where there is none of that name, or it is another package's."""
        if name not in self._known:
            self._known[name] = self._found(name)
        return self._known[name]

    def _found(self, name: str) -> Module | None:
        top, *rest = name.split(".")
        if top not in self.ours:
            return None
        base = _home(top).joinpath(*rest)
        for file in (base / "__init__.py", base.with_name(f"{base.name}.py")):
            if file.is_file():
                stat = file.stat()
                return parsed(name, file, self.ours, stat.st_mtime_ns, stat.st_size)
        return None

    def at_address(self, address: str) -> Iterator[Unit]:
        """The definitions that an address names, with every method of a class."""
        name, _, attribute = address.partition(":")
        if self.module(name) is None:
            raise LookupError(f"no module {name}")
        found, left = self.named(name, attribute.split(".") if attribute else [])
        if not found or left:
            raise LookupError(f"no {attribute} in {name}")
        for unit in found:
            if isinstance(unit, Unit):
                yield unit
                yield from self.methods(unit).values() if "." not in attribute else ()

    def loose(self, name: str) -> list[Unit]:
        """What runs when a module is imported, beside its definitions; its packages are imported with it."""
        parts = name.split(".")
        modules = [self.module(".".join(parts[:n])) for n in range(1, len(parts) + 1)]
        return [unit for module in modules if module is not None for unit in module.loose]

    def methods(self, unit: Unit) -> dict[str, Unit]:
        """The methods of a class that run only where somebody asks for them."""
        module = self.module(unit.module)
        return {} if module is None else module.methods.get(unit, {})

    def meaning(self, unit: Unit) -> _Meaning:
        """What the names in a definition mean."""
        if unit not in self._understood:
            self._understood[unit] = self._understand(unit)
        return self._understood[unit]

    def _understand(self, unit: Unit) -> _Meaning:
        reader = unit.reader
        names: dict[str, list[Unit | str]] = {}
        asked = set(reader.attributes)
        for name in reader.names:
            first, *rest = name.split(".")
            if first in reader.imports:
                found, left = self.target(reader.imports[first], rest)
            else:
                found, left = self.named(unit.module, [first, *rest], inside=True)
            asked.update(left)
            names[name] = found
        for address in reader.addresses:
            module, _, attribute = address.partition(":")
            if self.module(module) is not None:
                names[address], left = self.named(module, attribute.split(".") if attribute else [])
                asked.update(left)
        if any(self._calls(base, unit) for base in _bases(unit)):
            asked.update(self.methods(unit))
        kept = {name: [one for one in found if one is not unit] for name, found in names.items()}
        return _Meaning(names={name: found for name, found in kept.items() if found}, asked=asked)

    def _calls(self, base: ast.expr, unit: Unit) -> bool:
        """Whether a base is another package's, and may call methods by the names that they have here."""
        chain = chain_of(base.value if isinstance(base, ast.Subscript) else base)
        if chain.split(".")[-1] in QUIET_BASES:
            return False
        found = self.named(unit.module, chain.split("."), inside=True)[0] if chain else []
        ours = [one for one in found if isinstance(one, Unit)]
        return not ours or any(self._calls(above, one) for one in ours for above in _bases(one))

    def named(self, name: str, chain: list[str], *, inside: bool = False) -> tuple[list[Unit | str], list[str]]:
        """What ``a.b.c`` means in a module, or all of the module where nothing is named.

        Args:
            name: The module.
            chain: The parts.
            inside: Whether it stands in the module itself, where an unknown name is a local one.

        Returns:
            Definitions, or addresses in other packages; and the parts that are asked of an object.
        """
        module = self.module(name)
        if module is None:
            return [".".join([name, *chain])], chain[1:]
        if not chain:
            return [*module.all], []
        first, rest = chain[0], chain[1:]
        here, left = module.units.get(first, []), rest
        methods = [self.methods(unit)[rest[0]] for unit in here if rest and rest[0] in self.methods(unit)]
        found: list[Unit | str] = [*here, *methods]
        if methods:
            left = rest[1:]
        if first in module.imports and module.imports[first] != (name, first):
            more, left = self.target(module.imports[first], rest)
            found += more
        if not found and (not inside or first in module.imports) and self.module(f"{name}.{first}") is not None:
            return self.named(f"{name}.{first}", rest)  # a module of a package is a name in it
        if not found and not inside and not first.startswith("__"):
            found += module.units.get("__getattr__", ())
        return found, left

    def target(self, target: Target, chain: list[str]) -> tuple[list[Unit | str], list[str]]:
        """What an import leads to."""
        module, attribute = target
        return self.named(module, chain if attribute is None else [attribute, *chain])
