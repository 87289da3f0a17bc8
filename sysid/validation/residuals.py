r"""Residual analysis: is what a model leaves over noise, and does it owe anything to the inputs?

Two tests, for linear and nonlinear models alike (Ljung 1999, "System identification", section 16.6):

* **whiteness** of the one-step residuals: :math:`\hat r_\tau` of white residuals is normal with variance
  :math:`1/N`, and the Ljung-Box statistic :math:`N(N+2)\sum_\tau \hat r_\tau^2/(N-\tau)` is chi-squared;
* **independence of the inputs**: the cross-correlation with a past input is normal with variance
  :math:`\sum_k R_e(k) R_u(k) / (N R_e(0) R_u(0))`, which also holds for coloured residuals. Correlation at negative
  lags, residuals before inputs, tells of feedback and not of a wrong model.

Limits: the bounds hold for each lag by itself, so that of a hundred lags one lies outside a 99 % bound by chance; of a
noise-free reference simulation a model leaves structure, never noise, and no model passes given enough samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError, TraceError
from sysid.models import AbstractModel, Start, beginning
from sysid.models.contract import gaps
from sysid.traces import Trace

REACH = 20
"""Lags, in multiples of those shown, over which the products of autocorrelations are summed for the bound."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Correlation:
    """A correlation function with its bounds under independence.

    Args:
        name: Of what with what.
        lags: In samples, shape ``(n_lags,)``.
        values: Shape ``(n_lags,)``.
        bound: Half width of the interval around 0.
        probability: With which a value lies within it if there is no dependence.
    """

    name: str
    lags: NDArray[np.int64]
    values: NDArray[np.float64]
    bound: float
    probability: float

    @property
    def outside(self) -> NDArray[np.int64]:
        """Lags from 0 on (a whiteness test: from 1 on) whose value lies outside the bounds."""
        return self.lags[(np.abs(self.values) > self.bound) & (self.lags >= 0)]

    @property
    def passed(self) -> bool:
        """Whether what lies outside is what chance does in some 98 of a hundred cases.

        There may be no more lags outside than a binomial distribution allows at 99 %, and none so far outside that
        its distance alone is unlikely among so many lags (Bonferroni, at 99 %).
        """
        n = int(np.count_nonzero(self.lags >= 0))
        allowed = int(scipy.stats.binom.ppf(0.99, n, 1.0 - self.probability))
        wide = self.bound * float(
            scipy.stats.norm.ppf(1.0 - 0.005 / n) / scipy.stats.norm.ppf(0.5 + 0.5 * self.probability)
        )
        largest = float(np.abs(self.values[self.lags >= 0]).max(initial=0.0))
        return bool(len(self.outside) <= allowed and largest <= wide)

    def to_dict(self) -> dict[str, Any]:
        """The function as JSON values."""
        return {
            "name": self.name,
            "lags": self.lags.tolist(),
            "values": self.values.tolist(),
            "bound": self.bound,
            "probability": self.probability,
            "passed": self.passed,
        }


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ResidualAnalysis:
    """What the residuals of a model on some traces look like.

    Args:
        n_samples: Residuals that count.
        variance: Of the residuals, in the output's unit squared.
        whiteness: Autocorrelation from lag 1 on.
        ljung_box: Ljung-Box statistic over those lags.
        ljung_box_p: Probability of a larger one if the residuals are white.
        inputs: Cross-correlation with each input, lags of both signs.
    """

    n_samples: int
    variance: float
    whiteness: Correlation
    ljung_box: float
    ljung_box_p: float
    inputs: tuple[Correlation, ...]

    @property
    def white(self) -> bool:
        """Whether the residuals may be white noise, at 99 %."""
        return self.ljung_box_p > 0.01

    @property
    def independent(self) -> bool:
        """Whether the residuals may be independent of every past input."""
        return all(correlation.passed for correlation in self.inputs)

    @property
    def sentences(self) -> tuple[str, str]:
        """What the two tests say, for a person to read: whiteness, then independence of the inputs."""
        p = f"Ljung-Box p = {self.ljung_box_p:.2g}"
        if self.white:
            whiteness = f"White at 99 %: past residuals tell nothing of the next one ({p})."
        else:
            most = int(self.whiteness.lags[np.argmax(np.abs(self.whiteness.values))])
            whiteness = f"Not white at 99 %: past residuals tell something of the next one, most at lag {most} ({p})."
        owed = ", ".join(correlation.name for correlation in self.inputs if not correlation.passed)
        if owed:
            return whiteness, f"Not independent of past {owed}: the model leaves out some of what they do."
        return whiteness, "Independent of every past input."

    def __str__(self) -> str:
        return "\n".join([f"{self.n_samples} residuals, variance {self.variance:.4g}", *self.sentences])

    __repr__ = __str__

    def to_dict(self) -> dict[str, Any]:
        """The analysis as JSON values."""
        return {
            "n_samples": self.n_samples,
            "variance": self.variance,
            "whiteness": self.whiteness.to_dict(),
            "ljung_box": self.ljung_box,
            "ljung_box_p": self.ljung_box_p,
            "white": self.white,
            "inputs": [correlation.to_dict() for correlation in self.inputs],
            "independent": self.independent,
            "sentences": list(self.sentences),
        }


@dataclass(frozen=True, eq=False)
class _Record:
    """Residuals, zero where they do not count, and inputs of one trace."""

    residual: NDArray[np.float64]
    inputs: NDArray[np.float64]
    counted: NDArray[np.bool_]


def of_output(outputs: tuple[str, ...], output: str | None) -> int:
    """Which of a model's outputs is meant.

    Args:
        outputs: All of them.
        output: Its name; nothing of one alone.

    Returns:
        Its place.

    Raises:
        ChannelError: If there is no such output.
        ConfigError: If none is named, of several.
    """
    if output is None and len(outputs) > 1:
        raise ConfigError(
            "the residuals are of one output at a time",
            where="output",
            expected=f"one of {', '.join(outputs)}",
            got="none",
            remedy=f'name it, as in residuals(output="{outputs[0]}")',
        )
    if output is not None and output not in outputs:
        raise ChannelError([output], outputs, where="output")
    return 0 if output is None else outputs.index(output)


def analyse_residuals(
    model: AbstractModel,
    traces: Sequence[Trace],
    start: Start | None = None,
    *,
    n_lags: int = 25,
    probability: float = 0.99,
    free_run: bool = False,
    output: str | None = None,
) -> ResidualAnalysis:
    """Analyse the residuals of a model.

    Args:
        model: Any model.
        traces: The traces; lags never cross from one into the next.
        start: How a prediction begins, and from which sample on residuals count; at rest by default.
        n_lags: Lags on each side.
        probability: Of the bounds.
        free_run: Residuals of the free run in place of the one-step prediction. They are not expected to be white,
            but to be independent of the inputs.
        output: Which output, of a model of several.

    Returns:
        The analysis.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping, or the model has no such output.
        ConfigError: If no output is named, of several.
        TraceError: If there are not more residuals than lags, or a residual is not finite.
    """
    column = of_output(model.mapping.outputs, output)
    records = [_record(model, trace, start or Start(), free_run, column) for trace in traces]
    n = sum(int(record.counted.sum()) for record in records)
    if n <= n_lags + 1 or not all(np.isfinite(record.residual).all() for record in records):
        raise TraceError(
            "the residuals cannot be analysed",
            expected=f"finite residuals, more than {n_lags + 1} of them",
            got=f"{n} residuals" if n <= n_lags + 1 else "values that are not finite",
            remedy="use a longer trace or fewer lags" if n <= n_lags + 1 else "analyse a model that is stable",
        )
    records = _centred(records)
    lags = np.arange(n_lags + 1)
    covariance = sum((_correlate(r.residual, r.residual, n_lags)[n_lags:] for r in records), np.zeros(n_lags + 1))
    scale = covariance[0] if covariance[0] > 0.0 else 1.0
    r = covariance / scale
    half = float(scipy.stats.norm.ppf(0.5 + 0.5 * probability))
    whiteness = Correlation(
        name="residual", lags=lags[1:], values=r[1:], bound=half / np.sqrt(n), probability=probability
    )
    ljung_box = float(n * (n + 2) * np.sum(r[1:] ** 2 / (n - lags[1:])))
    return ResidualAnalysis(
        n_samples=n,
        variance=float(covariance[0] / n),
        whiteness=whiteness,
        ljung_box=ljung_box,
        ljung_box_p=float(scipy.stats.chi2.sf(ljung_box, n_lags)),
        inputs=tuple(
            _with_input(records, j, name=name, n_lags=n_lags, half=half, probability=probability)
            for j, name in enumerate(model.mapping.inputs)
        ),
    )


def _record(model: AbstractModel, trace: Trace, start: Start, free_run: bool, column: int) -> _Record:
    inputs, target = trace.columns(model.mapping.inputs), model.measured(trace)
    usable = trace.usable_of(model.mapping.channels)
    begun = beginning(model, inputs, target, start, usable, case=trace.name)
    history, scored = begun.history, slice(begun.first, None)
    inputs, target, counted = inputs[scored], target[scored], usable[scored]
    # With noise added to the output alone the free run is the best prediction, any number of steps ahead.
    free_run = free_run or not model.recursion.predicts
    output = model.simulate(inputs, history) if free_run else gaps.predicted(model, inputs, target, history, counted)
    residual = (target - output).reshape(len(target), -1)[:, column]
    return _Record(np.where(counted, residual, 0.0), inputs, counted)


def _centred(records: Sequence[_Record]) -> list[_Record]:
    """Residuals and inputs as deviations from their means over all traces."""
    counted = np.concatenate([record.counted for record in records])
    mean = np.concatenate([record.residual for record in records])[counted].mean()
    level = np.concatenate([record.inputs for record in records])[counted].mean(axis=0)
    return [
        _Record(
            np.where(record.counted, record.residual - mean, 0.0),
            np.where(record.counted[:, np.newaxis], record.inputs - level, 0.0),
            record.counted,
        )
        for record in records
    ]


def _correlate(a: NDArray[np.float64], b: NDArray[np.float64], n_lags: int) -> NDArray[np.float64]:
    """``sum_t a(t) b(t - lag)`` for lags from ``-n_lags`` to ``n_lags``."""
    size = scipy.fft.next_fast_len(len(a) + n_lags + 1, real=True)
    product = scipy.fft.irfft(scipy.fft.rfft(a, size) * np.conj(scipy.fft.rfft(b, size)), size)
    return np.concatenate([product[-n_lags:] if n_lags else product[:0], product[: n_lags + 1]])


def _with_input(
    records: Sequence[_Record], j: int, *, name: str, n_lags: int, half: float, probability: float
) -> Correlation:
    """Cross-correlation of residual and one input, with the bound for a coloured residual and a coloured input."""
    cross = np.zeros(2 * n_lags + 1)
    energy_e = energy_u = 0.0
    variance = 0.0
    for record in records:
        e, u = record.residual, record.inputs[:, j]
        cross += _correlate(e, u, n_lags)
        reach = min(len(e) - 1, REACH * n_lags)
        # Triangular weights keep the sum positive; held inputs are what it has to reach over.
        taper = 1.0 - np.abs(np.arange(-reach, reach + 1)) / (reach + 1)
        variance += float((taper * _correlate(e, e, reach)) @ _correlate(u, u, reach)) / len(e)
        energy_e += float(e @ e)
        energy_u += float(u @ u)
    total = float(np.sqrt(energy_e * energy_u)) or 1.0
    return Correlation(
        name=name,
        lags=np.arange(-n_lags, n_lags + 1),
        values=cross / total,
        bound=half * float(np.sqrt(max(variance, 0.0))) / total,
        probability=probability,
    )
