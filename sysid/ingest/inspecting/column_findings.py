"""What a column of an unknown file holds, and why it cannot be used where it cannot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.cells.blanks import blanks_mean
from sysid.ingest.cells.headers import is_unit, split_reference, unit_in_name
from sysid.ingest.cells.words import UNKNOWN_DATES
from sysid.ingest.inspecting.findings import ColumnFinding, counted
from sysid.ingest.inspecting.time_findings import finite_of
from sysid.ingest.tables.columns import RawColumn
from sysid.traces.converter import coarse_step
from sysid.units import Reference, atmosphere_in, is_pressure

_EMPTY_SHARE = 0.8  # of a column, above which its missing values are no reason to leave samples out
_FEW_STATES = 6
_FAR, _FEW = 20.0, 0.2  # spans of all other values, and the share of samples that a mark of missing ones may have


def column_finding(column: RawColumn) -> ColumnFinding:
    """What one column holds.

    Args:
        column: Of an unknown file.

    Returns:
        Its unit and reference, said or guessed, its range, and what is wrong with it.
    """
    finite = finite_of(column.values)
    problem = "" if column.problem is None else _told(column, column.problem)
    if not problem and len(finite) < min(2, len(column.values)):
        problem = f"one value only, {finite[0]:g}" if len(finite) else "no values at all"
    if column.counted_from and not problem:
        problem = f"whole numbers of about {column.counted_from}, more than float64 can hold"
    in_file = column.unit if column.unit is not None and is_unit(column.unit) else None
    unit_text = in_file or unit_in_name(column.name) or "1"
    unit, in_name = split_reference(unit_text)
    reference = column.reference or in_name
    guess = _guess_reference(finite, unit) if reference is None else reference
    return ColumnFinding(
        name=column.name,
        unit=unit,
        unit_guessed=in_file is None,
        reference=guess,
        reference_guessed=column.reference is None and guess is not Reference.NONE,
        description=column.description,
        minimum=float(finite.min()) if len(finite) else float("nan"),
        maximum=float(finite.max()) if len(finite) else float("nan"),
        missing=len(column.values) - len(finite),
        problem=problem,
        aside=column.aside or _nearly_empty(column.values),
        said="" if in_file is not None or column.unit is None else column.unit,
        far=_far(finite),
        step=coarse_step(finite) or 0.0,
    )


def _told(column: RawColumn, problem: ReaderError) -> str:
    """Why a column cannot be used; words that might be states are quoted."""
    words = column.words
    few = words is not None and words.complete and 1 < len(words.texts) <= _FEW_STATES
    if column.strange:
        return f"{problem.what}: {', '.join(repr(text[:30]) for text in column.strange[:3])}"
    if words is None or not few or problem.what == UNKNOWN_DATES:
        return problem.what
    quoted = ", ".join(f"{text[:20]!r}" for text in words.texts)
    return f"{problem.what} ({quoted}): source.files.states says which number each is"


def _far(values: NDArray[np.float64]) -> str:
    """That a value at an end of a column is far from all others, as those are that mark missing ones; or nothing."""
    found = []
    for end in (values.min(), values.max()) if len(values) else ():
        rest = values[values != end]
        count = len(values) - len(rest)
        span = float(np.ptp(rest)) if len(rest) else 0.0
        if span > 0 and _FAR * span < float(np.abs(rest - end).min()) and count <= _FEW * len(values):
            found.append(f"{end:g} ({counted(count, 'sample')})")
    if not found:
        return ""
    said = "is" if len(found) == 1 else "are"
    return (
        f"{' and '.join(found)} {said} far from all other values: a mark of missing ones, or a fault of the recording"
    )


def _nearly_empty(values: NDArray[np.float64]) -> str:
    """Why a column is none of the record: nearly all of it is missing, and would mark the samples of all others."""
    missing = len(values) - int(np.isfinite(values).sum())
    if missing <= _EMPTY_SHARE * len(values) or blanks_mean(values) == "hold":
        return ""
    return f"{missing} of {len(values)} values are missing"


def _guess_reference(values: NDArray[np.float64], unit: str) -> Reference:
    if not is_pressure(unit):
        return Reference.NONE
    if not len(values):
        return Reference.GAUGE
    # An absolute record that is ever at rest shows the atmosphere as its smallest value.
    near_atmosphere = 0.8 < float(values.min()) / atmosphere_in(unit) < 1.15
    return Reference.ABSOLUTE if near_atmosphere else Reference.GAUGE
