"""A fit of several outputs: one fit each, run as one system."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.api.abstract_fit import AbstractFit
from sysid.api.fits import Fit
from sysid.errors import ChannelError
from sysid.estimation.results.result import Status
from sysid.ingest.memory.run_records import before_a_run, check_past, levels_of, measured_of, past_of
from sysid.models import Cascade, Start
from sysid.traces import Trace, TraceSet

if TYPE_CHECKING:
    from sysid.api.given import TracesLike
    from sysid.validation.residuals import ResidualAnalysis

Initial = float | Dict[str, float] | tuple[Any, Any] | Trace | TraceSet | None
"""What stands before a run; see :meth:`SystemFit.simulate`."""

TRUSTED_LEAST = (
    Status.UNSTABLE,
    Status.NOT_IMPROVED,
    Status.INTERRUPTED,
    Status.STALLED,
    Status.TIME_LIMIT,
    Status.MAX_ITERATIONS,
    Status.STOPPED_EARLY,
    Status.CONVERGED,
    Status.EXACT,
)
"""How fits end, that first of which a system is trusted no more than its worst part."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SystemFit(AbstractFit):
    """Several outputs: one fit each, run as one system.

    Args:
        fits: By output.
        model: Their models side by side.
        traces: The data set.
        start: How each free run begins where nothing else is said.
    """

    fits: Dict[str, Fit]
    model: Cascade
    traces: TraceSet
    start: Start

    @classmethod
    def of(cls, fits: Dict[str, Fit]) -> SystemFit:
        """Fits of the same data, one an output."""
        first = next(iter(fits.values()))
        model = Cascade(models=tuple(fit.model for fit in fits.values()))
        return cls(fits=fits, model=model, traces=first.traces, start=first.start)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs, in the mapping's order."""
        return tuple(self.fits)

    @property
    def status(self) -> Status:
        """How its fits ended: that of the one to be trusted least."""
        return min((fit.status for fit in self.fits.values()), key=TRUSTED_LEAST.index)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is told of its fits, behind the name of each output."""
        return tuple(f"{name}: {note}" for name, fit in self.fits.items() for note in fit.notes)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Of these, what asks to be looked at."""
        return tuple(f"{name}: {note}" for name, fit in self.fits.items() for note in fit.warnings)

    def __getitem__(self, output: str) -> Fit:
        if output not in self.fits:
            raise ChannelError([output], self.outputs, where="the outputs of a fit")
        return self.fits[output]

    def simulate(self, u: Any, *, initial: Initial = None) -> NDArray[np.float64]:
        """Free run of all outputs.

        Args:
            u: Inputs, as for :meth:`Fit.simulate`, in the order of the first output's mapping.
            initial: The levels that the outputs have stood at, by name, or a number for every one; or the
                samples before, oldest first, as a record or a pair ``(u, y)`` with a column of ``y`` for each output.
                The rest values where nothing is said.

        Returns:
            Shape ``(n_samples, n_outputs)``, in the outputs' units.
        """
        given = self._begun(initial)
        return np.column_stack([fit.simulate(u, initial=given.get(name)) for name, fit in self.fits.items()])

    def predict(self, y: Any, u: Any, *, steps: int = 1, initial: Initial = None) -> NDArray[np.float64]:
        """Prediction of all outputs from measured ones; see :meth:`Fit.predict`.

        Args:
            y: Measured outputs: an array of shape ``(n_samples, n_outputs)`` in their order, a frame or dict with
                columns by name, or a trace.
            u: Inputs, as for :meth:`Fit.simulate`.
            steps: How many samples ahead.
            initial: As for :meth:`simulate`.

        Returns:
            Shape ``(n_samples, n_outputs)``, in the outputs' units.
        """
        given, columns = (
            self._begun(initial),
            measured_of(y, u, self.outputs, self.model.units, sample_time=self.model.sample_time).T,
        )
        runs = zip(self.fits.items(), columns, strict=True)
        found = [fit.predict(column, u, steps=steps, initial=given.get(name)) for (name, fit), column in runs]
        return np.column_stack(found)

    def forecast(self, u: Any, *, initial: tuple[Any, Any] | Trace | TraceSet) -> NDArray[np.float64]:
        """What is to be expected of all outputs after measured samples; see :meth:`Fit.forecast`.

        Args:
            u: Inputs to come, as for :meth:`Fit.simulate`.
            initial: The samples before, oldest first: a record, or a pair ``(u, y)`` with a column of ``y`` for each
                output.

        Returns:
            Shape ``(n_samples, n_outputs)``, in the outputs' units.
        """
        initial = past_of(initial)
        check_past(initial)
        given = self._begun(initial)
        return np.column_stack([fit.forecast(u, initial=given[name]) for name, fit in self.fits.items()])

    def _begun(self, initial: Initial) -> Dict[str, Any]:
        """What stands before the first sample, output by output."""
        initial = past_of(initial)
        if not isinstance(initial, tuple):
            return levels_of(initial, self.outputs)
        inputs = self[self.outputs[0]].model.mapping.inputs
        before, output = before_a_run(
            initial, inputs, self.outputs, self.model.units, sample_time=self.model.sample_time
        )
        return {name: (before, column) for name, column in zip(self.outputs, output.T, strict=True)}

    def residuals(
        self, traces: TracesLike | None = None, *, free_run: bool = False, output: str | None = None
    ) -> ResidualAnalysis:
        """Are the residuals of an output white, and independent of the inputs? See :meth:`Fit.residuals`.

        Args:
            traces: The cases; those that the fit was made of by default.
            free_run: Residuals of the free run in place of those one step ahead.
            output: Which output.

        Returns:
            Correlations with their bounds, and the Ljung-Box test.

        Raises:
            ChannelError: If there is no such output.
            ConfigError: If none is named.
        """
        from sysid.validation.residuals import of_output

        return self[self.outputs[of_output(self.outputs, output)]].residuals(traces, free_run=free_run)

    def summary(self) -> str:
        """The summaries of its fits.

        Returns:
            Lines of text, those of each fit behind an empty one.
        """
        return "\n\n".join(fit.summary() for fit in self.fits.values())

    def __repr__(self) -> str:
        return f"<SystemFit of {', '.join(self.outputs)}: {', '.join(fit.status.name for fit in self.fits.values())}>"
