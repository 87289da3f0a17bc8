"""Intervals of a model's output, and how often they hold the measured output on cases that were not trained on."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError, shortened
from sysid.estimation import FitResult, Loop, Posterior
from sysid.estimation.records.experiment import Experiment
from sysid.models import AbstractModel, Start
from sysid.models.contract import gaps
from sysid.traces import Trace

LEVEL = 0.95
"""Probability of the intervals that are reported."""


@dataclass(frozen=True, kw_only=True, eq=False)
class OutputInterval:
    """A model's output with the interval in which the measured output is expected.

    Args:
        output: Free run, or one step ahead, shape ``(n_samples,)``.
        parameter_deviation: Standard deviation that is due to the parameters, shape ``(n_samples,)``.
        noise_deviation: Standard deviation of the residuals.
        spread: Factor of both together that was found on traces which trained nothing; 1 where there were none.
        level: Probability that the interval holds the measured output.
        first: Samples of the record before the first that there is an output of: those that the start took.

    Of a model of several outputs, signals have shape ``(n_samples, n_outputs)``, and the last but the level one figure
    an output.
    """

    output: NDArray[np.float64]
    parameter_deviation: NDArray[np.float64]
    noise_deviation: float | NDArray[np.float64]
    spread: float | NDArray[np.float64]
    level: float
    first: int = 0

    @property
    def half_width(self) -> NDArray[np.float64]:
        """Half the interval's width, in the output's unit, shape ``(n_samples,)``."""
        quantile = float(scipy.stats.norm.ppf(0.5 + 0.5 * self.level))
        return np.asarray(quantile * self.spread * np.hypot(self.parameter_deviation, self.noise_deviation))

    @property
    def low(self) -> NDArray[np.float64]:
        """Lower end, in the output's unit, shape ``(n_samples,)``."""
        return self.output - self.half_width

    @property
    def high(self) -> NDArray[np.float64]:
        """Upper end, in the output's unit, shape ``(n_samples,)``."""
        return self.output + self.half_width

    def of_outputs(self) -> tuple[OutputInterval, ...]:
        """The interval of each output, of which none has an axis of its own."""
        columns = [array.reshape(len(array), -1).T for array in (self.output, self.parameter_deviation)]
        noises, spreads = (np.broadcast_to(each, len(columns[0])) for each in (self.noise_deviation, self.spread))
        return tuple(
            replace(self, output=run, parameter_deviation=moved, noise_deviation=float(noise), spread=float(spread))
            for run, moved, noise, spread in zip(*columns, noises, spreads, strict=True)
        )

    def coverage(self, target: NDArray[np.float64], counted: NDArray[np.bool_] | None = None) -> Coverage:
        """How often the interval of one output, or of all of them, holds what was measured.

        Args:
            target: Measured output, shape ``(n_samples,)``: of the whole record, or of the samples that there is an
                output of.
            counted: Which of these count; all by default.

        Returns:
            The coverage.

        Raises:
            TraceError: If it is of another length.
        """
        target, counted = self._of(target), None if counted is None else self._of(counted)
        counted = np.ones(len(target), dtype=bool) if counted is None else counted
        error, half = np.abs(target - self.output)[counted], self.half_width[counted]
        if np.isnan(error).all():  # no such run, or nothing that counts
            return Coverage(level=self.level, share=np.nan, share_before_spread=np.nan, mean_half_width=np.nan)
        return Coverage(
            level=self.level,
            share=float(np.mean(error <= half)),
            share_before_spread=float(np.mean(error * self.spread <= half)),
            mean_half_width=float(np.mean(half)),
        )

    def _of(self, measured: NDArray[Any]) -> NDArray[Any]:
        """Samples of a record that there is an output of."""
        whole, own = self.first + len(self.output), np.shape(self.output)
        kept = np.asarray(measured)[self.first if len(measured) == whole else 0 :]
        if kept.shape != own and kept.shape != own[:1]:
            raise TraceError(
                "not the output of this interval", where="coverage",
                expected=f"{whole} samples of the record, or the last {len(self.output)} of them",
                got=f"shape {np.shape(measured)}", remedy="give the record that it was predicted for: trace[OUTPUT]",
            )  # fmt: skip
        return kept


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """How often an interval holds what was measured.

    Args:
        level: How often it should, 0 to 1.
        share: How often it does, 0 to 1.
        share_before_spread: How often the interval from the estimation records alone does, 0 to 1.
        mean_half_width: In the output's unit.
    """

    level: float
    share: float
    share_before_spread: float
    mean_half_width: float

    def to_dict(self) -> dict[str, float]:
        """The fields as JSON values."""
        return {
            "level": self.level,
            "share": self.share,
            "share_before_spread": self.share_before_spread,
            "mean_half_width": self.mean_half_width,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseIntervals:
    """The intervals of one model on one case.

    Args:
        low: Lower end for the free run, shape ``(n_samples,)``.
        high: Upper end for the free run, shape ``(n_samples,)``.
        free_run: Coverage of the free run's interval.
        one_step: Coverage of the interval one step ahead.
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    free_run: Coverage
    one_step: Coverage

    def to_dict(self) -> dict[str, Any]:
        """The coverages as JSON values, without the signals."""
        return {"free_run": self.free_run.to_dict(), "one_step": self.one_step.to_dict()}

    @classmethod
    def from_dict(cls, fields: Dict[str, Any], low: NDArray[np.float64], high: NDArray[np.float64]) -> CaseIntervals:
        """The intervals whose coverages :meth:`to_dict` wrote.

        Args:
            fields: What it wrote.
            low: Lower end for the free run.
            high: Upper end for the free run.

        Returns:
            The intervals.
        """
        return cls(low=low, high=high, free_run=Coverage(**fields["free_run"]), one_step=Coverage(**fields["one_step"]))


def predict_interval(
    fit: FitResult,
    trace: Trace,
    level: float = LEVEL,
    *,
    loop: Loop = Loop.CLOSED,
    steps: int = 1,
    start: Start | None = None,
) -> OutputInterval:
    """A fitted model's output over a trace, with the interval in which the measured output is expected.

    Where the interval comes from, and its limits, stand at the head of :mod:`sysid.estimation.networks.posterior`.

    Args:
        fit: A fit with a posterior.
        trace: The trace; a free run reads its measured output only as the start allows.
        level: Probability that the interval holds the measured output at a sample, between 0 and 1.
        loop: ``CLOSED`` for the free run, ``OPEN`` for one step ahead.
        steps: How far ahead, with ``loop=Loop.OPEN``; beyond one step of ARX models and of linear ones with a model of
            the noise, whose innovations say what is added from step to step.
        start: What stands before the trace; as the fit was made where it knows (``sysid.fit``), else at rest.

    Returns:
        The interval, from the first sample on that is not part of the start.

    Raises:
        ChannelError: If the trace lacks a channel of the mapping.
        ConfigError: If the fit has no posterior, the level is not between 0 and 1, or the model does not say what its
            noise does over so many steps.

    Example:
        >>> from sysid.estimation import Training, fit_narx
        >>> from sysid.models import NARX, Mapping
        >>> from sysid.traces import Channel
        >>> rng = np.random.default_rng(0)
        >>> u = np.repeat(rng.uniform(-1.0, 1.0, 40), 10)
        >>> y = np.convolve(u, 0.2 * 0.8 ** np.arange(60))[:400] + 0.05 * rng.standard_normal(400)
        >>> channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
        >>> trace = Trace(name="record", sample_time=1.0, channels=channels, values=np.column_stack([u, y]))
        >>> network = NARX(input_delays="0:1", output_delays=1, neurons=2)
        >>> fit = fit_narx([trace], Mapping.parse("u -> y"), network, Training(max_iterations=60))
        >>> interval = predict_interval(fit, trace)
        >>> bool(0.9 < interval.coverage(trace["y"]).share <= 1.0)
        True
    """
    if not isinstance(fit, FitResult):
        raise ConfigError(
            "an interval is of one model",
            where="fit",
            expected="a fit, as sysid.fit gives for one output or for a structure of several",
            got=shortened(fit),
            remedy='of a fit with a model an output take each by its name: fit["y1"]',
        )
    if fit.posterior is None:
        raise ConfigError(
            "the fit has no posterior",
            where=fit.model.structure.label,
            expected="a stable free run, and of a network a training of some 20 iterations or more",
            got=fit.status.value,
            remedy="fit it by sysid.fit or in a pipeline, a network with more iterations (max_iterations: 100); of a "
            "free run that grows without bound there is no interval",
        )
    if not 0.0 < level < 1.0:
        raise ConfigError("not a probability", where="level", expected="between 0 and 1", got=level)
    experiment = Experiment.for_model(trace, fit.model, start or _start_of(fit))
    found = _over(fit, experiment, level, loop, steps)
    return replace(found, first=len(trace) - len(experiment.output))


def _over(fit: FitResult, experiment: Experiment, level: float, loop: Loop, steps: int) -> OutputInterval:
    """The interval over the samples that the start leaves."""
    assert fit.posterior is not None  # noqa: S101 - asked before
    closed = loop is Loop.CLOSED
    model, inputs, history = fit.model, experiment.inputs, experiment.history
    if steps != 1:
        return _ahead((fit.posterior, model), experiment, level, _steps(model, steps, loop))
    output = (
        model.simulate(inputs, history)
        if closed
        else gaps.predicted(model, inputs, experiment.output, history, experiment.usable)
    )
    return _interval((fit.posterior, model), experiment, output, loop, level)


def _steps(model: AbstractModel, steps: int, loop: Loop) -> int:
    """The steps, if there is an interval so far ahead."""
    if loop is Loop.CLOSED or steps < 1:
        raise ConfigError(
            "a free run is not so many steps ahead" if loop is Loop.CLOSED else "not a number of steps",
            where="steps",
            expected="1, or with loop=Loop.OPEN a whole number from 1 on",
            got=steps,
            remedy="give loop=Loop.OPEN and steps=2, or leave steps out",
        )
    if model.innovation_responses(1) is None:
        raise ConfigError(
            "the model does not say what its noise does over several steps",
            where="steps",
            expected="an ARX model, or a linear one with a model of the noise",
            got=model.structure.label,
            remedy="leave steps out, or fit SS, ARMAX, BJ or ARX",
        )
    return steps


def _ahead(fitted: tuple[Posterior, AbstractModel], experiment: Experiment, level: float, steps: int) -> OutputInterval:
    """The interval some steps ahead of a model that says what its innovations do; as far as one step's is wrong."""
    posterior, model = fitted
    inputs, output, history = experiment.inputs, experiment.output, experiment.history
    responses, sizes = model.innovation_responses(steps), np.atleast_1d(posterior.noise.one_step)
    assert responses is not None  # noqa: S101 - asked before
    errors = (output - model.predict(inputs, output, history)).reshape(len(output), -1)
    counted = np.isfinite(errors).all(axis=1) & (True if experiment.weights is None else experiment.weights > 0.0)
    # Errors of one sample hang together; how, the trace itself shows, where there are two outputs or more.
    together = np.corrcoef(errors[counted].T) if len(sizes) > 1 and counted.sum() > len(sizes) else np.eye(len(sizes))
    covariance = together * np.sqrt(np.outer(sizes, sizes))
    noise = np.einsum("kij,jl,kil->i", responses, covariance, responses)
    return OutputInterval(
        output=model.predict(inputs, output, history, steps=steps),
        parameter_deviation=np.sqrt(posterior.parameter_variance(model, experiment, Loop.OPEN, steps=steps)),
        noise_deviation=np.sqrt(noise) if model.structure.several_outputs else float(np.sqrt(noise[0])),
        spread=posterior.spread.one_step,
        level=level,
    )


def _start_of(fit: FitResult) -> Start:
    """How a fit with its data beside it begins its free runs; at rest without."""
    found = getattr(fit, "start", None)
    return found if isinstance(found, Start) else Start()


def case_intervals(
    posterior: Posterior,
    model: AbstractModel,
    experiment: Experiment,
    simulated: NDArray[np.float64],
    predicted: NDArray[np.float64],
) -> tuple[CaseIntervals, ...]:
    """The intervals of each output of a case whose outputs are computed already.

    Args:
        posterior: Of the model's parameters.
        model: The model.
        experiment: The case.
        simulated: Free run, of the shape of the experiment's output.
        predicted: One step ahead, likewise.

    Returns:
        The intervals at the level that is reported, output by output.
    """
    counted = None if experiment.weights is None else experiment.weights > 0.0
    free_run = _interval((posterior, model), experiment, simulated, Loop.CLOSED, LEVEL)
    one_step = _interval((posterior, model), experiment, predicted, Loop.OPEN, LEVEL)
    targets = experiment.output.reshape(len(experiment.output), -1).T
    return tuple(
        CaseIntervals(
            low=closed.low,
            high=closed.high,
            free_run=closed.coverage(target, counted),
            one_step=opened.coverage(target, counted),
        )
        for closed, opened, target in zip(free_run.of_outputs(), one_step.of_outputs(), targets, strict=True)
    )


def _interval(
    fitted: tuple[Posterior, AbstractModel],
    experiment: Experiment,
    output: NDArray[np.float64],
    loop: Loop,
    level: float,
) -> OutputInterval:
    posterior, model = fitted
    return OutputInterval(
        output=output,
        parameter_deviation=np.sqrt(posterior.parameter_variance(model, experiment, loop)),
        noise_deviation=np.sqrt(posterior.noise.of(loop)),
        spread=posterior.spread.of(loop),
        level=level,
    )
