r"""Spectra of inputs and output together, by three methods, each with how many independent averages it holds.

* **ETFE**: the ratio of Fourier transforms of whole stretches, at the frequencies that they resolve; it averages over
  as many stretches, or periods, as there are, and over neighbouring frequencies if asked.
* **SPA**: Blackman and Tukey's: covariances up to a lag :math:`M` under a Hann window, transformed.
* **WELCH**: periodograms of overlapping parts under a Hann window, averaged.

Each gives the Hermitian matrices :math:`\Phi(\omega)` of all channels, output last, in units squared per hertz,
two-sided.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.nonparametric.segments import Segment


class SpectralMethod(enum.Enum):
    """How spectra are estimated; the value is its name."""

    ETFE = "ETFE"
    SPA = "SPA"
    WELCH = "Welch"


@dataclass(frozen=True, kw_only=True, eq=False)
class Spectra:
    """Spectra of all channels together.

    Args:
        frequency: In rad/s, shape ``(n_points,)``.
        matrices: Shape ``(n_points, n_channels, n_channels)``, output last.
        averages: How many independent periodograms each value is the mean of.
        resolution: Width of the window, in rad/s: finer structure cannot be seen.
        every: The same on an even grid from 0 to the Nyquist frequency, both with it, that shows every lag; ``None``
            where ``frequency`` is such a grid.
    """

    frequency: NDArray[np.float64]
    matrices: NDArray[np.complex128]
    averages: float
    resolution: float
    every: NDArray[np.complex128] | None = None


def _channels(segment: Segment) -> NDArray[np.float64]:
    x = np.column_stack([segment.inputs, segment.output])
    return np.asarray(x - x.mean(axis=0))


def _hann(M: int) -> NDArray[np.float64]:
    return np.asarray(0.5 + 0.5 * np.cos(np.pi * np.arange(M + 1) / (M + 1)))


def spa(segments: Sequence[Segment], M: int, frequency: NDArray[np.float64], sample_time: float) -> Spectra:
    """Blackman and Tukey's estimate.

    Args:
        segments: Stretches; those with fewer than ``M`` samples add what lags they have.
        M: Largest lag.
        frequency: Where, in rad/s.
        sample_time: Seconds.

    Returns:
        The spectra.
    """
    total = sum(map(len, segments))
    m = segments[0].inputs.shape[1] + 1
    covariance = np.zeros((2 * M + 1, m, m))  # lags -M .. M: E x_i(t + lag) x_j(t)
    for segment in segments:
        x = _channels(segment)
        size = scipy.fft.next_fast_len(len(x) + M + 1, real=True)
        X = scipy.fft.rfft(x, size, axis=0)
        for i in range(m):
            for j in range(m):
                c = scipy.fft.irfft(X[:, i] * np.conj(X[:, j]), size)
                covariance[:, i, j] += np.concatenate([c[-M:], c[: M + 1]]) if M else c[:1]
    covariance /= total
    w = _hann(M)
    window = np.concatenate([w[:0:-1], w])
    covariance *= window[:, np.newaxis, np.newaxis]
    turn = np.exp(-1j * np.outer(frequency * sample_time, np.arange(-M, M + 1)))
    matrices = sample_time * np.einsum("fk,kij->fij", turn, covariance)
    around = np.zeros((4 * M, m, m))  # half a turn of the longest lag, from one point to the next
    around[: M + 1], around[-M:] = covariance[M:], covariance[:M]
    width = 2.0 * np.pi / sample_time / float(np.sum(window))
    return Spectra(
        frequency=frequency,
        matrices=matrices,
        averages=max(total / float(np.sum(window**2)), 1.0),
        resolution=width,
        every=sample_time * scipy.fft.fft(around, axis=0)[: 2 * M + 1],
    )


def welch(segments: Sequence[Segment], length: int, sample_time: float) -> Spectra:
    """Welch's estimate, parts overlapping by a half.

    Args:
        segments: Stretches; those shorter than a part are left out.
        length: Samples of a part.
        sample_time: Seconds.

    Returns:
        The spectra, at the frequencies that a part resolves, without zero.
    """
    window = np.hanning(length + 2)[1:-1]
    hop = max(length // 2, 1)
    parts = 0
    sums: NDArray[np.complex128] | float = 0.0
    for segment in segments:
        x = np.column_stack([segment.inputs, segment.output])
        for start in range(0, len(x) - length + 1, hop):
            part = x[start : start + length]
            X = scipy.fft.rfft((part - part.mean(axis=0)) * window[:, None], axis=0)
            sums = sums + X[:, :, None] * np.conj(X[:, None, :])
            parts += 1
    overlap = float((window[hop:] @ window[: length - hop]) / (window @ window)) if hop < length else 0.0
    averages = parts / (1.0 + 2.0 * overlap**2 * (1.0 - 1.0 / max(parts, 1)))
    scale = sample_time / float(window @ window) / max(parts, 1)
    frequency = 2.0 * np.pi * np.arange(length // 2 + 1, dtype=np.float64) / (length * sample_time)
    matrices = np.asarray(sums, dtype=np.complex128) * scale
    return Spectra(
        frequency=frequency[1:],
        matrices=matrices[1:],
        averages=averages,
        resolution=2.0 * np.pi * float(window @ window) / sample_time / float(np.sum(window)) ** 2,
    )


def etfe(segments: Sequence[Segment], length: int, sample_time: float, *, smooth: int = 1) -> Spectra:
    """Periodograms of stretches of one length, averaged over them and over neighbouring frequencies.

    Args:
        segments: Stretches; those shorter are left out, longer ones cut into as many as they hold.
        length: Samples: a period of a periodic input, or the whole record.
        sample_time: Seconds.
        smooth: How many neighbouring frequencies are averaged, an odd number.

    Returns:
        The spectra, without zero frequency.
    """
    sums: NDArray[np.complex128] | float = 0.0
    parts = 0
    for segment in segments:
        x = np.column_stack([segment.inputs, segment.output])
        for start in range(0, len(x) - length + 1, length):
            part = x[start : start + length]
            X = scipy.fft.rfft(part - part.mean(axis=0), axis=0)
            sums = sums + X[:, :, None] * np.conj(X[:, None, :])
            parts += 1
    matrices = np.asarray(sums, dtype=np.complex128)[1:] * (sample_time / length / max(parts, 1))
    frequency = 2.0 * np.pi * np.arange(1, length // 2 + 1, dtype=np.float64) / (length * sample_time)
    if smooth > 1:
        kernel = np.ones(smooth)
        count = np.convolve(np.ones(len(matrices)), kernel, mode="same")
        flat = matrices.reshape(len(matrices), -1)
        flat = np.stack([np.convolve(column, kernel, mode="same") / count for column in flat.T], axis=1)
        matrices = flat.reshape(matrices.shape)
    return Spectra(
        frequency=frequency,
        matrices=matrices,
        averages=float(parts * smooth),
        resolution=2.0 * np.pi * smooth / (length * sample_time),
    )
