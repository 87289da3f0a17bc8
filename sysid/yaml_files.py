"""YAML files in, checked objects out, with errors that name the file and the field.

The loader is safe (plain data only), follows YAML 1.2 in what is a number and what is a truth value
(``no`` and ``on`` stay text, ``1e-3`` is a number), and refuses a key that stands twice.
"""

from __future__ import annotations

import difflib
import re
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from sysid.bounded_text import MOST_LEVELS, read_bounded
from sysid.errors import ConfigError, shortened

Model = TypeVar("Model", bound=BaseModel)
Loc = tuple[str | int, ...]
"""Where something stands in plain data: keys and indices."""


MOST_BYTES = 4 * 2**20
"""Of a file: some fifty thousand lines."""
MOST_DIGITS = 40
"""Of a whole number."""
MOST_VALUES = 1_000_000
"""In a file, an alias counting for all that it stands for."""


class _Plain(yaml.constructor.SafeConstructor):
    """Plain data only, YAML 1.2 scalars, no key twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[object] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str | int | float | bool | None):
                raise yaml.constructor.ConstructorError(None, None, "a key must be plain text", key_node.start_mark)
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key!r} stands twice", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep=deep)

    def construct_core_int(self, node: yaml.ScalarNode) -> int:
        text = self.construct_scalar(node)
        if len(text) > MOST_DIGITS:
            raise _refused(f"a whole number of {len(text):,} digits, {MOST_DIGITS} at most", node)
        return int(text, 0) if text[:2] in {"0o", "0x"} else int(text)

    def construct_core_float(self, node: yaml.ScalarNode) -> float:
        text = self.construct_scalar(node).lower()
        return float(text.replace(".inf", "inf").replace(".nan", "nan"))


def _refused(problem: str, node: yaml.Node) -> yaml.YAMLError:
    return yaml.constructor.ConstructorError(None, None, problem, node.start_mark)


class _Loader(_Plain, yaml.SafeLoader):
    """By the parser in Python, whose messages are the better ones."""


# An empty table of its own: YAML 1.1's notions of numbers and truth values are not inherited.
_Loader.yaml_implicit_resolvers = {}
_RESOLVERS = {
    "bool": (r"^(?:true|True|TRUE|false|False|FALSE)$", "tTfF"),
    "int": (r"^(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$", "-+0123456789"),
    "float": (
        r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$",
        "-+.0123456789",
    ),
    "null": (r"^(?:~|null|Null|NULL|)$", "~nN\0"),
}
for _kind, (_pattern, _first) in _RESOLVERS.items():
    # The empty first character stands for an empty scalar, which is null.
    _letters = [letter if letter != "\0" else "" for letter in _first]
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", re.compile(_pattern), _letters)
_Loader.yaml_constructors = {
    **_Loader.yaml_constructors,
    "tag:yaml.org,2002:int": _Loader.construct_core_int,
    "tag:yaml.org,2002:float": _Loader.construct_core_float,
}


if yaml.__with_libyaml__:

    class _QuickLoader(_Plain, yaml.CSafeLoader):
        """By the parser in C, where PyYAML was built with it: a sixth of the time."""

        yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers
        yaml_constructors = _Loader.yaml_constructors


class _Dumper(yaml.SafeDumper):
    """Quotes what the loader above would not read as text."""


_Dumper.yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers


def read_yaml(path: Path) -> dict[str, Any]:
    """Read a YAML file whose top level is a mapping.

    Args:
        path: The file, UTF-8.

    Returns:
        Plain data.

    Raises:
        ConfigError: If the file cannot be read, is not YAML, repeats a key, or is not a mapping.
    """
    try:
        text = read_bounded(path, most=MOST_BYTES).decode("utf-8-sig")
    except (OSError, ValueError) as error:
        raise ConfigError(
            "the file cannot be read",
            where=path,
            expected=f"a readable YAML file in UTF-8, of at most {MOST_BYTES // 2**20} MB",
            got=error,
            remedy="check the path, the permissions, the size and the encoding",
        ) from error
    return parse_yaml(text, where=path)


def parse_yaml(text: str, *, where: object) -> dict[str, Any]:
    r"""Parse YAML text whose top level is a mapping.

    Args:
        text: The YAML.
        where: Named in errors: the file it came from.

    Returns:
        Plain data.

    Raises:
        ConfigError: If it is not YAML, repeats a key, or is not a mapping.

    Example:
        >>> parse_yaml("sample_time: 1e-3\nanswer: no", where="example")
        {'sample_time': 0.001, 'answer': 'no'}
    """
    try:
        data = _plain_data(text)
    except (yaml.YAMLError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f"{where}, line {mark.line + 1}, column {mark.column + 1}" if mark else where
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        raise ConfigError(
            "the file is not valid YAML",
            where=place,
            expected="YAML: 'key: value' lines, indented by spaces",
            got="a tab" if "'\\t'" in problem else problem,
            remedy="indent by spaces" if "'\\t'" in problem else "correct the line that is named",
        ) from error
    if not isinstance(data, dict):
        raise ConfigError(
            "the file does not hold a mapping",
            where=where,
            expected="'key: value' lines at the top level",
            got="an empty file" if data is None else f"a {type(data).__name__}",
            remedy="start from an example: sysid init DIR writes a data set and a pipeline with comments",
        )
    return data


def _plain_data(text: str) -> Any:
    """What a text says, once it is known to stay within bounds."""
    try:
        if yaml.__with_libyaml__ and _is_shallow(text):
            return _constructed(_QuickLoader(text))
    except (yaml.YAMLError, ValueError):
        pass  # said below, in better words
    return _constructed(_Loader(text))


def _is_shallow(text: str) -> bool:
    """Whether lists lie in each other as deep as they may; the parser in C goes down without asking how far it may."""
    level = 0
    for event in yaml.parse(text, Loader=yaml.CSafeLoader):
        level += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if level > MOST_LEVELS:
            return False
    return True


def _constructed(loader: Any) -> Any:
    try:
        node = loader.get_single_node()
        if node is None:
            return None
        _extent(node, level=0, known={})
        return loader.construct_document(node)
    finally:
        loader.dispose()


def _extent(node: yaml.Node, *, level: int, known: dict[int, int | None]) -> int:
    """How many values a node stands for, with its aliases written out; refused where they are too many or too deep."""
    if isinstance(node, yaml.ScalarNode):
        return 1
    if level > MOST_LEVELS:
        raise _refused(f"lists lie more than {MOST_LEVELS} deep in each other", node)
    if id(node) in known:
        values = known[id(node)]
        if values is None:
            raise _refused("a list that contains itself", node)
        return values
    known[id(node)] = None
    # Keys too: one that is a list is refused later, whatever it holds.
    parts = [part for entry in node.value for part in (entry if isinstance(entry, tuple) else (entry,))]
    count = 1 + sum(_extent(part, level=level + 1, known=known) for part in parts)
    if count > MOST_VALUES:
        raise _refused(f"more than {MOST_VALUES:,} values, with the aliases written out", node)
    known[id(node)] = count
    return count


def yaml_text(data: Mapping[str, Any]) -> str:
    r"""Plain data as YAML that :func:`parse_yaml` reads as the same data.

    Args:
        data: Plain data.

    Returns:
        The YAML, its keys in their order.

    Example:
        >>> yaml_text({"sample_time": 1e-3, "words": ["no", "1e-3"]})
        "sample_time: 0.001\nwords: [no, '1e-3']\n"
    """
    text: str = yaml.dump(dict(data), Dumper=_Dumper, sort_keys=False, width=116, default_flow_style=None)
    return text


@dataclass(frozen=True, kw_only=True)
class Origins:
    """Where data stand that were put together from several files, so that an error names the file at fault.

    Args:
        file: The file of everything that ``parts`` does not name.
        parts: What stands elsewhere, by its location in the whole: the origins of it, and its location there.
    """

    file: object
    parts: Mapping[Loc, tuple[Origins, Loc]] = field(default_factory=dict)

    def of(self, loc: Sequence[str | int]) -> tuple[object, Loc]:
        """The file in which a part of the whole stands.

        Args:
            loc: Keys and indices in the whole.

        Returns:
            The file, and keys and indices there.
        """
        for length in range(len(loc), 0, -1):
            if (found := self.parts.get(tuple(loc[:length]))) is not None:
                origins, there = found
                return origins.of((*there, *loc[length:]))
        return self.file, tuple(loc)

    def place(self, loc: Sequence[str | int]) -> str:
        """Where a part of the whole stands, as an error names it.

        Args:
            loc: Keys and indices in the whole.

        Returns:
            For example ``valve.yaml, line 7, field channels[0].unit``.
        """
        file, there = self.of(loc)
        return f"{file}{_line_of(file, there)}, field {path_text(there)}"


def check(model: type[Model], data: Mapping[str, Any], *, where: object) -> Model:
    """Check plain data against a model.

    Args:
        model: The pydantic model.
        data: Plain data, as from :func:`read_yaml`.
        where: Named in errors: the file the data came from, or the :class:`Origins` of its parts.

    Returns:
        The checked object.

    Raises:
        ConfigError: Naming the first field at fault, what was expected, what came and, for a
            misspelt field, what was probably meant; further fields at fault are named too.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        origins = where if isinstance(where, Origins) else Origins(file=where)
        raise _config_error(error, model, origins) from None


def _config_error(error: ValidationError, model: type[BaseModel], origins: Origins) -> ConfigError:
    # A misspelt field usually causes the "missing" beside it: name the cause first.
    found = sorted(error.errors(include_url=False), key=lambda item: item["type"] != "extra_forbidden")
    first = found[0]
    loc = first["loc"]
    # What holds the first one, such as a list that is one too short without it, is not at fault itself.
    others = [item for item in found[1:] if item["loc"] != loc[: len(item["loc"])]]
    what: str
    expected: object
    got: object
    remedy = "correct the value"
    if first["type"] == "extra_forbidden":
        known = _fields_at(model, loc[:-1])
        near = difflib.get_close_matches(str(loc[-1]), known, n=1)
        what, expected, got = f"unknown field {loc[-1]!r}", f"one of {', '.join(known)}", str(loc[-1])
        remedy = f"did you mean {near[0]}?" if near else "remove it, or use one of the fields that are known"
    elif first["type"] == "missing":
        what, expected, got = (
            f"the field {loc[-1]!r} is missing",
            _names_at(model, loc, f"a value for {loc[-1]}"),
            "nothing",
        )
        remedy = f"add {loc[-1]}: ..."
    elif first["type"] == "value_error":
        cause = first.get("ctx", {}).get("error")
        what, expected, got = str(cause), None, None
        if isinstance(cause, FieldError):
            what, expected, got, remedy = cause.what, cause.expected, cause.got, cause.remedy
    else:
        wanted = first["msg"].removeprefix("Input should be ").split(", unable to parse")[0]
        what, expected, got = (
            f"{path_text(origins.of(loc)[1])} cannot be used as it is",
            wanted,
            shortened(first["input"]),
        )
        expected, remedy = _CHANGES.get(first["type"], (expected, remedy))
        if expected == _NAMES:
            expected = _names_at(model, loc, _NAMES)
        if first["type"] in {"enum", "literal_error"}:
            remedy = _choice(str(first["input"]), str(first.get("ctx", {}).get("expected", "")))
    if others:
        remedy += f" (also at fault: {', '.join(sorted({_beside(loc, item['loc'], origins) for item in others}))})"
    return ConfigError(what, where=origins.place(loc), expected=expected, got=got, remedy=remedy)


_LIST = ("a list", "write a list: [..., ...], or one entry a line with - before it")
_NAMES = "names with values"
_UNIONS = (typing.Union, types.UnionType)
_CHANGES: dict[str, tuple[str, str]] = {
    **dict.fromkeys(("tuple_type", "list_type"), _LIST),
    **dict.fromkeys(("dict_type", "model_type", "model_attributes_type"), (_NAMES, "write {name: value}")),
    "string_type": ("text", "write it in quotes"),
    "bool_type": ("true or false", "write true or false"),
    "bool_parsing": ("true or false", "write true or false"),
}
"""What was expected, and what to write, by pydantic's kind of error."""


def _choice(given: str, expected: str) -> str:
    """The one of some words that was probably meant, or the first of them."""
    words = re.findall(r"'([^']*)'", expected)
    near = difflib.get_close_matches(given, words, n=1)
    if near:
        return f"did you mean {near[0]}?"
    return f"write one of them, such as {words[0]}" if words else "correct the value"


def _beside(first: Sequence[str | int], loc: Sequence[str | int], origins: Origins) -> str:
    """A further field at fault, with its file where that is not the first one's."""
    file, there = origins.of(loc)
    return path_text(there) if file == origins.of(first)[0] else f"{path_text(there)} in {file}"


def _line_of(where: object, loc: Sequence[str | int]) -> str:
    """``", line 7"`` for the deepest part of a location that is written in the file, if it was a file."""
    if not isinstance(where, Path):
        return ""
    try:
        node = yaml.compose(where.read_text(encoding="utf-8-sig"), Loader=_Loader)
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        # It was read a moment ago; if it cannot be now, the field alone has to do.
        return ""
    line = None
    for part in loc:
        if isinstance(node, yaml.MappingNode):
            found = next(((key, value) for key, value in node.value if key.value == str(part)), None)
            if found is None:
                break
            line, node = found[0].start_mark.line, found[1]
        elif isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
            node = node.value[part]
            line = node.start_mark.line
    return "" if line is None else f", line {line + 1}"


class FieldError(ValueError):
    """Raised inside a pydantic validator to say what, expected, got and remedy.

    Args:
        what: What is wrong.
        expected: What would have been accepted.
        got: What came.
        remedy: What to do.
    """

    def __init__(self, what: str, *, expected: object = None, got: object = None, remedy: str) -> None:
        super().__init__(what)
        self.what = what
        self.expected = expected
        self.got = got
        self.remedy = remedy


def path_text(loc: Sequence[str | int]) -> str:
    """A pydantic location as an engineer writes it.

    Args:
        loc: Keys and indices.

    Returns:
        For example ``channels[0].unit``.

    Example:
        >>> path_text(("channels", 0, "unit"))
        'channels[0].unit'
    """
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc)
    return text.removeprefix(".") or "(top level)"


def _names_at(model: type[BaseModel], loc: Sequence[str | int], otherwise: str) -> str:
    """Which names a mapping at a location may have; some other words where that is not known."""
    annotation = _annotation_at(model, loc)
    alone = all(typing.get_origin(one) is None for one in (typing.get_args(annotation) or (annotation,)))
    known = _fields_at(model, loc) if alone and typing.get_origin(annotation) in (None, *_UNIONS) else []
    return f"{_NAMES}, of {', '.join(known)}" if known else otherwise


def _fields_at(model: type[BaseModel], loc: Sequence[str | int]) -> list[str]:
    """Names of the fields of the model that stands at a location inside another."""
    found = _model_in(_annotation_at(model, loc))
    return [] if found is None else list(found.model_fields)


def _annotation_at(model: type[BaseModel], loc: Sequence[str | int]) -> Any:
    """The type of what stands at a location inside a model; ``None`` where that is not known."""
    current: Any = model
    for part in loc:
        current = _model_in(current)
        if current is None:
            return None
        # An index, or a key of a free mapping, stays at the model that the container holds.
        if isinstance(part, str) and part in current.model_fields:
            current = current.model_fields[part].annotation
    return current


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The first pydantic model inside an annotation such as ``tuple[Model, ...] | None``."""
    if not typing.get_args(annotation):
        return annotation if isinstance(annotation, type) and issubclass(annotation, BaseModel) else None
    for argument in typing.get_args(annotation):
        inner = _model_in(argument)
        if inner is not None:
            return inner
    return None
