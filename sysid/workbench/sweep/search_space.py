"""What a sweep can try: structures and training options with ranges in their fields, and the points in them."""

from __future__ import annotations

import itertools
import math
import re
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from pydantic import BaseModel

from sysid.errors import ConfigError, shortened
from sysid.estimation import Training
from sysid.estimation.estimator import Estimator
from sysid.estimation.estimators import ESTIMATORS
from sysid.field_checks import check
from sysid.models import AbstractStructure
from sysid.models.orders.ranges import WORD, AbstractRange, declared_ranges, parse_range
from sysid.workbench.fields import StructureField, given_options, options_of
from sysid.workbench.old_words import STRICT
from sysid.workbench.runner.store import digest

MAX_POINTS = 100_000
"""Points of a sweep: more cannot be tried, and to list them takes minutes."""

TRAINING = "training."
"""Begins the name of a dimension that belongs to the training."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Point:
    """One thing to try.

    Args:
        number: Its place in the grid, from 1 on.
        structure: What is fitted.
        training: Options of the training, as they differ from the default; empty for a linear model.
        values: Where it lies in the ranges: the value of each dimension, by name.
        alternative: Which of the structures it belongs to, from 0 on.
    """

    number: int
    structure: AbstractStructure
    training: Mapping[str, Any]
    values: Mapping[str, Any]
    alternative: int = 0

    def seed(self, sweep: int) -> int:
        """The seed of its training, from what it is and not from when it is trained.

        Args:
            sweep: Seed of the sweep.

        Returns:
            A number of 31 bits.
        """
        terms = {"structure": self.structure.to_dict(), "training": dict(self.training), "sweep": sweep}
        return int(digest(terms)[:8], 16) >> 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Dimension:
    """One field with a range.

    Args:
        name: The field: ``neurons``, ``nb[1]``, ``na[0][1]``, ``training.regularisation``.
        values: The values, in order.
        numeric: Whether neighbours in the list are neighbours in meaning.
    """

    name: str
    values: tuple[Any, ...]
    numeric: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Alternative:
    """One structure with its ranges.

    Args:
        written: The structure's fields as written.
        training: The training's options as written.
        dimensions: Fields with a range, in the order written: the last changes fastest in a grid.
        n_inputs: Inputs of the mapping.
        where: Named in errors.
    """

    written: Mapping[str, Any]
    training: Mapping[str, Any]
    dimensions: tuple[Dimension, ...]
    n_inputs: int
    where: str

    def point(self, values: Mapping[str, Any], number: int) -> Point:
        """The point at some values.

        Args:
            values: By dimension.
            number: Its place in the grid.

        Returns:
            The point.

        Raises:
            ConfigError: If these values do not go together.
        """
        fields: dict[str, Any] = {}
        for name, written in self.written.items():
            fields[name] = _at(name, written, values)
        structure = _checked(fields, self.where).for_inputs(self.n_inputs)
        options = {name: values.get(TRAINING + name, written) for name, written in self.training.items()}
        return Point(number=number, structure=structure, training=options, values=dict(values))


@dataclass(frozen=True, kw_only=True, eq=False)
class Space:
    """Everything that can be tried.

    Args:
        alternatives: Structures with their ranges.
    """

    alternatives: tuple[Alternative, ...]
    _points: list[Point] = field(default_factory=list)

    def points(self) -> list[Point]:
        """Every point that makes a structure, each once, in the order of the grid.

        Raises:
            ConfigError: If none does; the first reason is told.
        """
        if self._points:
            return self._points
        n = sum(math.prod(len(dimension.values) for dimension in one.dimensions) for one in self.alternatives)
        if n > MAX_POINTS:
            raise ConfigError(
                f"the ranges hold {n:,} points",
                where=self.alternatives[0].where,
                expected=f"up to {MAX_POINTS:,}, each of which is checked before the first is tried",
                remedy="give the ranges a step, or leave one of them out",
            )
        seen: set[str] = set()
        reason: ConfigError | None = None
        for index, alternative in enumerate(self.alternatives):
            names = [dimension.name for dimension in alternative.dimensions]
            for values in itertools.product(*(dimension.values for dimension in alternative.dimensions)):
                try:
                    point = alternative.point(dict(zip(names, values, strict=True)), len(self._points) + 1)
                except ConfigError as error:
                    # More zeros than poles, say: no structure, and nothing to try.
                    reason = reason or error
                    continue
                name = digest({"structure": point.structure.to_dict(), "training": dict(point.training)})
                if name not in seen:
                    seen.add(name)
                    self._points.append(replace(point, alternative=index))
        if not self._points:
            raise reason or ConfigError("the sweep has nothing to try", remedy="write a structure")
        return self._points


def parse_space(
    structures: Sequence[Mapping[str, Any]], training: Mapping[str, Any], n_inputs: int, *, where: str = "structure"
) -> Space:
    """The space that a sweep's YAML describes.

    Args:
        structures: Fields of each structure, with ranges.
        training: Options of the training, with ranges.
        n_inputs: Inputs of the mapping.
        where: Named in errors.

    Returns:
        The space.

    Raises:
        ConfigError: If a range cannot be read, or the training has no such option.

    Example:
        >>> space = parse_space([{"kind": "NARX", "input_delays": 1, "output_delays": 1, "neurons": "range"}], {}, 2)
        >>> len(space.points()), space.points()[-1].structure.label
        (20, 'NARX 1/1/20')
    """
    options = [_dimension(TRAINING + name, value, None) for name, value in training.items()]
    swept = tuple(dimension for dimension in options if dimension is not None)
    trained = _trained(structures, training)
    for row in trained.values():
        _check_training(row, {n: v for n, v in training.items() if TRAINING + n not in {d.name for d in swept}}, swept)
    alternatives = []
    for written in structures:
        takes = written.get("kind") in trained
        declared: dict[str, AbstractRange] = {}
        if written.get("kind") in ESTIMATORS:
            declared = declared_ranges(ESTIMATORS[written["kind"]].structure)
        dimensions: list[Dimension] = []
        for name, value in written.items():
            dimensions += _dimensions(name, value, declared.get(name))
        alternatives.append(
            Alternative(
                written=written,
                training=training if takes else {},
                dimensions=(*(swept if takes else ()), *dimensions),
                n_inputs=n_inputs,
                where=where,
            )
        )
    return Space(alternatives=tuple(alternatives))


def _dimensions(name: str, written: object, declared: AbstractRange | None) -> list[Dimension]:
    """That of a field, or those of the entries of a list or of a matrix."""
    own = _dimension(name, written, declared)
    found = [] if own is None else [own]
    for i, entry in enumerate(written) if _many(written) else ():
        found += _dimensions(f"{name}[{i}]", entry, declared)
    return found


def _at(name: str, written: Any, values: Mapping[str, Any]) -> Any:
    """What stands in a field at a point."""
    entries = [_at(f"{name}[{i}]", one, values) for i, one in enumerate(written)] if _many(written) else written
    return values.get(name, entries)


def _dimension(name: str, written: object, declared: AbstractRange | None) -> Dimension | None:
    found = parse_range(written, declared, where=name)
    return None if found is None else Dimension(name=name, values=found.values, numeric=found.numeric)


def trained_rows(structures: Sequence[Mapping[str, Any]]) -> dict[str, Estimator]:
    """Those of a sweep's structures that its training is for: networks, or where there is none, what takes options.

    Args:
        structures: Fields of each structure.

    Returns:
        Rows of the table of estimators, by kind.
    """
    kinds = {str(one.get("kind")) for one in structures}
    rows = {kind: row for kind, row in ESTIMATORS.items() if kind in kinds}
    networks = {kind: row for kind, row in rows.items() if row.training is Training}
    return networks or {kind: row for kind, row in rows.items() if row.training is not None}


def _trained(structures: Sequence[Mapping[str, Any]], training: Mapping[str, Any]) -> dict[str, Estimator]:
    """The same, refusing a training that is for none of them."""
    found = trained_rows(structures)
    first = ESTIMATORS.get(str(structures[0].get("kind"))) if structures else None
    if training and not found and first is not None:
        raise first.takes_none(training)
    return found


def _check_training(row: Estimator, fixed: Mapping[str, Any], swept: Sequence[Dimension]) -> None:
    """Every option that the training is given, and every value in a range of one, is one that it takes."""
    varied = [{dimension.name.removeprefix(TRAINING): value} for dimension in swept for value in dimension.values]
    for given in [dict(fixed), *({**fixed, **one} for one in varied)]:
        options = check(options_of(row), given, where="training")
        row.options(given_options(options), seed=0)


class _Wrapped(BaseModel):
    """A structure where errors name its field."""

    model_config = STRICT

    structure: StructureField


def _checked(fields: Mapping[str, Any], where: str) -> AbstractStructure:
    try:
        return check(_Wrapped, {"structure": dict(fields)}, where=where).structure
    except ConfigError as error:
        # A list, or two numbers with a colon, where one number stands: several were meant to be tried.
        meant = next(
            (name for name, value in fields.items() if error.got == shortened(value) and _several(value)), None
        )
        if meant is None:
            raise
        raise ConfigError(
            error.what,
            where=f"{error.where}, {meant}",
            expected=f"{error.expected}, or a range",
            got=error.got,
            remedy=f"to try each, write {meant}: {_several(fields[meant])}",
        ) from None


def _several(value: object) -> str:
    """The range that was meant; empty where none can be."""
    if isinstance(value, list) and value and all(isinstance(one, int | float | str) for one in value):
        return f"{{among: {value}}}"
    ends = re.fullmatch(r"\s*(\d+)\s*(?::|\.\.|-)\s*(\d+)\s*", value) if isinstance(value, str) else None
    return f"{{from: {ends[1]}, to: {ends[2]}}}" if ends else ""


def _many(value: object) -> typing.TypeGuard[list[Any]]:
    return isinstance(value, list) and any(isinstance(one, dict) or one == WORD or _many(one) for one in value)
