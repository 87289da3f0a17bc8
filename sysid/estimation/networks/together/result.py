"""What a training of a whole cascade came to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.state import Solution
from sysid.estimation.results.attempts import Attempt
from sysid.estimation.results.result import Evidence, Status, common_fields
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import Cascade, cascade_from_dict


@dataclass(frozen=True, kw_only=True, eq=False)
class CascadeFit:
    """A trained cascade and how it came about; what a ``FitResult`` is for one model.

    Args:
        model: The cascade with the best parameters.
        status: How the fit ended.
        errors: For each target output the error in its unit that counted as one.
        history: Learning curve: columns of equal length, among them ``iteration`` and ``loss`` (mean squared residual
            over targets, in those errors).
        train_time_s: Wall time in seconds.
        seed: Seed of its random start; ``None`` where the fit began with the members as they were.
        evidence: From Bayesian regularisation.
        notes: Sentences worth knowing: which state was chosen among which, and by what.
        attempts: Every start at every checkpoint, and the one that was chosen; its errors are squared, in the errors
            that count as one.
        uncertainty: Of the parameters of equations, where there are such; those of networks have priors alone.
        warnings: Of these parameters those at a bound, not determined, or hardly to be told apart; or that none moved.
        solution: Where the parameters stand in the basis of training; not stored.
    """

    model: Cascade
    status: Status
    errors: dict[str, float]
    history: dict[str, NDArray[np.float64]]
    train_time_s: float
    seed: int | None = None
    evidence: Evidence | None = None
    notes: tuple[str, ...] = field(default=())
    attempts: tuple[Attempt, ...] = ()
    uncertainty: Uncertainty | None = None
    warnings: tuple[str, ...] = ()
    solution: Solution | None = None

    @property
    def told_of_equations(self) -> tuple[str, ...]:
        """What is known of the parameters of equations, in words."""
        if self.uncertainty is None:
            return self.warnings
        return (f"Estimated in equations: {self.uncertainty.sentence}.", *self.warnings)

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON values."""
        return {
            "model": self.model.to_dict(),
            "status": self.status.name,
            "errors": dict(self.errors),
            "history": {name: column.tolist() for name, column in self.history.items()},
            "train_time_s": self.train_time_s,
            "seed": self.seed,
            "evidence": None if self.evidence is None else self.evidence.to_dict(),
            "notes": list(self.notes),
            "attempts": [attempt.to_dict() for attempt in self.attempts],
            **({} if self.uncertainty is None else {"uncertainty": self.uncertainty.to_dict()}),
            **({"warnings": list(self.warnings)} if self.warnings else {}),
        }

    @classmethod
    def from_dict(cls, fields: dict[str, Any]) -> CascadeFit:
        """The result that :meth:`to_dict` wrote.

        Args:
            fields: What it wrote.

        Returns:
            The result.
        """
        model, errors = cascade_from_dict(fields["model"]), dict(fields["errors"])
        return cls(model=model, errors=errors, **common_fields(fields))
