"""The options of the readers on the command line, made from the one model that ``dataset.yaml`` is checked by."""

from __future__ import annotations

import inspect
import re
import typing
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from types import UnionType
from typing import TYPE_CHECKING, Any, Literal

from typer.core import TyperCommand

from sysid.errors import ConfigError, UserError

if TYPE_CHECKING:
    from sysid.ingest import FileOptions

META = "sysid.reader_options"
"""Where a command finds what was given, in the context's ``meta``."""
TYPED = "sysid.typed"
"""Where it finds every word that was typed behind its name."""

_APART = frozenset({"columns", "units", "references"})
"""What the proposal itself says of each channel."""

_GROUPS = {
    "repairs": "A repair that may be made, as nan=interpolate, gaps=linear, jitter=resample, duplicates=drop.",
    "grid": "How samples come onto the sample time of the bundle, as method=average or method=linear.",
}

_SHORT = {"time_zone": "zone", "time_column": "time"}
_MARKS = {"\\t": "\t", "tab": "\t", "blank": " ", "space": " "}


@dataclass(frozen=True, kw_only=True)
class ReaderOption:
    """An option of the readers.

    Args:
        flag: As it is typed.
        place: Where its value belongs in the options, outermost first.
        truth: Whether it is a truth value: ``--flag`` or ``--no-flag``.
        literal: Whether its value is text as it stands, no YAML.
        repeated: Whether it may be given several times.
        told: What it is.
    """

    flag: str
    place: tuple[str, ...]
    truth: bool
    literal: bool
    repeated: bool
    told: str


class ReaderCommand(TyperCommand):
    """A command that takes the readers' options beside its own; they are imported only where one is given."""

    whole = False
    """Whether columns and units by channel, repairs and the grid are options of it too."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take the readers' options out, and leave the rest to the command."""
        own = {word for parameter in self.params for word in (*parameter.opts, *parameter.secondary_opts)}
        foreign = [
            word for word in args if word.startswith("--") and word.split("=", 1)[0] not in {*own, "--help", "--"}
        ]
        given, rest = take_options(args, whole=self.whole) if foreign else ({}, args)
        ctx.meta[META], ctx.meta[TYPED] = given, tuple(args)
        return super().parse_args(ctx, rest)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """The command's help, and the readers' options below it."""
        from rich.console import Console
        from rich.table import Table

        super().format_help(ctx, formatter)
        table = Table(
            title="How the file is read, as in dataset.yaml under source: files:", title_justify="left", box=None
        )
        table.add_column("option", no_wrap=True)
        table.add_column("")
        for option in reader_options(whole=self.whole).values():
            table.add_row(option.flag + (f", --no-{option.flag[2:]}" if option.truth else ""), option.told)
        Console(highlight=False).print(table, markup=False)


class RecordCommand(ReaderCommand):
    """A command that makes a record of a file, with no ``dataset.yaml`` beside it."""

    whole = True


def reading_options(given: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a :class:`RecordCommand` as those who read records take them.

    Args:
        given: From the context's ``meta``.

    Returns:
        ``files``, ``repairs`` and ``grid``, those that were given.

    Raises:
        ConfigError: If a value cannot be.
    """
    from sysid.field_checks import check
    from sysid.ingest import GridOptions, RepairOptions

    parts: dict[str, type[Any]] = {"repairs": RepairOptions, "grid": GridOptions}
    defaults = {"grid": {"fewest_samples": 2}}
    found: dict[str, Any] = {
        name: check(kind, {**defaults.get(name, {}), **given[name]}, where=f"the command line, --{name}")
        for name, kind in parts.items()
        if name in given
    }
    files = {name: value for name, value in given.items() if name not in parts}
    return found | ({"files": files_from(files)} if files else {})


@contextmanager
def as_typed(*, whole: bool = True) -> Iterator[None]:
    """What is refused within says what helps as it is typed, not as it stands in a ``dataset.yaml``.

    Args:
        whole: Whether the command takes columns, units, repairs and the grid, too.
    """
    try:
        yield
    except UserError as error:
        if error.remedy is None:
            raise
        told = typed(error.remedy, whole=whole)
        if told == error.remedy:
            raise
        raise UserError(error.what, where=error.where, expected=error.expected, got=error.got, remedy=told) from error


def typed(text: str, *, whole: bool = True) -> str:
    """Options of a data set as options of a command.

    Args:
        text: A remedy.
        whole: Whether the command takes columns, units, repairs and the grid, too.

    Returns:
        The same, with ``repairs: {nan: hold}`` as ``--repairs nan=hold`` and ``files: {time: 't [ms]'}`` as
        ``--time 't [ms]'``.

    Example:
        >>> typed("ask for repairs: {gaps: linear} or {gaps: hold}; (grid: {longest_step: ...})")
        'ask for --repairs gaps=linear or --repairs gaps=hold; (--grid longest_step=...)'
        >>> typed("write files: {units: {u: V, y: rad/s}}")
        'write --units u=V --units y=rad/s'
        >>> typed("write missing: ['abc']; if for a state, states: {'abc': 0}")
        "write --missing 'abc'; if for a state, --states 'abc'=0"
        >>> typed("write time: {column: ..., unit: datetime}, or decimal: ','")
        "write --time ... --time-unit datetime, or --decimal ','"
    """
    section, there = "", {option.place[0] for option in reader_options(whole=whole).values()}

    def option(found: re.Match[str]) -> str:
        nonlocal section
        section = found[1] or section
        mine = (found[2] if section == "files" else section) in there
        return _flags(section, found[2], found[3].strip()) if mine else found[0]

    def bare(found: re.Match[str]) -> str:
        return _flags("files", found[1], found[2])

    said = re.sub(r"(?:(repairs|grid|files): )?\{(\w+): (\{[^{}]*\}|[^{}]*)\}", option, text)
    names = "|".join(sorted(there - {*_GROUPS}))
    said = re.sub(rf"(?<![-\w{{])({names}): (\{{[^{{}}]*\}}|\[[^][]*\]|'[^']*'|\w*\d[\w-]*)", bare, said)
    return said.replace(" in a dataset.yaml", "").replace(" to source", "")


def _flags(section: str, name: str, value: str) -> str:
    """An option of a section as it is typed; a number of values is an option each."""
    if section != "files":
        return f"--{section} {name}={value}"
    flags = {option.place: option.flag for option in reader_options(whole=True).values()}
    if value.startswith("{"):
        pairs = [pair.split(": ", 1) for pair in re.split(r", (?=[^,:]+: )", value[1:-1])]
        return " ".join(
            f"{flags[name, key]} {one}" if (name, key) in flags else f"{flags.get((name,), f'--{name}')} {key}={one}"
            for key, one in pairs
        )
    flag = flags.get((name,)) or flags.get((name, "column"), f"--{name}")
    return " ".join(f"{flag} {one}" for one in (re.split(", ?", value[1:-1]) if value.startswith("[") else [value]))


def files_from(given: Mapping[str, Any]) -> FileOptions:
    """The options as the readers take them.

    Args:
        given: From the context's ``meta``.

    Returns:
        The options.

    Raises:
        ConfigError: If a value cannot be.
    """
    from sysid.field_checks import check
    from sysid.ingest import FileOptions

    return check(FileOptions, given, where="the command line") if given else FileOptions()


def take_options(words: Sequence[str], *, whole: bool = False) -> tuple[dict[str, Any], list[str]]:
    """The readers' options among the words of a command line.

    Args:
        words: For example ``["log.csv", "--separator", ";", "--states", "OFF=0"]``.
        whole: Whether columns and units by channel, repairs and the grid are among them.

    Returns:
        The options as plain data, and the words that are left.

    Raises:
        ConfigError: If a value is missing or cannot be read.
    """
    known = reader_options(whole=whole)
    given: dict[str, Any] = {}
    rest: list[str] = []
    queue = list(words)
    while queue:
        word = queue.pop(0)
        flag, equals, value = word.partition("=")
        option = known.get(flag)
        negated = known.get("--" + flag.removeprefix("--no-")) if flag.startswith("--no-") else None
        if option is None and (negated is None or not negated.truth):
            rest.append(word)
        elif option is None or option.truth:
            _put(given, (option or typing.cast("ReaderOption", negated)).place, option is not None)
        else:
            if not equals and not queue:
                raise _bad(option, "nothing after it")
            _add(given, option, value if equals else queue.pop(0))
    return given, rest


def _put(given: dict[str, Any], place: tuple[str, ...], value: object) -> None:
    for part in place[:-1]:
        given = given.setdefault(part, {})
    given[place[-1]] = value


def _add(given: dict[str, Any], option: ReaderOption, text: str) -> None:
    value = _MARKS.get(text, text) if option.literal else _plain(option, text)
    before: Any = given
    for part in option.place:
        before = before.get(part, {}) if isinstance(before, dict) else {}
    if isinstance(value, dict) and isinstance(before, dict):
        value = {**before, **value, **(_more_masks(before, value) if option.place == ("repairs",) else {})}
    elif option.repeated:
        value = [*(before or []), *(value if isinstance(value, list) else [text])]
    _put(given, option.place, value)


def _more_masks(before: dict[str, Any], value: dict[str, Any]) -> dict[str, Any]:
    """The stretches of ``--repairs mask=...`` that is given again: none of them is forgotten."""
    given = [one["mask"] for one in (before, value) if isinstance(one.get("mask"), list | dict)]
    each = [part if isinstance(part, list) else [part] for part in given]
    return {"mask": [*each[0], *each[1]]} if len(each) > 1 else {}


def _plain(option: ReaderOption, text: str) -> Any:
    """A value as YAML; ``OFF=0`` is short for ``{OFF: 0}``."""
    from sysid.yaml_files import parse_yaml

    pair = None if option.repeated else re.fullmatch(r"([^={\[][^=]*)=(.+)", text)
    try:
        value = parse_yaml(f"value: {pair[2] if pair else text}", where=f"the command line, {option.flag}")["value"]
        return {pair[1]: value} if pair else value
    except ConfigError:
        if option.repeated:
            return [text]
        raise


def _bad(option: ReaderOption, got: str) -> ConfigError:
    return ConfigError(
        f"{option.flag} needs a value",
        where="the command line",
        expected=option.told,
        got=got,
        remedy=f"write it behind the option: {option.flag} VALUE",
    )


@cache
def reader_options(*, whole: bool = False) -> dict[str, ReaderOption]:
    """Every option of the readers that can be typed, by its flag.

    Args:
        whole: Whether columns and units by channel, repairs and the grid are among them.
    """
    from pydantic import BaseModel

    from sysid.ingest import FileOptions

    found = []

    def walk(model: type[BaseModel], place: tuple[str, ...]) -> None:
        told = _told(model)
        for name, field in model.model_fields.items():
            inner = next(
                (t for t in _types(field.annotation) if isinstance(t, type) and issubclass(t, BaseModel)), None
            )
            if not place and name in _APART and not whole:
                continue
            if inner is not None:
                walk(inner, (*place, name))
                continue
            found.append(_option((*place, name), _types(field.annotation), told.get(name, "")))

    walk(FileOptions, ())
    if whole:
        found += [
            ReaderOption(flag=f"--{name}", place=(name,), truth=False, literal=False, repeated=False, told=told)
            for name, told in _GROUPS.items()
        ]
    return {option.flag: option for option in found}


def _option(place: tuple[str, ...], types: Sequence[Any], told: str) -> ReaderOption:
    name = "_".join(place)
    texts = {str} | {kind for kind in types if typing.get_origin(kind) is Literal}
    return ReaderOption(
        flag="--" + _SHORT.get(name, name).replace("_", "-"),
        place=place,
        truth=bool in types,
        literal=all(kind in texts or kind is type(None) for kind in types),
        repeated=any(typing.get_origin(kind) is tuple and ... in typing.get_args(kind) for kind in types),
        told=told,
    )


def _types(annotation: Any) -> tuple[Any, ...]:
    """The alternatives of an annotation."""
    if typing.get_origin(annotation) in {typing.Union, UnionType}:
        return tuple(kind for part in typing.get_args(annotation) for kind in _types(part))
    if typing.get_origin(annotation) is typing.Annotated:
        return _types(typing.get_args(annotation)[0])
    return (annotation,)


def _told(model: type[Any]) -> dict[str, str]:
    """What the docstring of a model says of each of its fields."""
    lines = inspect.getdoc(model) or ""
    entries = re.findall(r"^ {4}(\w+): (.*(?:\n {8,}.*)*)", lines, re.MULTILINE)
    return {name: " ".join(text.split()).replace("``", "") for name, text in entries}
