"""Every start of a fit at every checkpoint: how much of a result is the choice, and how much is luck."""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """One start as it stood when it was looked at.

    Args:
        start: Which start, from 1 on.
        seed: Its seed; ``None`` for an initial fit, and for an ensemble.
        iterations: Done by then.
        elapsed_s: Seconds that it had taken.
        estimation_mse: On the estimation records, in the output's unit squared.
        selection_mse: Geometric mean over the selection traces; NaN without any.
        log_evidence: Minus infinity where none was computed.
        effective_parameters: Parameters that the data determine; NaN where the evidence was not computed.
        away: How far it is from the middle of all starts on the records' inputs backwards, in scaled numbers; NaN where
            that was not asked.
        stable: Whether its free run passed the check over random sequences, and what else was asked of it; ``None``
            where nobody asked.
        chosen: Whether it is the result.
        members: Of an ensemble, the starts that it unites, once for each pick.
        without: Inputs that it does without.
        cautious: Whether it counts errors that persist as fewer samples.
        status: Name of the status that it had then; empty where it was not recorded.
    """

    start: int
    seed: int | None
    iterations: int
    elapsed_s: float
    estimation_mse: float
    selection_mse: float
    log_evidence: float
    effective_parameters: float
    away: float = math.nan
    stable: bool | None = None
    chosen: bool = False
    members: tuple[int, ...] = ()
    without: tuple[str, ...] = ()
    cautious: bool = False
    status: str = ""

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return asdict(self)

    @classmethod
    def from_dict(cls, fields: Dict[str, Any]) -> Attempt:
        """The attempt that :meth:`to_dict` wrote; numbers that JSON cannot hold may be words, or missing.

        Args:
            fields: What it wrote.

        Returns:
            The attempt.
        """
        numbers = ("estimation_mse", "selection_mse", "log_evidence", "effective_parameters")
        read = {name: float("nan" if fields[name] is None else fields[name]) for name in numbers}
        away = fields.get("away")  # not there before starts were compared
        read["away"] = math.nan if away is None else float(away)
        lists = {name: tuple(fields.get(name, ())) for name in ("members", "without")}
        return cls(**{**fields, **read, **lists})
