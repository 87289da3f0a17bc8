"""Parameters that each case has a value of its own of: a mass per run, a sensor's gain per day."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, did_you_mean, shortened

Array = NDArray[np.float64]

Grouped = tuple[tuple[str, tuple[str, ...]], ...]
"""Cases of several records, and the names of the records."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseValues:
    """What a form knows of parameters that differ by case.

    Args:
        names: Of the parameters.
        places: Where each stands among the parameters of the form, shape ``(n,)``.
        low: Least value of each.
        high: Greatest.
        scale: What is a large difference between two cases.
        cases: Names of those that were fitted.
        values: Of each case, shape ``(n_cases, n)``, in units.
        grouped: Cases of several records.
    """

    names: tuple[str, ...]
    places: NDArray[np.int64]
    low: Array
    high: Array
    scale: Array
    cases: tuple[str, ...]
    values: Array
    grouped: Grouped = ()

    def row(self, record: str) -> int | None:
        """Which case a record is of; ``None`` for one that was not fitted."""
        case = case_of(record, self.grouped)
        return self.cases.index(case) if case in self.cases else None

    @property
    def expected(self) -> Array:
        """What is expected of a case that nothing is known of, shape ``(n,)``: the mean over the others."""
        return np.asarray(np.clip(self.values.mean(axis=0), self.low, self.high))

    def columns(self, record: str, p: int) -> NDArray[np.int64]:
        """Where the parameters of a record stand in a flat vector that holds those of all cases.

        Args:
            record: Its name.
            p: Parameters of the form that are estimated; behind them stand those of the second case, of the third, ...

        Returns:
            Shape ``(p,)``; -1 for the parameters by case of a record that was not fitted.
        """
        found, row, n = np.arange(p), self.row(record), len(self.places)
        if row is None:
            found[self.places] = -1
        elif row:
            found[self.places] = p + (row - 1) * n + np.arange(n)
        return found

    def unknown(self, record: str) -> ConfigError:
        """The refusal of a run of which nobody said with which values."""
        return unknown_case(self.names, self.cases, record)


def unknown_case(parameters: Sequence[str], cases: Sequence[str], record: str) -> ConfigError:
    """The refusal of a run of which nobody said with which values.

    Args:
        parameters: Names of those that differ by case.
        cases: Those that were fitted.
        record: Its name; empty where there is none.

    Returns:
        The error.
    """
    names = ", ".join(parameters)
    known = ", ".join(cases[:8]) + ", ..." * (len(cases) > 8)
    return ConfigError(
        f"{names} differ{'s' * (len(parameters) == 1)} by case, and "
        + (f"{record} is none of those that are fitted" if record else "nothing says which case it is"),
        where=record or "simulate",
        expected=f"one of {known}; or a start whose first samples show {names}",
        got=record or "no case",
        remedy=f"write start: estimated, or start: {{measured: 100}}, so that the first samples of the record give "
        f"{names}; name it in cases: beside a record of the same case; or run model.for_case({cases[0]!r})",
    )


def case_of(record: str, grouped: Grouped) -> str:
    """The case of a record: the one that names it, or one of its own.

    Example:
        >>> case_of("run2", (("monday", ("run1", "run2")),)), case_of("run3", ())
        ('monday', 'run3')
    """
    return next((case for case, records in grouped if record in records), record)


def cases_among(records: Sequence[str], grouped: Grouped) -> tuple[str, ...]:
    """The cases of some records, in their order.

    Args:
        records: Their names.
        grouped: Cases of several records.

    Returns:
        Each once.

    Raises:
        ConfigError: If a case has no record among them, so that nothing would say what its values are.
    """
    for case, named in grouped:
        if not set(named) & set(records):
            raise ConfigError(
                f"no record of the case {case} is fitted", where="cases", expected=f"one of {', '.join(records)}",
                got=", ".join(named), remedy=did_you_mean(named[0], records, f"remove {case} from cases"),
            )  # fmt: skip
    return tuple(dict.fromkeys(case_of(record, grouped) for record in records))


def cases_of(given: Any) -> Grouped:
    """Cases of several records from what people write.

    Args:
        given: By case the names of its records.

    Returns:
        The cases.

    Raises:
        ConfigError: If it is something else, or a record is named twice.
    """
    pairs = list(given.items()) if isinstance(given, Dict) else given
    if not isinstance(pairs, list | tuple) or not all(_is_case(pair) for pair in pairs):
        raise ConfigError(
            "cases are no records by name", where="cases", expected="by case the names of its records",
            got=shortened(given), remedy="write for example cases: {monday: [run1, run2], tuesday: [run3]}",
        )  # fmt: skip
    found = tuple((case, tuple(records)) for case, records in pairs)
    seen: set[str] = set()
    for case, records in found:
        for record in records:
            if record in seen:
                raise ConfigError(
                    f"the record {record} is named twice", where="cases", expected="each record in one case",
                    got=f"{record}, again in {case}", remedy="remove it from one of them",
                )  # fmt: skip
            seen.add(record)
    return found


def _is_case(pair: Any) -> bool:
    if not isinstance(pair, list | tuple) or len(pair) != 2:
        return False
    case, records = pair
    listed = isinstance(records, list | tuple) and len(records) > 0
    return isinstance(case, str) and listed and all(isinstance(one, str) for one in records)
