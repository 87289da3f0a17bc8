"""The definitions of a file of code, each a unit of what a digest covers: functions, classes, methods, statements."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path

from sysid.code_text import StatementReader, Target, bound, decorator_name, imported, is_for_types, is_said, is_script

CALLED_BY_NAME = frozenset(
    {
        "property",
        "cached_property",
        "setter",
        "staticmethod",
        "classmethod",
        "abstractmethod",
        "override",
        "cache",
        "errstate",
    }
)
"""Decorators of methods that run only where somebody asks for them."""


def sha(text: str) -> str:
    """SHA-256 of a text, as hexadecimal digits."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


@dataclass(frozen=True, kw_only=True, eq=False)
class Unit:
    """One definition: a statement at the top of a module, or a method.

    Args:
        module: Where it stands.
        package: Of which that is.
        ours: Top-level packages that are followed.
        name: Of a function, class or method; empty for another statement.
        nodes: Its code; of a class without the methods that run only where somebody asks for them.
        owner: Of a method the name of its class.
    """

    module: str
    package: str
    ours: frozenset[str]
    name: str
    nodes: tuple[ast.AST, ...]
    owner: str = ""

    @cached_property
    def reader(self) -> StatementReader:
        """The definition, read."""
        reader = StatementReader(package=self.package, ours=self.ours)
        for node in self.nodes:
            reader.read(node, in_class=bool(self.owner))
        return reader

    @cached_property
    def digest(self) -> str:
        """Of its code alone."""
        return sha("".join([self.owner, *self.reader.text]))

    def is_in(self, places: Iterable[str]) -> bool:
        """Whether it is one of some addresses, or stands in one of some modules or packages."""
        return any(f"{self.address}:".startswith((f"{one}.", f"{one}:")) for one in places)

    @property
    def address(self) -> str:
        """Where it is, for people; a statement without a name is its module's."""
        return f"{self.module}:{f'{self.owner}.' if self.owner else ''}{self.name}"


@dataclass(frozen=True, kw_only=True)
class Module:
    """What stands at the top of a file: definitions and imports by name, and what binds no name."""

    name: str
    package: str
    ours: frozenset[str]
    units: dict[str, list[Unit]] = field(default_factory=dict)
    methods: dict[Unit, dict[str, Unit]] = field(default_factory=dict)
    imports: dict[str, Target] = field(default_factory=dict)
    loose: list[Unit] = field(default_factory=list)

    @property
    def all(self) -> list[Unit]:
        """Every definition."""
        named = [unit for name, units in self.units.items() if name != "__all__" for unit in units]
        return [*named, *self.loose, *(one for unit in named for one in self.methods.get(unit, {}).values())]


@cache
def parsed(name: str, file: Path, ours: frozenset[str], _changed: int, _size: int) -> Module:
    """A file's module; again only when the file has changed."""
    package = name if file.name == "__init__.py" else name.rpartition(".")[0]
    module = Module(name=name, package=package, ours=ours)
    _fill(module, ast.parse(file.read_bytes()).body)
    return module


def _fill(module: Module, body: Iterable[ast.stmt]) -> None:
    for node in body:
        if isinstance(node, ast.If) and is_for_types(node):
            module.imports.update(_all_imported(node.body, module.package))
            _fill(module, node.orelse)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            module.imports.update(imported(node, module.package))
        elif not is_said(node) and not is_script(node):
            unit = _divided(module, node) if isinstance(node, ast.ClassDef) else _unit(module, node)
            if not unit.name:
                module.imports.update(_all_imported([node], module.package))  # try: import this
            names = list(bound(node))
            for one in names:
                module.units.setdefault(one, []).append(unit)
            if not names:
                module.loose.append(unit)


def _unit(module: Module, *nodes: ast.AST, owner: str = "") -> Unit:
    name = getattr(nodes[0], "name", "")
    return Unit(module=module.name, package=module.package, ours=module.ours, name=name, nodes=nodes, owner=owner)


def _all_imported(nodes: Iterable[ast.AST], package: str) -> dict[str, Target]:
    return {name: target for node in nodes for one in ast.walk(node) for name, target in imported(one, package).items()}


def _divided(module: Module, node: ast.ClassDef) -> Unit:
    """A class without the methods that run only where somebody asks for them; these are kept beside it."""
    methods: dict[str, list[ast.stmt]] = {}
    for one in node.body:
        if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef) and _is_asked_for(one):
            methods.setdefault(one.name, []).append(one)
    rest = [one for one in node.body if not any(one in found for found in methods.values())]
    unit = _unit(module, ast.ClassDef(**{**{name: getattr(node, name) for name in node._fields}, "body": rest}))
    module.methods[unit] = {name: _unit(module, *found, owner=node.name) for name, found in methods.items()}
    return unit


def _is_asked_for(method: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Whether a method runs only where somebody asks for it by its name."""
    hidden = method.name.endswith("_") or method.name.startswith("model_")
    return not hidden and all(decorator_name(one) in CALLED_BY_NAME for one in method.decorator_list)
