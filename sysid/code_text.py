"""A statement of Python without its words: what it does as text, and which names it does it with."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

UNSAID = frozenset({"ctx", "kind", "type_comment", "type_ignores"})
"""Fields of the syntax tree without a meaning of their own."""

PLAIN_DECORATORS = frozenset(
    {
        *("property", "cached_property", "staticmethod", "classmethod", "abstractmethod", "override", "final"),
        *("setter", "cache", "lru_cache", "njit", "jit", "contextmanager", "wraps", "overload"),
        *("field_validator", "model_validator"),
    }
)
"""Decorators that do not read the annotations of a function."""

Target = tuple[str, str | None]
"""A module, and the name in it; without one the module itself."""

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass(kw_only=True)
class StatementReader:
    """Writes a statement down without its words, and keeps what it names.

    Comments, docstrings and the annotations of functions are left out; what an annotation names is kept, for the
    methods of what is passed in run too. The fields of a class are declared by their annotations, which stay.

    Args:
        package: In which it stands, for relative imports.
        ours: Top-level packages whose imports are not written down: files move.
        text: What it does.
        names: ``a`` or ``a.b.c``, as they stand.
        attributes: What is asked of objects, by whatever name they go.
        imports: What it imports itself, by the name in it.
        addresses: Texts that may name something in a package, such as ``"sysid.units:convert"``.
    """

    package: str
    ours: frozenset[str]
    text: list[str] = field(default_factory=list)
    names: set[str] = field(default_factory=set)
    attributes: set[str] = field(default_factory=set)
    imports: dict[str, Target] = field(default_factory=dict)
    addresses: set[str] = field(default_factory=set)

    def read(self, node: ast.AST, *, in_class: bool = False) -> None:
        """Read a node and all below it.

        Args:
            node: The node.
            in_class: Whether it stands in the body of a class.
        """
        special = _SPECIAL.get(type(node))
        if special is None or not special(self, node, in_class):
            self._write(node)

    def _write(self, node: ast.AST, *, without: Iterable[str] = ()) -> None:
        add = self.text.append
        add(f"({type(node).__name__}")
        for name in node._fields:
            if name in UNSAID or name in without:
                continue
            value = getattr(node, name, None)
            if isinstance(value, list):
                self._list(value, in_class=name == "body" and isinstance(node, ast.ClassDef))
            elif isinstance(value, ast.AST):
                add(f" {name}")
                self.read(value)
            elif value is not None:
                add(f" {name}={value!r}")
        add(")")

    def _list(self, values: Iterable[Any], *, in_class: bool = False) -> None:
        self.text.append("[")
        for value in values:
            if isinstance(value, ast.AST):
                self.read(value, in_class=in_class)
            else:
                self.text.append(f"{value!r};")
        self.text.append("]")

    def _expression(self, node: ast.Expr, _in_class: bool) -> bool:
        return is_said(node)

    def _if(self, node: ast.If, in_class: bool) -> bool:
        if not is_for_types(node):
            return False
        for one in ast.walk(node):
            self.imports.update(imported(one, self.package))
        self._list(node.orelse, in_class=in_class)
        return True

    def _import(self, node: ast.Import | ast.ImportFrom, _in_class: bool) -> bool:
        found = imported(node, self.package)
        self.imports.update(found)
        return all(module.partition(".")[0] in self.ours for module, _ in found.values())

    def _name(self, node: ast.Name, _in_class: bool) -> bool:
        self.names.add(node.id)
        self.text.append(f"({node.id})")
        return True

    def _attribute(self, node: ast.Attribute, _in_class: bool) -> bool:
        chain = chain_of(node)
        if not chain:
            self.attributes.add(node.attr)
            return False
        self.names.add(chain)
        self.text.append(f"({chain})")
        return True

    def _constant(self, node: ast.Constant, _in_class: bool) -> bool:
        self.text.append(f"({node.value!r})")
        if isinstance(node.value, str):
            self._string(node.value)
        return True

    def _string(self, text: str) -> None:
        """A text may be the name of an attribute, or the address of something."""
        if text.isidentifier():
            self.attributes.add(text)
        elif text.partition(".")[0] in self.ours and text.replace(":", ".").replace(".", "").isidentifier():
            self.addresses.add(text)

    def _pattern(self, node: ast.MatchClass, _in_class: bool) -> bool:
        self.attributes.update(node.kwd_attrs)
        return False

    def _annotated(self, node: ast.AnnAssign, in_class: bool) -> bool:
        if in_class:
            self.follow(node.annotation)
            return False
        self.follow(node.annotation)
        if node.value is not None:
            self._write(ast.Assign(targets=[node.target], value=node.value))
        return True

    def _function(self, node: ast.FunctionDef | ast.AsyncFunctionDef, _in_class: bool) -> bool:
        given = node.args
        everything = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
        annotations = [one.annotation for one in everything if one is not None and one.annotation is not None]
        for annotation in [*annotations, *([node.returns] if node.returns else [])]:
            self.follow(annotation)
        if not all(decorator_name(one) in PLAIN_DECORATORS for one in node.decorator_list):
            for annotation in annotations:  # somebody may read them
                self._write(annotation)
        self._write(node, without=("returns",))
        return True

    def _argument(self, node: ast.arg, _in_class: bool) -> bool:
        self.text.append(f"({node.arg})")
        return True

    def follow(self, annotation: ast.AST) -> None:
        """Keep the names of an annotation, without writing it down.

        Args:
            annotation: The annotation.
        """
        if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
            try:
                self.follow(ast.parse(annotation.value, mode="eval"))
            except (SyntaxError, ValueError):
                return  # a literal, not a type in quotes
        chain = chain_of(annotation)
        if chain:
            self.names.add(chain)
            return
        for one in ast.iter_child_nodes(annotation):
            self.follow(one)


_SPECIAL: dict[type[ast.AST], Any] = {
    ast.Expr: StatementReader._expression,
    ast.If: StatementReader._if,
    ast.Import: StatementReader._import,
    ast.ImportFrom: StatementReader._import,
    ast.Name: StatementReader._name,
    ast.Attribute: StatementReader._attribute,
    ast.Constant: StatementReader._constant,
    ast.MatchClass: StatementReader._pattern,
    ast.AnnAssign: StatementReader._annotated,
    ast.FunctionDef: StatementReader._function,
    ast.AsyncFunctionDef: StatementReader._function,
    ast.arg: StatementReader._argument,
}
"""Nodes that are not written down field by field; each says whether it has done it all."""


def chain_of(node: ast.AST) -> str:
    """``a.b.c`` as it stands, for what it means depends on whether ``a`` is a module; empty for anything else."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return ".".join([node.id, *reversed(parts)]) if isinstance(node, ast.Name) else ""


def decorator_name(node: ast.expr) -> str:
    """The last word of a decorator, called or not."""
    called = node.func if isinstance(node, ast.Call) else node
    return called.id if isinstance(called, ast.Name) else getattr(called, "attr", "")


def imported(node: ast.AST, package: str) -> dict[str, Target]:
    """What an import binds, by its name; nothing for any other node.

    Args:
        node: The node.
        package: In which it stands.

    Returns:
        Where each name comes from.
    """
    if isinstance(node, ast.Import):
        return {
            alias.asname or alias.name.split(".")[0]: (alias.name if alias.asname else alias.name.split(".")[0], None)
            for alias in node.names
        }
    if isinstance(node, ast.ImportFrom):
        above = package.split(".")
        base = [*above[: len(above) - node.level + 1]] if node.level else []
        module = ".".join([*base, *([node.module] if node.module else [])])
        return {alias.asname or alias.name: (module, alias.name) for alias in node.names}
    return {}


def bound(node: ast.AST) -> Iterator[str]:
    """The names that a statement gives a meaning to."""
    if isinstance(node, (*_FUNCTIONS, ast.ClassDef)):
        yield node.name
    elif isinstance(node, ast.Name):
        if isinstance(node.ctx, ast.Store):
            yield node.id
    elif not isinstance(node, ast.expr) or isinstance(node, ast.Tuple | ast.List | ast.Starred):
        for child in ast.iter_child_nodes(node):
            yield from bound(child)


def is_said(node: ast.AST) -> bool:
    """Whether a statement is a docstring, or another text that nobody reads at run time."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def is_for_types(node: ast.If) -> bool:
    """Whether a statement is what only a type checker reads."""
    return chain_of(node.test).split(".")[-1] == "TYPE_CHECKING"


def is_script(node: ast.AST) -> bool:
    """Whether a statement is run only where its file is the program."""
    return isinstance(node, ast.If) and isinstance(node.test, ast.Compare) and chain_of(node.test.left) == "__name__"
