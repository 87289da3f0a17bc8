"""YAML files in, plain data out, and back.

The loader is safe (plain data only), follows YAML 1.2 in what is a number and what is a truth value
(``no`` and ``on`` stay text, ``1e-3`` is a number), and refuses a key that stands twice.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from sysid.bounded_text import MOST_LEVELS, read_bounded
from sysid.errors import ConfigError

MOST_BYTES = 4 * 2**20
"""Of a file: some fifty thousand lines."""
MOST_DIGITS = 40
"""Of a whole number."""
MOST_VALUES = 1_000_000
"""In a file, an alias counting for all that it stands for."""


_MERGE = "tag:yaml.org,2002:merge"


class _Plain(yaml.constructor.SafeConstructor):
    """Plain data only, YAML 1.2 scalars, no key twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[object] = set()
        for key_node, _ in node.value:
            if key_node.tag == _MERGE:
                continue
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
_Loader.add_implicit_resolver(_MERGE, re.compile(r"^<<$"), ["<"])
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
            remedy=_remedy(problem),
        ) from error
    if not isinstance(data, dict):
        raise ConfigError(
            "the file does not hold a mapping",
            where=where,
            expected="'key: value' lines at the top level",
            got="an empty file" if data is None else "a list" if isinstance(data, list) else "a single value",
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


def _remedy(problem: str) -> str:
    if "'\\t'" in problem:
        return "indent by spaces"
    if "cannot start any token" in problem:
        return "put the text in quotes, as in unit: '%'"
    return "correct the line that is named"


def yaml_text(data: Mapping[str, Any]) -> str:
    r"""Plain data as YAML that :func:`parse_yaml` reads as the same data.

    Args:
        data: Plain data.

    Returns:
        The YAML, its keys in their order.

    Example:
        >>> yaml_text({"sample_time": 1e-3, "words": ["no", "1e-3"]})
        "sample_time: 0.001\nwords: [no, '1e-3']\n"
        >>> yaml_text({"größe": {"unit": "mm", "range": [0, 1]}})
        'größe:\n  unit: mm\n  range: [0, 1]\n'
    """
    as_it_is: dict[str, Any] = {"sort_keys": False, "width": 116, "default_flow_style": None}
    escaped, shown = (
        str(yaml.dump(dict(data), Dumper=_Dumper, allow_unicode=one, **as_it_is)) for one in (False, True)
    )
    # Other signs for the end of a line are written as they are, and read as a blank.
    return escaped if re.search(r"\\[NLP]", escaped) else shown


def line_of(where: object, loc: Sequence[str | int]) -> str:
    """The line of a file at which a part of its data stands.

    Args:
        where: The file; anything else has no lines.
        loc: Keys and indices.

    Returns:
        ``", line 7"`` for the deepest part of the location that is written there; empty where there is none.
    """
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
