r"""Frequency responses and coherence, with bands, from spectra; no structure is chosen.

With :math:`\nu` independent averages and :math:`m` inputs, :math:`G = \Phi_{yu}\Phi_u^{-1}`, the noise spectrum is
:math:`\Phi_v = \Phi_y - \Phi_{yu}\Phi_u^{-1}\Phi_{uy}`, times :math:`\nu/(\nu-m)` for what the fit has used up, and the
covariance of :math:`G` is :math:`\Phi_v\Phi_u^{-1}/\nu`. The bands are those of the F distribution with :math:`2` and
:math:`2(\nu-m)` degrees of freedom (Bendat and Piersol, "Random data", chapter 9). They hold for what the noise does;
what the window smears (a resonance narrower than ``resolution``) they do not know.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.nonparametric.phase import unwrapped
from sysid.estimation.nonparametric.segments import Segment, segments_of
from sysid.estimation.nonparametric.spectra import Spectra, SpectralMethod, etfe, spa, welch
from sysid.models import Mapping
from sysid.traces import Trace

if TYPE_CHECKING:
    import pandas as pd

POINTS = 200
"""Frequencies at which SPA is computed where none are given."""
FEWEST = 16
UNSEEN = 1e-10
"""Part of its largest value below which an input's spectrum counts as nothing."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyResponse:
    """How the output follows each input, by frequency.

    Args:
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        method: How it was estimated.
        frequency: In rad/s, shape ``(n_points,)``.
        values: Output unit per input unit, shape ``(n_points, n_inputs)``; NaN where an input has nothing.
        deviation: Root mean square of the error of each value, likewise; NaN without averages to judge it by.
        radius: Around each value in the plane, of the disc that holds the true one with 95 %.
        coherence: Share of the output's spectrum that all inputs explain together, 0 to 1, shape ``(n_points,)``; NaN
            without averages.
        noise: Spectrum of the rest, output unit squared per hertz, likewise.
        inputs: Spectrum of each input, unit squared per hertz, shape ``(n_points, n_inputs)``.
        averages: How many independent averages there are.
        resolution: In rad/s: finer structure cannot be seen.
        notes: What a reader has to know.
        unwrapped: The phase in radians with every turn, where it is known between the frequencies; see :attr:`phase`.
    """

    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_unit: str
    method: SpectralMethod
    frequency: NDArray[np.float64]
    values: NDArray[np.complex128]
    deviation: NDArray[np.float64]
    radius: NDArray[np.float64]
    coherence: NDArray[np.float64]
    noise: NDArray[np.float64]
    inputs: NDArray[np.float64]
    averages: float
    resolution: float
    notes: tuple[str, ...] = ()
    unwrapped: NDArray[np.float64] | None = None

    @property
    def gain(self) -> NDArray[np.float64]:
        """Magnitude, output unit per input unit, shape ``(n_points, n_inputs)``."""
        return np.abs(self.values)

    @property
    def gain_band(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The gains between which the true one lies with 95 %, likewise."""
        return np.maximum(self.gain - self.radius, 0.0), self.gain + self.radius

    @property
    def phase(self) -> NDArray[np.float64]:
        """In radians, unwrapped over frequency, likewise; of SPA with every turn, at any frequencies."""
        if self.unwrapped is not None:
            return self.unwrapped
        found = np.full(self.values.shape, np.nan)
        for j, column in enumerate(self.values.T):
            seen = np.isfinite(column)
            found[seen, j] = np.unwrap(np.angle(column[seen]))
        return found

    @property
    def phase_band(self) -> NDArray[np.float64]:
        """Half width of the phase's band in radians, likewise; pi where the disc holds zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            share = self.radius / self.gain
            return np.where(share < 1.0, np.arcsin(np.minimum(share, 1.0)), np.where(np.isnan(share), np.nan, np.pi))

    def to_frame(self) -> pd.DataFrame:
        """A row for each input and frequency.

        Returns:
            Columns ``input``, ``frequency`` (rad/s), ``gain``, ``phase`` (degrees), ``gain_low``, ``gain_high``,
            ``phase_band`` (degrees), ``deviation``, ``coherence``, ``noise`` and ``input_spectrum``.
        """
        import pandas as pd

        low, high = self.gain_band
        phase, band = np.degrees(self.phase), np.degrees(self.phase_band)
        return pd.concat(
            [
                pd.DataFrame(
                    {
                        "input": name,
                        "frequency": self.frequency,
                        "gain": self.gain[:, j],
                        "phase": phase[:, j],
                        "gain_low": low[:, j],
                        "gain_high": high[:, j],
                        "phase_band": band[:, j],
                        "deviation": self.deviation[:, j],
                        "coherence": self.coherence,
                        "noise": self.noise,
                        "input_spectrum": self.inputs[:, j],
                    }
                )
                for j, name in enumerate(self.mapping.inputs)
            ],
            ignore_index=True,
        )


@one_blas_thread()
def estimate_frequency_response(
    traces: Sequence[Trace],
    mapping: Mapping,
    *,
    method: SpectralMethod = SpectralMethod.SPA,
    resolution: float | None = None,
    frequency: NDArray[np.float64] | None = None,
    period: int | None = None,
) -> FrequencyResponse:
    """Estimate the frequency response of every input.

    Args:
        traces: The experiments; each stretch is counted from its mean, and no window crosses a gap.
        mapping: Which channels go in, which comes out.
        method: How.
        resolution: In rad/s; finer costs wider bands. By default a tenth of the record is a window, with thirty
            samples at least; for ETFE that of the whole record, unsmoothed.
        frequency: In rad/s, for SPA; by default up to the Nyquist frequency.
        period: Of a periodic input, in samples, for ETFE: stretches are cut into whole periods and averaged.

    Returns:
        The response.

    Raises:
        ConfigError: If the mapping has no input, or an option is out of range.
        ChannelError: If a trace lacks a channel of the mapping.
        TraceError: If the record is too short.
    """
    _check(mapping, resolution, frequency, period)
    segments = segments_of(traces, mapping, shortest=2)
    longest = max(map(len, segments), default=0)
    if longest < FEWEST:
        raise TraceError(
            "the record is too short for a frequency response",
            expected=f"{FEWEST} samples in a row",
            got=f"stretches of at most {longest}",
            remedy="use a longer record",
        )
    T = traces[0].sample_time
    spectra = _spectra(segments, method, (resolution, frequency, period), T)
    return _response(spectra, method, traces[0], mapping)


def _check(
    mapping: Mapping, resolution: float | None, frequency: NDArray[np.float64] | None, period: int | None
) -> None:
    grid = None if frequency is None else np.asarray(frequency, dtype=np.float64)
    for holds, what, expected, got in (
        (len(mapping.inputs) > 0, "there is no input to respond to", "a mapping with inputs", str(mapping)),
        (resolution is None or 0.0 < resolution < np.inf, "not a resolution", "rad/s, above 0", resolution),
        (grid is None or (grid.ndim == 1 and 0 < grid.size <= 100_000 and bool(np.isfinite(grid).all())),
         "not frequencies", "finite numbers in rad/s, at most 100,000 of them", "something else"),
        (period is None or period >= 4, "not a period", "4 samples or more", period),
    ):  # fmt: skip
        if not holds:
            raise ConfigError(what, where="frequency response", expected=expected, got=got, remedy=f"give {expected}")


def _spectra(
    segments: tuple[Segment, ...],
    method: SpectralMethod,
    asked: tuple[float | None, NDArray[np.float64] | None, int | None],
    T: float,
) -> Spectra:
    resolution, frequency, period = asked
    longest, total = max(map(len, segments)), sum(map(len, segments))
    if method is SpectralMethod.ETFE:
        length = min(period or longest, longest)
        smooth = 1 if resolution is None else max(1, round(resolution * length * T / (2.0 * np.pi)))
        return etfe(segments, length, T, smooth=min(smooth | 1, length // 2 | 1))
    # The Hann window of lags up to M is 2 pi / (M T) wide, and so, nearly, that of a part of M samples.
    asked_lag = max(30, total // 10) if resolution is None else round(2.0 * np.pi / (resolution * T))
    M = int(np.clip(asked_lag, 4, longest // 2))
    if method is SpectralMethod.WELCH:
        return welch(segments, min(2 * M, longest), T)
    M = min(M, 4000)
    if frequency is None:
        frequency = np.pi / T * np.arange(1, POINTS + 1) / POINTS
    return spa(segments, M, np.asarray(frequency, dtype=np.float64), T)


def _response(spectra: Spectra, method: SpectralMethod, trace: Trace, mapping: Mapping) -> FrequencyResponse:
    m, nu = len(mapping.inputs), spectra.averages
    solved = _solved(spectra.matrices, nu)
    n, judged = len(spectra.matrices), nu > m + 0.5
    notes = [] if judged else [f"{nu:.3g} averages for {m} inputs: nothing tells noise from response, so no bands"]
    if not solved.seen.all():
        notes.append(
            f"{np.count_nonzero(~solved.seen)} of {n} frequencies are not in the inputs, or not in each by itself"
        )
    return FrequencyResponse(
        mapping=mapping,
        sample_time=trace.sample_time,
        input_units=tuple(trace.channel(name).unit for name in mapping.inputs),
        output_unit=trace.channel(mapping.output).unit,
        method=method,
        frequency=spectra.frequency,
        values=solved.values,
        deviation=solved.spread,
        radius=solved.radius,
        coherence=np.clip(solved.coherence, 0.0, 1.0),
        noise=solved.rest,
        inputs=solved.own,
        averages=nu,
        resolution=spectra.resolution,
        notes=tuple(notes),
        unwrapped=_unwrapped(solved.values, spectra, trace.sample_time),
    )


def _unwrapped(values: NDArray[np.complex128], spectra: Spectra, T: float) -> NDArray[np.float64] | None:
    """The phase with every turn, where the spectra are known at every frequency."""
    if spectra.every is None:
        return None
    whole = _solved(spectra.every, spectra.averages)
    size = np.abs(whole.values)
    known = np.isfinite(size) & (size > np.nan_to_num(whole.radius))
    return np.column_stack(
        [unwrapped(values[:, j], spectra.frequency, whole.values[:, j], known[:, j], T) for j in range(values.shape[1])]
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solved:
    """What spectra say of a response at every frequency; see :class:`FrequencyResponse`."""

    values: NDArray[np.complex128]
    spread: NDArray[np.float64]
    radius: NDArray[np.float64]
    rest: NDArray[np.float64]
    coherence: NDArray[np.float64]
    own: NDArray[np.float64]
    seen: NDArray[np.bool_]


def _solved(matrices: NDArray[np.complex128], nu: float) -> _Solved:
    from scipy import stats

    m = matrices.shape[1] - 1
    U, cross = matrices[:, :m, :m], matrices[:, m, :m]
    Y = np.real(matrices[:, m, m])
    own = np.real(np.einsum("fjj->fj", U))
    seen = np.all(own > UNSEEN * np.maximum(own.max(axis=0), np.finfo(np.float64).tiny), axis=1)
    if m > 1 and seen.any():
        size = np.sqrt(own[seen])  # a lag window's side lobes make powers below zero, and those are not seen
        seen[seen] = np.linalg.cond(U[seen] / (size[:, :, None] * size[:, None, :])) < 1e8
    n = len(Y)
    G, spread = np.full((n, m), np.nan + 0j), np.full((n, m), np.nan)
    rest, coherence, radius = np.full(n, np.nan), np.full(n, np.nan), np.full((n, m), np.nan)
    judged = nu > m + 0.5
    if seen.any():
        inverse = np.linalg.inv(U[seen])
        G[seen] = np.einsum("fj,fjk->fk", cross[seen], inverse)
        if judged:
            left = np.maximum(Y[seen] - np.real(np.einsum("fk,fk->f", G[seen], np.conj(cross[seen]))), 0.0)
            rest[seen] = left * nu / (nu - m)
            with np.errstate(divide="ignore", invalid="ignore"):
                coherence[seen] = np.where(Y[seen] > 0.0, 1.0 - left / Y[seen], 0.0)
            variance = rest[seen, None] * np.real(np.einsum("fjj->fj", inverse)) / nu
            spread[seen] = np.sqrt(np.maximum(variance, 0.0))
            radius[seen] = spread[seen] * np.sqrt(stats.f.ppf(0.95, 2.0, 2.0 * (nu - m)))
    return _Solved(values=G, spread=spread, radius=radius, rest=rest, coherence=coherence, own=own, seen=seen)
