"""FitResult: what an estimator gives back, never a tuple."""

from __future__ import annotations

import enum
from collections.abc import Mapping as Dict
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.results.attempts import Attempt
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import AbstractModel, model_from_dict

if TYPE_CHECKING:
    from sysid.estimation.networks.posterior import Posterior


NOT_STABLE = "their free run is not stable"
"""Why candidates are refused, as a rule."""


class Status(enum.Enum):
    """How a fit ended; the value is the sentence that a person reads."""

    CONVERGED = "The loss no longer improves: a minimum was reached."
    EXACT = "Linear least squares: the minimum was computed directly."
    MAX_ITERATIONS = "The iterations ran out while the loss was still improving; allow more of them."
    TIME_LIMIT = "The time limit was reached while the loss was still improving; allow more time."
    STOPPED_EARLY = "Stopped early: this state did better on the selection traces than any later one."
    STALLED = "No step improves the loss any more although its gradient is not zero; try another start."
    NOT_IMPROVED = "The fit did not improve on where it started; try another start, or more damping."
    INTERRUPTED = "Interrupted; this is the best model up to then."
    UNSTABLE = "The free run leaves its bounds, or settles where it should not; try another start or a smaller model."

    @property
    def usable(self) -> bool:
        """Whether the model may be used as it is."""
        return self not in {Status.NOT_IMPROVED, Status.UNSTABLE}

    @property
    def comparable(self) -> bool:
        """Whether its figures may be set beside those of others: an unstable model has them, where it was run."""
        return self is not Status.NOT_IMPROVED


class Loop(enum.Enum):
    """What a model was fitted for: one step ahead from measured output, or its own free run."""

    OPEN = "open"
    CLOSED = "closed"


@dataclass(frozen=True, kw_only=True, eq=False)
class Evidence:
    """What Bayesian regularisation found.

    Args:
        log_evidence: Logarithm of the marginal likelihood of the scaled residuals; where these persist, that of an
            independent one, as many times as there are samples.
        beta: Precision of the scaled residuals.
        alphas: Precision of the prior of each group of weights.
        effective_parameters: Number of parameters that the data determine, per group.
        parameters: Number of parameters, per group.
        correlation_time: Samples after which a residual counted as new information.
    """

    log_evidence: float
    beta: float
    alphas: Dict[str, float]
    effective_parameters: Dict[str, float]
    parameters: Dict[str, int]
    correlation_time: float = 1.0

    @property
    def total_effective_parameters(self) -> float:
        """Sum over the groups."""
        return float(sum(self.effective_parameters.values()))

    def to_dict(self) -> dict[str, Any]:
        """The evidence as JSON values."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True, eq=False)
class FitResult:
    """A fitted model and how it came about.

    Args:
        model: The model with the best parameters.
        status: How the fit ended.
        loop: What it was fitted for.
        history: Learning curve: columns of equal length, among them ``iteration`` and ``mse`` (mean squared
            error over the estimation records in the output's unit squared).
        train_time_s: Wall time of the fit in seconds.
        seed: Seed of its random start; ``None`` where nothing is random.
        evidence: From Bayesian regularisation, where it was used.
        uncertainty: Of the parameters, where the estimator knows it.
        posterior: Of a network's parameters, where there is one; stored beside the JSON values, as arrays.
        attempts: Every start at every checkpoint, where there were several.
        stability: What a check of the free run over random sequences found, as JSON values; ``None`` where there was
            none (see :mod:`sysid.estimation.stability.free_run`).
        notes: Sentences worth knowing: choices made, stability.
        warnings: Those of the notes that say what was taken for granted and is not so: they head a report.
    """

    model: AbstractModel
    status: Status
    loop: Loop
    history: Dict[str, NDArray[np.float64]]
    train_time_s: float
    seed: int | None = None
    evidence: Evidence | None = None
    uncertainty: Uncertainty | None = None
    posterior: Posterior | None = None
    attempts: tuple[Attempt, ...] = ()
    stability: Dict[str, Any] | None = None
    notes: tuple[str, ...] = field(default=())
    warnings: tuple[str, ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON values, without the posterior."""
        return {
            "model": self.model.to_dict(),
            "status": self.status.name,
            "loop": self.loop.value,
            "history": {name: np.asarray(column).tolist() for name, column in self.history.items()},
            "train_time_s": self.train_time_s,
            "seed": self.seed,
            "evidence": None if self.evidence is None else self.evidence.to_dict(),
            "uncertainty": None if self.uncertainty is None else self.uncertainty.to_dict(),
            "attempts": [attempt.to_dict() for attempt in self.attempts],
            "stability": None if self.stability is None else dict(self.stability),
            "notes": list(self.notes),
            "warnings": list(self.warnings),
        }

    @classmethod
    def from_dict(cls, fields: Dict[str, Any]) -> FitResult:
        """The result that :meth:`to_dict` wrote.

        Args:
            fields: What it wrote.

        Returns:
            The result.
        """
        return cls(
            model=model_from_dict(fields["model"]),
            loop=Loop(fields["loop"]),
            stability=fields.get("stability"),
            **common_fields(fields),
        )


def common_fields(fields: Dict[str, Any]) -> dict[str, Any]:
    """What results of one model and of several have in common, as their ``to_dict`` wrote it.

    Args:
        fields: What it wrote.

    Returns:
        The fields of the result.
    """
    return {
        "status": Status[fields["status"]],
        "history": {name: np.asarray(column, dtype=np.float64) for name, column in fields["history"].items()},
        "train_time_s": fields["train_time_s"],
        "seed": fields["seed"],
        "evidence": None if fields["evidence"] is None else Evidence(**fields["evidence"]),
        "uncertainty": None if fields.get("uncertainty") is None else Uncertainty.from_dict(fields["uncertainty"]),
        "attempts": tuple(Attempt.from_dict(attempt) for attempt in fields.get("attempts", ())),
        "notes": tuple(fields["notes"]),
        "warnings": tuple(fields.get("warnings", ())),
    }
