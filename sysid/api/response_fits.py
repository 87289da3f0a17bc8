"""Fits to measured frequency responses: read one, fit a transfer function to it, draw both, write it as files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.api.abstract_fit import AbstractResponses
from sysid.api.estimates import FrequencyResponse
from sysid.errors import ConfigError
from sysid.estimation import FitResult, Spectrum, TransferFunctionTraining, fit_spectra
from sysid.estimation.linear.response_dead_time import with_dead_time
from sysid.models import Cascade, Domain, Mapping, TransferFunction, TransferFunctionModel
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.traces.measured_response import MeasuredResponse
from sysid.units import check_unit
from sysid.validation.metrics import percent

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sysid.export import Bundle

POINTS_A_PERIOD = 20.0
"""Samples in a period of the highest frequency, of a continuous model whose sample time nobody says: that of its dead
time and of the files that run it."""
CERTAIN = 0.9999
"""Coherence from which more of it says nothing more."""


class Weighting(Enum):
    """What counts of the error at each frequency: of its square divided by another."""

    NONE = "none"
    """The error itself: resonances, and low frequencies, count most."""
    RELATIVE = "relative"
    """The error over the response's size, as a Bode diagram shows it (MATLAB's ``inv``)."""
    ROOT = "root"
    """The error over the root of that size (MATLAB's ``invsqrt``)."""
    COHERENCE = "coherence"
    """The error over what the measured coherence says of its own."""

    def weights(self, response: MeasuredResponse) -> NDArray[np.float64]:
        """The weight of each point's squared error.

        Args:
            response: What was measured.

        Returns:
            Shape ``(n_points,)``.

        Raises:
            ConfigError: If a coherence is asked for that was not measured.
        """
        size = np.abs(response.values)
        square = np.maximum(size, 1e-12 * float(size.max())) ** 2
        if self is Weighting.COHERENCE:
            if response.coherence is None:
                raise ConfigError(
                    "there is no coherence to weight by", where=response.name, expected="a column of it",
                    got="gain and phase alone", remedy="weighting='relative' counts every point's error over its size",
                )  # fmt: skip
            known = np.clip(response.coherence, 0.0, CERTAIN)
            return np.asarray(known / (1.0 - known) / square)
        power = {Weighting.NONE: 0.0, Weighting.RELATIVE: 1.0, Weighting.ROOT: 0.5}[self]
        return np.asarray(square**-power)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ResponseFit(FitResult, AbstractResponses):
    """A transfer function with the measured frequency response that it was fitted to.

    Args:
        response: What was measured.
        weighting: What counted of the errors.
    """

    response: MeasuredResponse
    weighting: Weighting

    @property
    def values(self) -> NDArray[np.complex128]:
        """What the model answers at the measured frequencies, shape ``(n_points,)``."""
        model: Any = self.model
        return np.asarray(model.response(0, self.response.frequency), dtype=np.complex128)

    @property
    def fit_percent(self) -> float:
        """How much of the response the model has: 100 is all of it, 0 as much as its mean over frequency."""
        measured = self.response.values
        about = np.linalg.norm(measured - measured.mean())
        return float(100.0 * (1.0 - np.linalg.norm(measured - self.values) / about)) if about > 0.0 else float("nan")

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

        return measured_figure(self.response, self, FrequencyUnit.of(unit))

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
        from sysid.export import export_bundle

        model, name = self.model, self.model.mapping.inputs[0]
        samples = 200
        step = Trace(
            name="made step", sample_time=model.sample_time,
            channels=(Channel(name=name, unit=model.ends.units[name]),),
            values=(np.arange(samples) >= samples // 10).astype(np.float64)[:, np.newaxis],
        )  # fmt: skip
        traces = TraceSet(name=self.response.name, traces=(step,), roles={"made step": Role.VALIDATION})
        told = {"response": {"name": self.response.name, "points": len(self.response), "fit_percent": self.fit_percent}}
        return export_bundle(
            Cascade(models=(model,)), traces, Path(folder), outputs=model.mapping.outputs, formats=formats,
            fits={str(model.mapping): self}, provenance=told,
        )  # fmt: skip

    def summary(self) -> str:
        """What was fitted, how well, and its parameters.

        Returns:
            Lines of text.
        """
        decibel, degrees, at = self.furthest
        lines = [f"{self.model.label}, {self.model.mapping}", self.status.value]
        lines += [f"Fit of the frequency response: {percent(self.fit_percent)} %."]
        lines += [f"Furthest off: {decibel:.3g} dB, at {HERTZ.told(np.array([at]))[0]:.4g} Hz; {degrees:.3g} degrees."]
        if self.uncertainty is not None:
            known = self.uncertainty
            rows = zip(known.names, known.values, known.standard_deviations, strict=True)
            lines += [f"  {name:<16} {value:>12.6g} ± {spread:.3g}" for name, value, spread in rows]
        return "\n".join([*lines, *(f"Note: {note}" for note in (*self.response.notes, *self.notes))])

    def __repr__(self) -> str:
        return f"<Fit of {self.model.label} to {self.response.name}: {percent(self.fit_percent)} %>"


def response_data(
    source: Any,
    *,
    columns: Dict[str, str] | None = None,
    units: Dict[str, str] | None = None,
    name: str | None = None,
) -> MeasuredResponse:
    """A measured frequency response, from a file or a table; see :func:`sysid.ingest.responses.read_response`.

    Args:
        source: A file (CSV, Excel, MATLAB ...), a frame, or a dict of columns; their names say what they hold and in
            which unit, ``"freq [Hz]"``, ``"mag [dB]"``, ``"phase [deg]"``, or real and imaginary parts, or complex
            numbers; and ``"coherence"``.
        columns: Which column holds what, where their names do not say it: ``{"frequency": "f", "gain": "A"}``.
        units: Of ``frequency``, ``gain`` and ``phase``, where the columns do not say them.
        name: What it is called.

    Returns:
        The response, its frequencies rising, in rad/s.

    Raises:
        UserError: If it cannot be read: what, where, and what to do.

    Warns:
        GuessedWarning: If a unit was guessed.

    Example:
        >>> swept = response_data({"freq [Hz]": [1, 10, 100], "mag [dB]": [0, -3, -20], "phase [deg]": [-6, -45, -84]})
        >>> print(swept)
        frequency response response: 3 points from 1 to 100 Hz
    """
    from sysid.ingest.responses import read_response

    return read_response(source, columns=columns, units=units, name=name)


def fit_response(
    response: MeasuredResponse | FrequencyResponse,
    structure: TransferFunction,
    mapping: str | Mapping | None = None,
    *,
    sample_time: float | None = None,
    weighting: str | Weighting = Weighting.NONE,
    units: Dict[str, str] | None = None,
    training: TransferFunctionTraining | None = None,
) -> ResponseFit:
    """Fit a transfer function to a measured frequency response (``tfest(frd, np, nz)``).

    Args:
        response: Of :func:`response_data`; or one of :func:`sysid.frequency_response`, of one input.
        structure: With one number of poles and zeros; a response has no level, so that it has no intercept.
        mapping: What input and output are called; ``"u -> y"`` by default.
        sample_time: Of the model in seconds, of which a dead time is a multiple. A continuous one has by default some
            20 samples in a period of the highest frequency, and so that they make the dead time that was found.
        weighting: What counts of the error at each frequency: ``"none"``, ``"relative"``, ``"root"`` or
            ``"coherence"``; see :class:`Weighting`.
        units: Of the input and the output, by name; ``"1"`` by default.
        training: How to fit.

    Returns:
        The fit.

    Raises:
        ConfigError: If the structure is no transfer function of one input, or an option does not apply.
        TraceError: If the orders do not fit the data.
        FitDivergedError: If no start gives a finite model.

    Example:
        >>> import numpy as np
        >>> w = np.geomspace(0.1, 100.0, 50)
        >>> swept = response_data({"w [rad/s]": w, "H": 3.0 / (1.0 + 0.2j * w)})
        >>> fit = fit_response(swept, TransferFunction(poles=(1,), zeros=(0,), delays=(0,), domain="continuous"))
        >>> round(fit.fit_percent, 3), fit.model.poles(0).round(6).tolist()
        (100.0, [(-5+0j)])
    """
    measured, weighting = _measured(response), _weighting(weighting)
    if not isinstance(structure, TransferFunction):
        raise ConfigError(
            "a frequency response is fitted by a transfer function",
            where="structure",
            expected="TransferFunction(poles=(2,), zeros=(1,), domain='continuous')",
            got=type(structure).__name__,
            remedy="give one; other structures are fitted to samples over time",
        )
    given = mapping or (response.mapping if isinstance(response, FrequencyResponse) else "u -> y")
    mapped = Mapping.of(given)
    if len(mapped.inputs) != 1 or len(mapped.outputs) != 1:
        raise ConfigError(
            "a frequency response is from one input to one output", where="mapping", expected="for example u -> y",
            got=str(mapped), remedy="fit each pair by itself; sysid.estimation.fit_spectra takes several inputs",
        )  # fmt: skip
    known = {name: check_unit((units or {}).get(name, "1")) for name in mapped.channels}
    spectra = Spectrum.of_response(measured.frequency, measured.values, weights=weighting.weights(measured))
    orders = replace(structure, intercept=False)

    def fit_at(time: float, delay: int | None = None, begin: TransferFunctionModel | None = None) -> FitResult:
        return fit_spectra(
            spectra,
            mapped,
            orders if delay is None else replace(orders, delays=(delay,)),
            training,
            begin=begin,
            sample_time=time,
            input_units=(known[mapped.inputs[0]],),
            output_unit=known[mapped.output],
        )

    found = fit_at(_sample_time(structure, measured, sample_time))
    if sample_time is None and structure.delays is None:
        found = with_dead_time(found, fit_at, n_residuals=2 * len(measured))
    fields = {field.name: getattr(found, field.name) for field in dataclasses.fields(FitResult)}
    fit = ResponseFit(**fields, response=measured, weighting=weighting)
    low, high = HERTZ.told(measured.frequency[[0, -1]])
    of = f"{len(measured)} points from {low:.4g} to {high:.4g} Hz, weighting {weighting.value}"
    note = f"Fitted to a frequency response ({of}) of which the model has {percent(fit.fit_percent)} %; no record."
    return replace(fit, notes=(note, *fit.notes))


def _measured(response: object) -> MeasuredResponse:
    if isinstance(response, MeasuredResponse):
        return response
    if isinstance(response, FrequencyResponse) and response.values.shape[1] == 1:
        seen = np.isfinite(response.values[:, 0])
        coherence = response.coherence[seen] if np.isfinite(response.coherence[seen]).all() else None
        return MeasuredResponse(
            name=str(response.mapping), frequency=response.frequency[seen], values=response.values[seen, 0],
            coherence=coherence,
        )  # fmt: skip
    raise ConfigError(
        "not a frequency response of one input",
        where="response",
        expected="what sysid.response_data gives, or sysid.frequency_response of one input",
        got=type(response).__name__,
        remedy="read it first: sysid.response_data('sweep.csv')",
    )


def _weighting(given: str | Weighting) -> Weighting:
    known = {one.value: one for one in Weighting}
    if isinstance(given, Weighting):
        return given
    if given not in known:
        raise ConfigError.unknown("there is no such weighting", given, known, "give one of these", where="weighting")
    return known[given]


def _sample_time(structure: TransferFunction, measured: MeasuredResponse, given: float | None) -> float:
    if given is not None and not 0.0 < given < np.inf:
        raise ConfigError(
            "not a sample time", where="sample_time", expected="seconds, above 0", got=given, remedy="correct it"
        )
    if given is None and structure.domain is Domain.DISCRETE:
        raise ConfigError(
            "a discrete model has a sample time",
            where="sample_time",
            expected="seconds",
            got="none",
            remedy="give sample_time=0.01 (--sample-time), or fit a continuous one: domain='continuous'",
        )
    if given is not None:
        return float(given)
    return float(f"{2.0 * np.pi / measured.frequency[-1] / POINTS_A_PERIOD:.2g}")
