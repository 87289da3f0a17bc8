"""A record as equations are run over it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.records.experiment import Experiment
from sysid.models.grey_box.equation_form import EquationForm

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """One record as equations are run over it, the samples of its history included.

    Args:
        u: What the programs read, shape ``(n_samples, n_lagged)``.
        output: In units, shape ``(n_samples, n_outputs)``.
        roots: Roots of the weights, shape ``(n_samples, 1)``, or one an output; ``None`` for all ones.
        rest: What the programs read and the outputs of a system that has stood before the record.
        free: Whether its initial state is estimated; otherwise it is at rest.
        name: Of the record.
        n_first: Samples on which its initial state is estimated when a run is scored; 0 where none is.
        shows: Which of these are not masked, where it begins at the state that they show, and they do not count;
            ``None`` where it begins at one of its own.
    """

    u: Array
    output: Array
    roots: Array | None
    rest: tuple[Array, Array]
    free: bool
    name: str = ""
    n_first: int = 0
    shows: NDArray[np.bool_] | None = None

    @classmethod
    def of(cls, experiment: Experiment, form: EquationForm) -> Record:
        """An experiment as a record.

        Args:
            experiment: Of one output or several.
            form: What is run over it.

        Returns:
            The record. Samples of a measured history count like the others; one alone is a system that has stood there.
        """
        first, history = experiment, experiment.history
        stood = len(history.output) == 1 and (first.past is None or bool(first.past.any()))
        n_past = len(history.output) if not stood and first.past is not None and first.past.any() else 0
        inputs = np.concatenate([history.inputs[:n_past], first.inputs])
        output = np.concatenate([history.output[:n_past], first.output])
        before, roots = first.past_weights[:n_past], None
        if first.weights is not None or not before.all():
            weights = np.ones(len(first.output)) if first.weights is None else first.weights
            each = weights[:, None] if first.each is None else first.each
            roots = np.sqrt(np.concatenate([np.repeat(before[:, None], each.shape[1], axis=1), each]))
        return cls(
            u=form.given(inputs, history.inputs[:1] if n_past else history.inputs),
            output=np.ascontiguousarray(output.reshape(len(output), -1)),
            roots=roots,
            rest=(
                form.given(history.inputs[:1], history.inputs[:1])[0],
                np.atleast_1d(history.output[0]),
            ),
            free=first.free and not stood,
            name=history.case,
            n_first=first.n_first if first.free and not stood else 0,
        )

    def from_shown(self) -> Record:
        """The same record, begun at the state that its first samples show."""
        roots = np.ones((len(self.output), 1)) if self.roots is None else self.roots.copy()
        roots[: self.n_first] = 0.0
        return replace(self, roots=roots, shows=self.known[: self.n_first])

    def first(self, samples: int) -> Record:
        """The same record as far as some of its samples.

        Args:
            samples: How many.

        Returns:
            The record.
        """
        roots = None if self.roots is None else self.roots[:samples]
        return replace(self, u=self.u[:samples], output=self.output[:samples], roots=roots)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which samples count, in all outputs."""
        if self.roots is None:
            return np.ones(len(self.output), dtype=np.bool_)
        return np.asarray((self.roots > 0.0).all(axis=1))

    @property
    def counted(self) -> int:
        """How many residuals count, of all outputs."""
        if self.roots is None:
            return self.output.size
        return int(np.count_nonzero(np.broadcast_to(self.roots, self.output.shape)))

    def errors(self, y: Array, scale: Array, rows: slice = slice(None)) -> Array:
        """Weighted errors of some rows over the outputs' scales; zero where nothing counts, whatever stands there."""
        away = (y - self.output[rows]) / scale
        if self.roots is None:
            return np.asarray(away)
        roots = self.roots[rows]
        return np.where(roots > 0.0, away * roots, 0.0)
