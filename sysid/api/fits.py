"""Fits that answer: they simulate, predict, draw, analyse and save themselves."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.api.given import TracesLike, traces_of
from sysid.errors import ChannelError, TraceError, shortened
from sysid.estimation import FitResult
from sysid.estimation.experiment import Experiment
from sysid.ingest.run_inputs import inputs_of
from sysid.ingest.run_records import before_a_run, level_of, measured_of
from sysid.models import Cascade, History, Start
from sysid.models.curve_values import curve_values
from sysid.models.form import unheeded
from sysid.traces import Role, TraceSet

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from sysid.api.responses import Bode, Poles, StepResponse
    from sysid.estimation.grey_box.profile import Profile
    from sysid.export import Bundle
    from sysid.validation.residuals import ResidualAnalysis

Initial = float | Dict[str, float] | History | tuple[Any, Any] | None
"""What stands before a run; see :meth:`Fit.simulate`."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Fit(FitResult):
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
                or dict with columns by name, or a trace; for a model without input the number of samples. Measured
                outputs beside them are not read: :func:`sysid.compare` begins by them, and scores.
            initial: What stands before the first sample: nothing for the system at rest; a number, the output that it
                has stood at, or numbers by name of several outputs; a pair ``(u, y)`` of the samples before, oldest
                first; or a history.

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
            rests = History.at_rest(inputs=history.inputs[0], output=self.model.resting)
            other = not np.array_equal(history.output[0], self.model.resting)
            if other and np.array_equal(run, self.model.simulate(inputs, rests)):
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

    def plot(self, traces: TraceSet | None = None) -> Figure:
        """Its free run over the measured output, case by case.

        Args:
            traces: The cases; all of its data set by default.

        Returns:
            A figure of matplotlib's, to restyle, show or save.
        """
        from sysid.api.comparison import compare

        return compare(self.traces if traces is None else traces, self, start=self.start).plot()

    def step(self, *, seconds: float | None = None) -> StepResponse:
        """Its step responses with their intervals; see :func:`sysid.step`.

        Args:
            seconds: Length in s; by default until the slowest pole has settled.

        Returns:
            The change of each output after a step of one unit in each input, in its unit, and 95 % intervals.

        Raises:
            ConfigError: If it is not linear, no input moves it, or the length is none.
        """
        from sysid.api.responses import step

        return step(self, seconds=seconds)

    def bode(self, *, frequency: Any = None) -> Bode:
        """Its Bode diagram with its intervals; see :func:`sysid.bode`.

        Args:
            frequency: In rad/s, shape ``(n,)``; by default four decades up to the Nyquist frequency.

        Returns:
            Gain, in units of the output per unit of the input, and phase in degrees, with 95 % intervals.

        Raises:
            ConfigError: If it is not linear, no input moves it, or a frequency is none.
        """
        from sysid.api.responses import bode

        return bode(self, frequency=frequency)

    def poles(self) -> Poles:
        """Its poles with their intervals; see :func:`sysid.poles`.

        Returns:
            The poles, the slowest first, with time constants in s and natural frequencies in rad/s.

        Raises:
            ConfigError: If it is not linear.
        """
        from sysid.api.responses import poles

        return poles(self)

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

    def save(
        self, folder: str | Path, traces: TracesLike | None = None, *, formats: tuple[str, ...] | None = None
    ) -> Bundle:
        """Write it as files that run elsewhere, with its figures on the records of the fit; see :func:`sysid.save`.

        Args:
            folder: Where the bundle goes.
            traces: Further records to check the files and to score the model on.
            formats: As for :func:`sysid.save`.

        Returns:
            The bundle.
        """
        from sysid.api.saving import save

        return save(self, self.traces if traces is None else traces, folder, formats=formats, start=self.start)

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

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.summary())}</pre>"

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
        model = self.model
        if initial is None or isinstance(initial, History):
            return initial
        if isinstance(initial, tuple):
            ends = model.mapping.inputs, model.mapping.outputs, model.ends.units
            before, output = before_a_run(initial, *ends, sample_time=model.sample_time)
            return History(inputs=before, output=output if model.structure.several_outputs else output[:, 0])
        if not model.structure.several_outputs and not isinstance(initial, Dict):
            return History.at_rest(inputs=inputs[0], output=level_of(initial))
        names = model.mapping.outputs
        given = dict(initial) if isinstance(initial, Dict) else dict.fromkeys(names, initial)
        check_outputs(given, names)
        pairs = zip(names, model.ends.rest_outputs, strict=True)
        rest = np.array([level_of(given.get(name, level)) for name, level in pairs])
        return History.at_rest(inputs=inputs[0], output=rest if model.structure.several_outputs else float(rest[0]))


def check_outputs(given: Iterable[str], names: tuple[str, ...]) -> None:
    """Refuse names of initial values that are no outputs."""
    strangers = [name for name in given if name not in names]
    if strangers:
        raise ChannelError(strangers, names, where="initial")


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SystemFit:
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

    def __getitem__(self, output: str) -> Fit:
        if output not in self.fits:
            raise ChannelError([output], self.outputs, where="the outputs of a fit")
        return self.fits[output]

    def simulate(self, u: Any, *, initial: Dict[str, float] | tuple[Any, Any] | None = None) -> NDArray[np.float64]:
        """Free run of all outputs.

        Args:
            u: Inputs, as for :meth:`Fit.simulate`, in the order of the first output's mapping.
            initial: The output that the system has stood at, by name; or a pair ``(u, y)`` of the samples before,
                oldest first, with a column of ``y`` for each output. The rest values where nothing is said.

        Returns:
            Shape ``(n_samples, n_outputs)``, in the outputs' units.
        """
        given = self._begun(initial)
        return np.column_stack([fit.simulate(u, initial=given.get(name)) for name, fit in self.fits.items()])

    def predict(
        self, y: Any, u: Any, *, steps: int = 1, initial: Dict[str, float] | tuple[Any, Any] | None = None
    ) -> NDArray[np.float64]:
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

    def _begun(self, initial: Dict[str, float] | tuple[Any, Any] | None) -> Dict[str, Any]:
        """What stands before the first sample, output by output."""
        if not isinstance(initial, tuple):
            check_outputs(initial or {}, self.outputs)
            return initial or {}
        inputs = self[self.outputs[0]].model.mapping.inputs
        before, output = before_a_run(
            initial, inputs, self.outputs, self.model.units, sample_time=self.model.sample_time
        )
        return {name: (before, column) for name, column in zip(self.outputs, output.T, strict=True)}

    def step(self, *, seconds: float | None = None) -> StepResponse:
        """The step responses of all outputs with their intervals; see :func:`sysid.step`.

        Args:
            seconds: Length in s; by default until the slowest pole has settled.

        Returns:
            The change of each output after a step of one unit in each input, in its unit, and 95 % intervals.

        Raises:
            ConfigError: If it is not linear, no input moves it, or the length is none.
        """
        from sysid.api.responses import step

        return step(self, seconds=seconds)

    def bode(self, *, frequency: Any = None) -> Bode:
        """The Bode diagrams of all outputs with their intervals; see :func:`sysid.bode`.

        Args:
            frequency: In rad/s, shape ``(n,)``; by default four decades up to the Nyquist frequency.

        Returns:
            Gain, in units of the output per unit of the input, and phase in degrees, with 95 % intervals.

        Raises:
            ConfigError: If it is not linear, no input moves it, or a frequency is none.
        """
        from sysid.api.responses import bode

        return bode(self, frequency=frequency)

    def poles(self) -> Poles:
        """The poles of all models with their intervals; see :func:`sysid.poles`.

        Returns:
            The poles, the slowest first, with time constants in s and natural frequencies in rad/s.

        Raises:
            ConfigError: If it is not linear.
        """
        from sysid.api.responses import poles

        return poles(self)

    def plot(self, traces: TraceSet | None = None) -> Figure:
        """The free run of each output over its measurement, case by case.

        Args:
            traces: The cases; all of its data set by default.

        Returns:
            A figure of matplotlib's.
        """
        from sysid.api.comparison import compare

        return compare(self.traces if traces is None else traces, self, start=self.start).plot()

    def save(
        self, folder: str | Path, traces: TracesLike | None = None, *, formats: tuple[str, ...] | None = None
    ) -> Bundle:
        """Write it as files of several outputs that run elsewhere; see :meth:`Fit.save`.

        Args:
            folder: Where the bundle goes.
            traces: Further records to check the files and to score the models on.
            formats: As for :func:`sysid.save`.

        Returns:
            The bundle.

        Raises:
            ParityError: If a file differs from its model; nothing is published then.
        """
        from sysid.api.saving import save

        return save(self, self.traces if traces is None else traces, folder, formats=formats, start=self.start)

    def summary(self) -> str:
        """The summaries of its fits.

        Returns:
            Lines of text, those of each fit behind an empty one.
        """
        return "\n\n".join(fit.summary() for fit in self.fits.values())

    def __repr__(self) -> str:
        return f"<SystemFit of {', '.join(self.outputs)}: {', '.join(fit.status.name for fit in self.fits.values())}>"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.summary())}</pre>"
