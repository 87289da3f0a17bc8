"""A transfer function with the frequency response that it was fitted to: told, drawn, and written as files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.api.abstract_fit import AbstractResponses
from sysid.api.measured_responses.problem import ResponseProblem, Weighting
from sysid.estimation import FitResult
from sysid.estimation.remarks.measured_response_notes import measured_response_notes
from sysid.models import Cascade
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.reporting.linear.computing import bode_of
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.traces.measured_response import MeasuredResponse
from sysid.validation.metrics import percent

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sysid.api.measured_responses.orders import ResponseOrderSearch
    from sysid.export import Bundle


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ResponseFit(FitResult, AbstractResponses):
    """A transfer function with the measured frequency response that it was fitted to.

    Args:
        response: What was measured.
        weighting: What counted of the errors.
        orders: What other orders came to, where nobody said them.
        left_out: Weighted squared error of each point in fits without it, shape ``(n_points,)``; ``None`` where the
            points that are left are too few.
    """

    response: MeasuredResponse
    weighting: Weighting
    orders: ResponseOrderSearch | None = None
    left_out: NDArray[np.float64] | None = None

    @property
    def values(self) -> NDArray[np.complex128]:
        """What the model answers at the measured frequencies, shape ``(n_points,)``."""
        model: Any = self.model
        return np.asarray(model.response(0, self.response.frequency), dtype=np.complex128)

    @property
    def fit_percent(self) -> float:
        """How much of the response the model has: 100 is all of it, 0 as much as its mean over frequency."""
        return fit_percent_of(self.model, self.response)

    @property
    def left_out_percent(self) -> float:
        """Root mean square of the errors at frequencies left out of the fit, in per cent of the response, weighted.

        Each fifth frequency in turn is left out; NaN where the points are too few for that.
        """
        if self.left_out is None:
            return float("nan")
        power = self.weighting.weights(self.response) * np.abs(self.response.values) ** 2
        return 100.0 * float(np.sqrt(np.sum(self.left_out) / np.sum(power)))

    @property
    def furthest(self) -> tuple[float, float, float]:
        """Where gain and phase are furthest off: in dB, in degrees, and at how many rad/s the first of these is."""
        ratio = self.values / np.where(self.response.values == 0.0, np.nan, self.response.values)
        with np.errstate(divide="ignore"):
            off = np.abs(20.0 * np.log10(np.abs(ratio)))
        at = int(np.nanargmax(off))
        return float(off[at]), float(np.nanmax(np.abs(np.degrees(np.angle(ratio))))), float(self.response.frequency[at])

    def to_frame(self) -> Any:
        """What was measured and what the model answers.

        Returns:
            A row for each frequency: ``frequency`` (rad/s), ``gain``, ``phase`` (degrees, unwrapped), ``model_gain``
            and ``model_phase``.
        """
        import pandas as pd

        columns: dict[str, Any] = {"frequency": self.response.frequency}
        for before, values in (("", self.response.values), ("model_", self.values)):
            columns[f"{before}gain"] = np.abs(values)
            columns[f"{before}phase"] = np.degrees(np.unwrap(np.angle(values)))
        return pd.DataFrame(columns)

    def plot(self, *, unit: str = HERTZ.value) -> Figure:
        """Gain and phase as measured, and the model's over them.

        Args:
            unit: Of the frequencies that are drawn: ``"Hz"``, or ``"rad/s"``, as ``frequency`` has them.

        Returns:
            A figure of matplotlib's.

        Raises:
            ConfigError: If it is another unit.
        """
        from sysid.reporting.figures.response_figure import measured_figure

        w = self.response.frequency
        model = bode_of([(self.model, self.uncertainty)], frequency=w[w > 0.0])
        return measured_figure(self.response, model, self.model.label, FrequencyUnit.of(unit))

    def save(self, folder: str | Path, *, formats: tuple[str, ...] | None = None) -> Bundle:
        """Write it as files that run elsewhere; see :func:`sysid.save`.

        There is no record: the files are checked against the model over a step of its input and random inputs, no range
        of the input is declared, and the card has no figures of cases.

        Args:
            folder: Where the bundle goes.
            formats: As for :func:`sysid.save`.

        Returns:
            The bundle.

        Raises:
            ParityError: If a file differs from its model; nothing is published then.
        """
        return export_response(self, self.response, Path(folder), formats=formats)

    def summary(self) -> str:
        """What was fitted, how well, and its parameters.

        Returns:
            Lines of text.
        """
        decibel, degrees, at = self.furthest
        lines = [f"{self.model.label}, {self.model.mapping}", self.status.value]
        lines += [f"Fit of the frequency response: {percent(self.fit_percent)} %."]
        if self.left_out is not None:
            lines += [f"Error at frequencies left out of the fit, each fifth in turn: {self.left_out_percent:.3g} %."]
        lines += [f"Furthest off: {decibel:.3g} dB, at {HERTZ.told(np.array([at]))[0]:.4g} Hz; {degrees:.3g} degrees."]
        if self.uncertainty is not None:
            known = self.uncertainty
            rows = zip(known.names, known.values, known.standard_deviations, strict=True)
            lines += [f"  {name:<16} {value:>12.6g} ± {spread:.3g}" for name, value, spread in rows]
        return "\n".join([*lines, *(f"Note: {note}" for note in (*self.response.notes, *self.notes))])

    def __repr__(self) -> str:
        return f"<Fit of {self.model.label} to {self.response.name}: {percent(self.fit_percent)} %>"


def fit_percent_of(model: Any, response: MeasuredResponse) -> float:
    """How much of a response a model has; see :attr:`ResponseFit.fit_percent`."""
    measured = response.values
    about = np.linalg.norm(measured - measured.mean())
    off = np.linalg.norm(measured - model.response(0, response.frequency))
    return float(100.0 * (1.0 - off / about)) if about > 0.0 else float("nan")


def export_response(
    fit: FitResult,
    response: MeasuredResponse,
    folder: Path,
    *,
    formats: tuple[str, ...] | None = None,
    tolerance: float | None = None,
    provenance: Dict[str, Any] | None = None,
) -> Bundle:
    """Write what was fitted to a frequency response as files that run elsewhere; see :meth:`ResponseFit.save`.

    Args:
        fit: The fit.
        response: What was measured.
        folder: Where the bundle goes.
        formats: As for :func:`sysid.save`.
        tolerance: Largest difference allowed between a file and its model, in the output's unit.
        provenance: What the bundle says about where it comes from, beside the response.

    Returns:
        The bundle.

    Raises:
        ParityError: If a file differs from its model; nothing is published then.
    """
    from sysid.export import export_bundle

    model, name = fit.model, fit.model.mapping.inputs[0]
    samples = 200
    step = Trace(
        name="made step", sample_time=model.sample_time,
        channels=(Channel(name=name, unit=model.ends.units[name]),),
        values=(np.arange(samples) >= samples // 10).astype(np.float64)[:, np.newaxis],
    )  # fmt: skip
    traces = TraceSet(name=response.name, traces=(step,), roles={"made step": Role.VALIDATION})
    about = {"name": response.name, "points": len(response), "fit_percent": fit_percent_of(model, response)}
    return export_bundle(
        Cascade(models=(model,)), traces, folder, outputs=model.mapping.outputs, formats=formats,
        tolerance=tolerance, fits={str(model.mapping): fit}, provenance={"response": about, **(provenance or {})},
    )  # fmt: skip


def response_fit(
    problem: ResponseProblem, found: FitResult, left_out: NDArray[np.float64] | None = None
) -> ResponseFit:
    """A fit with what it was fitted to.

    Args:
        problem: Response and weights.
        found: The fit.
        left_out: Weighted squared error of each point in fits without it, shape ``(n_points,)``.

    Returns:
        Both.
    """
    measured = problem.measured
    fields = {field.name: getattr(found, field.name) for field in dataclasses.fields(FitResult)}
    fit = ResponseFit(**fields, response=measured, weighting=problem.weighting, left_out=left_out)
    low, high = HERTZ.told(measured.frequency[[0, -1]])
    of = f"{len(measured)} points from {low:.4g} to {high:.4g} Hz, weighting {problem.weighting.value}"
    note = f"Fitted to a frequency response ({of}) of which the model has {percent(fit.fit_percent)} %; no record."
    open_ = measured_response_notes(measured, found, problem.weights)
    return replace(fit, notes=(note, *fit.notes, *open_), warnings=(*fit.warnings, *open_))
