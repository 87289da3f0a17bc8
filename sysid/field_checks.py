"""Plain data held against their fields, with errors that name the file, the line and the field."""

from __future__ import annotations

import re
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, Field, ValidationError

from sysid.errors import ConfigError, did_you_mean, shortened
from sysid.names import slug
from sysid.yaml_files import line_of

Model = TypeVar("Model", bound=BaseModel)
_FOLDER = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"
FolderName = Annotated[str, Field(pattern=_FOLDER, max_length=100)]
"""A name that folders are called by, on any file system."""
Loc = tuple[str | int, ...]
"""Where something stands in plain data: keys and indices."""


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
        return f"{file}{line_of(file, there)}, field {path_text(there)}" if there else str(file)


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
    origins = where if isinstance(where, Origins) else Origins(file=where)
    try:
        checked = model.model_validate(data)
    except ValidationError as error:
        found = [{**one, "loc": _in_data(one["loc"], data)} for one in error.errors(include_url=False)]
        raise _config_error(found, model, origins) from None
    for loc, given in _misread(data, checked, ()):
        number = isinstance(given, bool)
        raise ConfigError(
            f"{path_text(origins.of(loc)[1])} cannot be used as it is", where=origins.place(loc),
            expected="a number" if number else "true or false", got=given,
            remedy="write a number" if number else "write true or false",
        )  # fmt: skip
    return checked


def _misread(data: object, found: object, loc: Loc) -> Iterator[tuple[Loc, object]]:
    """Where ``true`` became a number, or a number ``true``: pydantic reads one as the other, Python's door neither."""
    kinds = (bool, int, float)
    if isinstance(data, kinds) and isinstance(found, kinds):
        if isinstance(data, bool) != isinstance(found, bool):
            yield loc, data
    elif isinstance(data, Mapping) and isinstance(found, Mapping | BaseModel):
        for name, value in data.items():
            inner = found.get(name) if isinstance(found, Mapping) else getattr(found, str(name), None)
            yield from _misread(value, inner, (*loc, name))
    elif isinstance(data, list | tuple) and isinstance(found, list | tuple) and len(data) == len(found):
        for number, pair in enumerate(zip(data, found, strict=True)):
            yield from _misread(*pair, (*loc, number))


_FORM = re.compile(r"(str|int|float|bool|none)$|[a-z-]+\[")
"""What pydantic calls the forms that a field may have: ``str``, ``dict[str,float]``."""


_ELSEWHERE = {"detrend": ("drift",), "resample": ("grid",), "misdata": ("nan", "gaps"), "merge": ("cases",)}
"""What some fields are called in other tools, in small letters."""
_OTHERWISE = {
    **dict.fromkeys(
        ("filter", "prefilter", "idfilt", "focus", "weightingfilter", "lowpass", "highpass", "bandpass"),
        "no record is filtered: take a structure with a model of the noise (BJ), grid: {method: average}, or repairs: "
        "{drift: ...} (docs/how/filters.md)",
    ),
    **dict.fromkeys(
        ("split", "train_size", "test_size", "validation_split"),
        "parts of one file are cases of a data set: cases: {fit: {role: estimation, file: a.csv, rows: [1, 900]}, "
        "unseen: {role: validation, file: a.csv, rows: [901, 1200]}}",
    ),
}
"""What is done here in another way than by a field."""


def _elsewhere(known: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Those words of other tools that stand for fields which there are here."""
    return {word: ones for word, ones in _ELSEWHERE.items() if set(ones) <= set(known)}


def _in_data(loc: Loc, data: object) -> Loc:
    """A pydantic location as it is in the data: without the form that was tried of a field that may have several."""
    there: list[str | int] = []
    for part in loc:
        known = isinstance(data, Mapping) and part in data
        if not known and isinstance(part, str) and _FORM.match(part):
            continue
        listed = isinstance(data, list | tuple) and isinstance(part, int) and part < len(data)
        data = data[part] if known or listed else None  # type: ignore[index]
        there.append(part)
    return tuple(there)


def _config_error(found: list[dict[str, Any]], model: type[BaseModel], origins: Origins) -> ConfigError:
    # A misspelt field usually causes the "missing" beside it: name the cause first.
    # What holds another, such as a list that is one too short without it, is not at fault itself.
    found = [item for item in found if not any(_inside(other["loc"], item["loc"]) for other in found)]
    first, *others = sorted(found, key=lambda item: item["type"] != "extra_forbidden")
    loc = first["loc"]
    others = [item for item in others if item["loc"] != loc]
    what: str
    expected: object
    got: object
    remedy = "correct the value"
    if first["type"] == "extra_forbidden":
        known = _fields_at(model, loc[:-1])
        what, expected, got = f"unknown field {loc[-1]!r}", f"one of {', '.join(known)}", str(loc[-1])
        otherwise = _OTHERWISE.get(loc[-1])
        rest = otherwise or "remove it, or use one of the fields that are known"
        remedy = did_you_mean(loc[-1], () if otherwise else known, rest, also=_elsewhere(known))
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
        what = f"{path_text(origins.of(loc)[1])} cannot be used as it is"
        got = shortened(first["input"])
        expected, remedy = _another_value(first, model, remedy)
    if others:
        remedy += f" (also at fault: {', '.join(sorted({_beside(loc, item['loc'], origins) for item in others}))})"
    return ConfigError(what, where=origins.place(loc), expected=expected, got=got, remedy=remedy)


def _another_value(first: dict[str, Any], model: type[BaseModel], remedy: str) -> tuple[object, str]:
    """What a value of another kind or size had to be, and what to do about it."""
    loc, kind, limits = first["loc"], first["type"], first.get("ctx", {})
    wanted = first["msg"].removeprefix("Input should be ").split(", unable to parse")[0]
    expected: object
    expected, remedy = _CHANGES.get(kind, (wanted, remedy))
    if first["input"] is None:
        remedy = f"give {loc[-1]} a value" if loc else remedy
    elif kind == "string_type" and isinstance(first["input"], list | tuple | Mapping):
        remedy = "write one text, without brackets"
    elif limits.get("pattern") == _FOLDER:
        expected = "a name of letters, digits, dots, dashes and underscores, that begins with a letter or a digit"
        remedy = f"write for example {slug(str(first['input']))}"
    if kind in {"too_short", "too_long"}:  # its own words are Python's
        least, most = (limits.get(f"{end}_length") for end in ("min", "max"))
        expected = f"at least {_counted(least)}" if most is None else f"at most {_counted(most)}"
    if expected == _NAMES:
        expected = _names_at(model, loc, _NAMES)
    if kind in {"enum", "literal_error"}:
        remedy = _choice(str(first["input"]), str(limits.get("expected", "")))
    return expected, remedy


def _inside(loc: Loc, holder: Loc) -> bool:
    return len(loc) > len(holder) and loc[: len(holder)] == holder


def _counted(entries: object) -> str:
    """So many entries of a list, in words."""
    return f"{entries} {'entry' if entries == 1 else 'entries'}"


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
    return did_you_mean(given, words, f"write one of them, such as {words[0]}" if words else "correct the value")


def _beside(first: Sequence[str | int], loc: Sequence[str | int], origins: Origins) -> str:
    """A further field at fault, with its file where that is not the first one's."""
    file, there = origins.of(loc)
    return path_text(there) if file == origins.of(first)[0] else f"{path_text(there)} in {file}"


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
