"""A reference as it is named on a command line: an FMU, a Python function, a program, or a file that says which."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sysid.errors import ConfigError, did_you_mean
from sysid.references.config import FILES, PLACEHOLDER
from sysid.yaml_files import read_yaml

FUNCTION = re.compile(r"(?P<home>[A-Za-z_][\w.]*|.+\.py):(?P<name>[A-Za-z_]\w*)")
TABLES = (".yaml", ".yml")
KINDS = "an FMU, a function as file.py:function, a command line with {inputs} and {outputs}, or a YAML with reference:"


@dataclass(frozen=True, kw_only=True)
class Source:
    """What is named.

    Args:
        text: As it was typed.
        name: A short name of it.
        content: Fields of a pipeline of kind ``experiment``, as far as they are said: by what the reference is run,
            with whole paths, and what a table says beside it.
        table: The file of such a table; ``None`` where the reference itself was named.
    """

    text: str
    name: str
    content: Mapping[str, Any]
    table: Path | None = None

    @property
    def reference(self) -> dict[str, Any]:
        """What is said of the reference."""
        return dict(self.content["reference"])

    @property
    def fmu(self) -> Path | None:
        """The FMU, where it is one."""
        file = self.reference.get("fmu")
        return None if file is None else Path(self.reference.get("folder", ".")) / str(file)

    @property
    def file(self) -> str:
        """Named in errors."""
        return self.text if self.table is None else str(self.table)


def source_of(text: str, *, folder: Path | None = None) -> Source:
    """What a text names. Nothing of it is run, or imported.

    Args:
        text: An FMU; ``package.module:function`` or ``file.py:function``; a command line in which ``{inputs}`` and
            ``{outputs}`` stand for the files that are passed; a YAML with a table ``reference``.
        folder: Where modules are found and programs run; the current one by default.

    Returns:
        It.

    Raises:
        ConfigError: If it can be none of them, or a file has no such function.
    """
    place, path = (folder or Path.cwd()).resolve(), Path(text)
    if path.suffix.lower() in TABLES:
        return _of_table(path)
    if PLACEHOLDER.search(text) or (len(text.split()) > 1 and not path.is_file()):
        return _of_program(text, place)
    if (found := FUNCTION.fullmatch(text)) is not None and not path.is_file():
        return _of_function(text, found["home"], found["name"], place)
    if path.suffix == ".py":
        names, _ = _functions(path)
        raise ConfigError(
            "a file of Python is named without its function", where=text, expected=f"{text}:FUNCTION",
            got=f"the file alone, which has {', '.join(names) or 'no function'}",
            remedy=f"say {text}:{names[0]}" if names
            else f"define one; of a program, write the whole command, as 'python {text} {{inputs}} {{outputs}}'",
        )  # fmt: skip
    return Source(text=text, name=path.stem, content={"reference": {"fmu": str((place / path).resolve())}})


def _of_function(text: str, home: str, name: str, place: Path) -> Source:
    if not home.endswith(".py"):
        return Source(text=text, name=name, content={"reference": {"python": text, "folder": str(place)}})
    file = (place / home).resolve()
    names, others = _functions(file)
    if name not in (*names, *others):
        raise ConfigError(
            f"the file has no function {name}", where=file, expected=f"one of {', '.join(names) or 'its functions'}",
            got=name, remedy=did_you_mean(name, (*names, *others), "correct the name"),
        )  # fmt: skip
    return Source(
        text=text, name=name, content={"reference": {"python": f"{file.name}:{name}", "folder": str(file.parent)}}
    )


def _functions(file: Path) -> tuple[list[str], list[str]]:
    """What a file defines that may be called, by its text: its functions, and what else it names that may be one."""
    try:
        body = ast.parse(file.read_text(encoding="utf-8-sig")).body
    except (OSError, ValueError, SyntaxError) as error:
        raise ConfigError(
            "the file of the function cannot be read", where=file, expected="a file of Python", got=error,
            remedy="check the path, and that Python runs it",
        ) from None  # fmt: skip
    nodes = list(_at_top(body))
    functions = [node.name for node in nodes if isinstance(node, ast.FunctionDef)]
    others = [node.name for node in nodes if isinstance(node, ast.ClassDef)]
    others += [alias.asname or alias.name for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names]
    assigned = [target for node in nodes if isinstance(node, ast.Assign) for target in node.targets]
    assigned += [node.target for node in nodes if isinstance(node, ast.AnnAssign)]
    return functions, others + [one.id for target in assigned for one in ast.walk(target) if isinstance(one, ast.Name)]


def _at_top(body: Sequence[ast.stmt]) -> Iterator[ast.stmt]:
    """The statements whose names are those of the file: also below ``if`` and ``try``, as where a library may lack."""
    for node in body:
        yield node
        if isinstance(node, ast.If | ast.Try | ast.With):
            handlers = node.handlers if isinstance(node, ast.Try) else []
            for inner in (node.body, getattr(node, "orelse", []), *(one.body for one in handlers)):
                yield from _at_top(inner)


def _of_program(text: str, place: Path) -> Source:
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise ConfigError(
            "the command line cannot be taken apart", where=text, expected="quotes that close", got=error,
            remedy="correct the quotes",
        ) from None  # fmt: skip
    if missing := [name for name in FILES if f"{{{name}}}" not in text]:
        raise ConfigError(
            "this names no reference", where=text, expected=KINDS, got=f"words without {{{missing[0]}}}",
            remedy="of a program, write the whole command in quotes, as 'solver --in {inputs} --out {outputs}'; else "
            "check the path",
        )  # fmt: skip
    own = next((word for word in words if (place / word).is_file() and not Path(word).is_absolute()), words[0])
    return Source(
        text=text, name=Path(own).stem, content={"reference": {"program": words, "folder": str(place)}}
    )  # fmt: skip


def _of_table(path: Path) -> Source:
    """A YAML that says what it says of a pipeline of kind ``experiment``; paths in it are relative to it."""
    content = read_yaml(path)
    reference = content.get("reference")
    if not isinstance(reference, Mapping):
        raise ConfigError(
            "the file names no reference", where=path, expected="a table reference, with fmu, python or program in it",
            got=", ".join(map(str, content)) or "nothing", remedy="write reference: {python: file.py:function}",
        )  # fmt: skip
    place = (path.resolve().parent / str(reference.get("folder", "."))).resolve()
    told = {**reference, "folder": str(place)}
    if reference.get("fmu") is not None:
        told["fmu"] = str((place / str(reference["fmu"])).resolve())
    return Source(
        text=str(path), name=str(content.get("name", path.stem)), content={**content, "reference": told}, table=path
    )
