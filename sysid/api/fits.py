"""Fits that answer: they simulate, predict, draw, analyse and save themselves."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.api.abstract_fit import AbstractFit
from sysid.api.given import TracesLike, traces_of
from sysid.errors import TraceError, shortened
from sysid.estimation import FitResult
from sysid.estimation.records.experiment import Experiment
from sysid.ingest.memory.run_inputs import inputs_of
from sysid.ingest.memory.run_records import before_a_run, check_past, levels_of, measured_of, past_of
from sysid.models import History, Start
from sysid.models.blocks.curve_values import curve_values
from sysid.models.contract.form import unheeded
from sysid.traces import Role, Trace, TraceSet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sysid.estimation.grey_box.profile import Profile
    from sysid.validation.residuals import ResidualAnalysis

Initial = float | Dict[str, float] | History | tuple[Any, Any] | Trace | TraceSet | None
"""What stands before a run; see :meth:`Fit.simulate`."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Fit(FitResult, AbstractFit):
    """A fit with the data that it was made of.

    Args:
        traces: The data set.
        start: How each free run begins where nothing else is said.
    """

    traces: TraceSet
    start: Start

    @classmethod
    def of(cls, result: FitResult, traces: TraceSet, start: Start) -> Fit:
        """A fit result with its data beside it."""
        fields = {field.name: getattr(result, field.name) for field in dataclasses.fields(FitResult)}
        return cls(**fields, traces=traces, start=start)

    def simulate(self, u: Any, *, initial: Initial = None) -> NDArray[np.float64]:
        """Free run: the model is fed nothing but inputs and its own past output.

        Args:
            u: Inputs: an array of shape ``(n_samples,)`` or ``(n_samples, n_inputs)`` in the mapping's order, a frame
                or dict with columns by name, a trace, or a data set of one; for a model without input the number of
                samples. Measured
                outputs beside them are not read: :func:`sysid.compare` begins by them, and scores.
            initial: What stands before the first sample: nothing for the system at rest; a number, the output that it
                has stood at, or numbers by name of several outputs; the samples before, oldest first, as a record or a
                pair ``(u, y)``; or a history.

        Returns:
            The output, shape ``(n_samples,)``, in its unit; of a model of several outputs ``(n_samples, n_outputs)``.
            An array, of a frame too, where a bundle's ``simulate`` gives a frame.

        Raises:
            ChannelError: If an input is missing, or ``initial`` names no output.
            ConfigError: If a number is given, and the run is the same without it: a transfer function rests where its
                inputs hold it.
            TraceError: If the inputs are not as many as the model has.
        """
        inputs = self._inputs(u)
        history = self._history(inputs, initial)
        run = self.model.simulate(inputs, history)
        if history is not None and len(history.output) == 1 and not isinstance(initial, History):
            level, resting = history.output[0], self.model.resting
            # What the model rests at is no other level: whether it heeds one, one that is shows.
            same = np.array_equal(level, resting)
            other = History.at_rest(inputs=history.inputs[0], output=level + 1.0 if same else resting)
            begun = same and np.allclose(run[0], level)
            if not begun and np.array_equal(run, self.model.simulate(inputs, other)):
                raise unheeded(shortened(initial), model=self.model.label)
        return run

    def predict(self, y: Any, u: Any, *, steps: int = 1, initial: Initial = None) -> NDArray[np.float64]:
        """Prediction from measured output.

        Args:
            y: Measured output, shape ``(n_samples,)``, or ``(n_samples, n_outputs)`` of a model of several outputs; or
                a frame or dict with columns by name, or a trace.
            u: Inputs, as for :meth:`simulate`.
            steps: How many samples ahead.
            initial: As for :meth:`simulate`.

        Returns:
            What each sample was predicted to be ``steps`` before it, in the output's unit, of the shape that
            :meth:`simulate` gives.

        Raises:
            ChannelError: If an input or an output is missing.
            ConfigError: If ``y`` and ``u`` have rows of other labels, or columns are not as many as channels.
            TraceError: If they differ in length, or a sample is missing.
        """
        inputs = self._inputs(u)
        output = self._outputs(y, u)
        if len(output) != len(inputs):
            raise TraceError(
                "inputs and output have different lengths",
                expected=f"{len(inputs)} samples of output",
                got=f"{len(output)}",
                remedy="give both over the same samples",
            )
        return self.model.predict(inputs, output, self._history(inputs, initial), steps=steps)

    def forecast(self, u: Any, *, initial: tuple[Any, Any] | History | Trace | TraceSet) -> NDArray[np.float64]:
        """What is to be expected after measured samples: the free run, with what is known of the noise carried on.

        Args:
            u: Inputs to come, as for :meth:`simulate`.
            initial: The samples before, oldest first: a record (a trace, a data set of one, a frame), a pair
                ``(u, y)``, or a history.

        Returns:
            As :meth:`simulate`. A model without a model of its noise (OE, TF, equations) runs freely from the state
            that the samples show, and so do networks and ARX, which read their own past output.

        Raises:
            ChannelError: If an input or an output is missing.
            ConfigError: If no samples are given.
            TraceError: If both have not as many samples, or one is missing.
        """
        inputs, initial = self._inputs(u), past_of(initial)
        check_past(initial)
        history = self._history(inputs, initial)
        assert history is not None  # noqa: S101 - asked before
        return self.model.forecast(inputs, history)

    def for_case(self, name: str) -> Fit:
        """The same fit for one case, where parameters of equations differ by case: its model is a plain one.

        Args:
            name: Of the case, or of a record of it.

        Returns:
            The fit.

        Raises:
            ConfigError: If no parameter differs by case, or that case was not fitted.
        """
        from sysid.estimation.grey_box.by_case import for_case

        return Fit.of(for_case(self, name), self.traces, self.start)

    def profile(self, name: str, *, level: float = 0.95) -> Profile:
        """How far a parameter of equations may move while the others, fitted again, keep the error within the noise.

        Args:
            name: Of the parameter; ``mass of run1`` of one that differs by case.
            level: Probability of the interval.

        Returns:
            The profile: ``low`` and ``high`` end its interval, ``values`` and ``deviances`` draw it.

        Raises:
            ConfigError: If the fit is none of equations, or has no such parameter.
        """
        from sysid.estimation.grey_box.again import profile_again

        return profile_again(self, self.traces.with_role(Role.ESTIMATION), self.start, name, level)

    def residuals(
        self, traces: TracesLike | None = None, *, free_run: bool = False, output: str | None = None
    ) -> ResidualAnalysis:
        """Are the residuals white, and independent of the inputs?

        Args:
            traces: The cases; those that the fit was made of by default.
            free_run: Residuals of the free run in place of those one step ahead.
            output: Which output, of a model of several.

        Returns:
            Correlations with their bounds, and the Ljung-Box test.
        """
        records = self.traces.with_role(Role.ESTIMATION) if traces is None else traces_of(traces, word="fit").traces
        from sysid.validation.residuals import analyse_residuals

        return analyse_residuals(self.model, records, self.start, free_run=free_run, output=output)

    def plot_curves(self, traces: TraceSet | None = None) -> Figure:
        """The static curves of a block-oriented model, over what the records range over, and where these lie.

        Args:
            traces: The cases; the estimation traces by default.

        Returns:
            A figure of matplotlib's.

        Raises:
            ConfigError: If the model has no such curves.
        """
        from sysid.reporting.figures.curves_figure import curves_figure

        records = self.traces.with_role(Role.ESTIMATION) if traces is None else traces_of(traces, word="fit").traces
        runs = [Experiment.for_model(trace, self.model, self.start) for trace in records]
        curves = curve_values(self.model, [(run.inputs, run.history) for run in runs])
        return curves_figure([curve.drawn() for curve in curves])

    def summary(self) -> str:
        """What was fitted, how it ended, its parameters as far as there is an uncertainty of them, and its fit.

        Returns:
            Lines of text.
        """
        lines = [f"{self.model.label}, {self.model.mapping}", self.status.value]
        lines += [f"Parameters: {self.model.n_parameters}. Trained for {self.train_time_s:.3g} s."]
        if self.uncertainty is not None:
            pairs = zip(
                self.uncertainty.names, self.uncertainty.values, self.uncertainty.standard_deviations, strict=True
            )
            lines += [
                f"  {name:<16} {value:>12.6g} ± " + ("- (not determined)" if np.isnan(spread) else f"{spread:.3g}")
                for name, value, spread in pairs
            ]
            if self.uncertainty.profile is not None:
                ends = zip(self.uncertainty.names, self.uncertainty.profile, strict=True)
                lines += [f"  {name:<16} {low:>12.6g} to {high:.6g}" for name, (low, high) in ends]
                lines[-len(self.uncertainty.names)] += " (95 %, by profile likelihood)"
        lines += [f"Note: {note}" for note in self.notes]
        return "\n".join([*lines, str(self._compared)])

    def __repr__(self) -> str:
        return f"<Fit of {self.model.label}, {self.model.mapping}: {self.status.name}>"

    @cached_property
    def _compared(self) -> Any:
        from sysid.api.comparison import compare

        return compare(self.traces, self, start=self.start)

    def _inputs(self, u: Any) -> NDArray[np.float64]:
        model = self.model
        return inputs_of(u, model.mapping.inputs, sample_time=model.sample_time, units=model.ends.units)

    def _outputs(self, y: Any, u: Any) -> NDArray[np.float64]:
        model = self.model
        found = measured_of(y, u, model.mapping.outputs, model.ends.units, sample_time=model.sample_time)
        return found if model.structure.several_outputs else found[:, 0]

    def _history(self, inputs: NDArray[np.float64], initial: Initial) -> History | None:
        model, initial = self.model, past_of(initial)
        if initial is None or isinstance(initial, History):
            return initial
        if isinstance(initial, tuple):
            ends = model.mapping.inputs, model.mapping.outputs, model.ends.units
            before, output = before_a_run(initial, *ends, sample_time=model.sample_time)
            return History(inputs=before, output=output if model.structure.several_outputs else output[:, 0])
        names = model.mapping.outputs
        given = levels_of(initial, names)
        pairs = zip(names, model.ends.rest_outputs, strict=True)
        rest = np.array([given.get(name, level) for name, level in pairs])
        return History.at_rest(inputs=inputs[0], output=rest if model.structure.several_outputs else float(rest[0]))
