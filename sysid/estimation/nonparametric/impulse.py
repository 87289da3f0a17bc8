r"""The impulse response of every input, regularised: no structure, no order, and bands that hold.

Least squares on past inputs under a prior that decays and is smooth (:mod:`.kernels`), whose hyperparameters are those
of largest evidence (:mod:`.evidence`). Coloured noise is whitened by an autoregression of the residuals, after which
the response is estimated again: without that its bands would be too narrow.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.nonparametric.dead_time import shares
from sysid.estimation.nonparametric.evidence import CHUNK, Posterior, Triangle, posterior, triangle
from sysid.estimation.nonparametric.kernels import Hyperparameters, Kernel
from sysid.estimation.nonparametric.noise import whitener
from sysid.estimation.nonparametric.prior import DeadTime, Prior, dead_times, tuned, with_doubt
from sysid.estimation.nonparametric.segments import Segment, columns_of_lags, segments_of
from sysid.models import Mapping
from sysid.traces import Trace

if TYPE_CHECKING:
    import pandas as pd

FIRST_LENGTH, LONGEST, MOST_COLUMNS = 32, 512, 512
"""Lags that are tried first and at most, and columns at most that all inputs may have together."""

CLEARLY = 1.5
"""How much more of the output a late response must explain than an early one, for more lags to be tried first."""
FEWEST_ROWS, MOST_ASKED = 8, 4096
SEEN = 2.5
"""Standard deviations that a response is away from nothing where it is seen to begin."""
TAIL = 0.04
"""A response has settled where the end of it, in root mean square, is below this part of its peak."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ImpulseResponse:
    """What the output does after a pulse of one sample in each input.

    Args:
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        lags: In samples, shape ``(n_lags,)``.
        values: Output unit per input unit, shape ``(n_inputs, n_lags)``.
        covariance: Of the values, input after input, shape ``(n_inputs * n_lags, n_inputs * n_lags)``; zero for lags
            before a dead time that was given.
        kernel: The prior that was used.
        hyperparameters: Of each input.
        dead_times: Of each input: when it begins to act, and whether it acts at all.
        noise_variance: Of the innovations, in the output's unit squared.
        noise_ar: Coefficients of the autoregression that whitens the noise, ``v(t) + a1 v(t-1) + ... = e(t)``.
        explained: Share of the output's variance that the response explains, at most 1.
        log_evidence: Logarithm of the marginal likelihood.
        effective: Number of parameters that the data determine.
        samples: Rows that took part.
        notes: What a reader has to know.
    """

    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_unit: str
    lags: NDArray[np.int64]
    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    kernel: Kernel
    hyperparameters: tuple[Hyperparameters, ...]
    dead_times: tuple[DeadTime, ...]
    noise_variance: float
    noise_ar: tuple[float, ...]
    explained: float
    log_evidence: float
    effective: float
    samples: int
    notes: tuple[str, ...] = ()

    @property
    def deviation(self) -> NDArray[np.float64]:
        """Standard deviation of the values, shape ``(n_inputs, n_lags)``."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).reshape(self.values.shape)

    @property
    def time(self) -> NDArray[np.float64]:
        """Seconds after the pulse, shape ``(n_lags,)``."""
        return self.sample_time * self.lags.astype(np.float64)

    @property
    def noise_deviation(self) -> float:
        """Standard deviation of the noise on the output, coloured as it is, in its unit."""
        pulse = np.zeros(2000)
        pulse[0] = 1.0
        return float(
            np.sqrt(self.noise_variance * np.sum(scipy.signal.lfilter([1.0], [1.0, *self.noise_ar], pulse) ** 2))
        )

    def step(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Response to a step of one unit in each input, and its standard deviation, shape ``(n_inputs, n_lags)``."""
        n = len(self.lags)
        blocks = [self._block(j, j) for j in range(len(self.values))]
        variances = [np.diag(np.cumsum(np.cumsum(block, axis=0), axis=1)) for block in blocks]
        deviation = np.sqrt(np.maximum(np.array(variances), 0.0)) if blocks else np.empty((0, n))
        return np.cumsum(self.values, axis=1), deviation

    def settling(self, share: float = 0.05) -> tuple[int, ...]:
        """Samples after which the step response of each input stays near its end.

        Args:
            share: How near, as a part of the step response's span.

        Returns:
            One number an input; the number of lags where it never does.
        """
        found = []
        for response in self.step()[0]:
            near = share * max(float(np.ptp(np.append(response, 0.0))), 1e-300)
            away = np.flatnonzero(np.abs(response - response[-1]) > near)
            found.append(int(self.lags[away[-1]]) + 1 if len(away) else int(self.lags[0]))
        return tuple(found)

    @property
    def settled(self) -> bool:
        """Whether every response has come to its end within the lags."""
        return all(_settled(values) for values in self.values)

    def simulate(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Output without noise and level; before the first sample every input stood where it stands then.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``.

        Returns:
            Shape ``(n_samples,)``.
        """
        u = np.asarray(inputs, dtype=np.float64).reshape(-1, len(self.values))
        deepest = int(self.lags[-1])
        held = np.concatenate([np.repeat(u[:1], deepest, axis=0), u])
        response = np.zeros((len(self.values), deepest + 1))
        response[:, self.lags] = self.values
        made = [scipy.signal.lfilter(g, [1.0], x)[deepest:] for g, x in zip(response, held.T, strict=True)]
        return np.asarray(np.sum(made, axis=0))

    def to_frame(self) -> pd.DataFrame:
        """A row for each input and lag.

        Returns:
            Columns ``input``, ``lag``, ``time``, ``value``, ``deviation``, ``low``, ``high`` (95 %).
        """
        import pandas as pd

        deviation = self.deviation
        return pd.concat(
            [
                pd.DataFrame(
                    {
                        "input": name,
                        "lag": self.lags,
                        "time": self.time,
                        "value": self.values[j],
                        "deviation": deviation[j],
                        "low": self.values[j] - 1.96 * deviation[j],
                        "high": self.values[j] + 1.96 * deviation[j],
                    }
                )
                for j, name in enumerate(self.mapping.inputs)
            ],
            ignore_index=True,
        )

    def _block(self, i: int, j: int) -> NDArray[np.float64]:
        n = len(self.lags)
        return self.covariance[i * n : (i + 1) * n, j * n : (j + 1) * n]


@dataclass(frozen=True, kw_only=True, eq=False)
class Regression:
    """A record as a regression on past inputs.

    Args:
        segments: Stretches of the record, long enough.
        scale: By which inputs and then the output are divided.
        length: Lags of each input, from 0 on.
    """

    segments: tuple[Segment, ...]
    scale: NDArray[np.float64]
    length: int

    @property
    def n_inputs(self) -> int:
        """Inputs."""
        return len(self.scale) - 1

    def blocks(self, whiten: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
        """Rows of lagged inputs and the output, each trace counted from its mean.

        Args:
            whiten: Coefficients of the filter that every signal passes, its first being 1.

        Yields:
            Matrices of shape ``(n_rows, n_inputs * length + 1)``.
        """
        first = self.length - 1 + len(whiten) - 1
        by_trace: dict[str, list[NDArray[np.float64]]] = {}
        for segment in self.segments:
            if len(segment) > first:
                signals = np.column_stack([segment.inputs, segment.output]) / self.scale
                by_trace.setdefault(segment.trace, []).append(scipy.signal.lfilter(whiten, [1.0], signals, axis=0))
        lags = range(self.length)
        for stretches in by_trace.values():
            rows = sum(len(x) - first for x in stretches)
            mean = np.sum([_column_sums(x, lags, first) for x in stretches], axis=0) / rows
            for x in stretches:
                for start in range(first, len(x), CHUNK):
                    part = slice(start, min(start + CHUNK, len(x)))
                    yield np.column_stack([*(columns_of_lags(u, lags, part) for u in x.T[:-1]), x[part, -1]]) - mean

    def count(self, whiten: NDArray[np.float64]) -> tuple[int, int]:
        """Rows, and traces that have any."""
        first = self.length - 1 + len(whiten) - 1
        kept = [segment for segment in self.segments if len(segment) > first]
        return sum(len(segment) - first for segment in kept), len({segment.trace for segment in kept})

    def triangle(self, whiten: NDArray[np.float64]) -> Triangle:
        """The triangular factor of the regression; the level of each trace has taken one row."""
        found = triangle(self.blocks(whiten), free=0)
        return Triangle(R=found.R, z=found.z, samples=max(found.samples - self.count(whiten)[1], 1))

    def residuals(self, g: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """What the scaled response ``g`` leaves, stretch by stretch, each counted from its mean."""
        found = []
        for segment in self.segments:
            if len(segment) > self.length:
                u, y = segment.inputs / self.scale[:-1], segment.output / self.scale[-1]
                made = [scipy.signal.lfilter(row, [1.0], x - x.mean()) for row, x in zip(g, u.T, strict=True)]
                left = (y - np.sum(made, axis=0))[self.length - 1 :]
                found.append(left - left.mean())
        return found


def _column_sums(x: NDArray[np.float64], lags: Sequence[int], first: int) -> NDArray[np.float64]:
    sums = [[float(x[first - lag : len(x) - lag, j].sum()) for lag in lags] for j in range(x.shape[1] - 1)]
    return np.array([value for row in sums for value in row] + [float(x[first:, -1].sum())])


@one_blas_thread()
def estimate_impulse_response(
    traces: Sequence[Trace],
    mapping: Mapping,
    *,
    lags: int | None = None,
    dead_times: Sequence[int] | None = None,
    kernel: Kernel | None = None,
    noise_order: int | None = None,
    longest: int = LONGEST,
) -> ImpulseResponse:
    """Estimate the impulse response of every input.

    Args:
        traces: The experiments; each has a level of its own, and no lag crosses a gap.
        mapping: Which channels go in, which comes out.
        lags: Length of the responses; by default as long as they take to settle, :data:`LONGEST` at most.
        dead_times: Of each input, in samples: its response is zero before. By default they are found, by the evidence,
            and the response begins at the earliest that the data allow.
        kernel: The prior; by default the one with the larger evidence.
        noise_order: Order of the autoregression of the noise; chosen by BIC by default, 0 for white noise.
        longest: Lags at most, where they are not given.

    Returns:
        The response.

    Raises:
        ConfigError: If the mapping has no input, or an option is out of range.
        ChannelError: If a trace lacks a channel of the mapping.
        TraceError: If the record is too short, or an input never changes.
    """
    m = len(mapping.inputs)
    _check(mapping, lags, dead_times, noise_order)
    segments = segments_of(traces, mapping, shortest=2)
    scale = _scale(segments, mapping)
    room = _room(segments, m, lags)
    length = room if lags is not None else min(FIRST_LENGTH, room)
    most = length if lags is not None else min(room, longest, MOST_COLUMNS // m)
    given = None if dead_times is None else np.asarray(dead_times, dtype=np.int64)
    known = _reach(segments, m, most) if given is None else int(given.max()) + 2
    length = min(max(length, known), max(most, 2))
    while True:
        problem = Regression(segments=segments, scale=scale, length=length)
        kernels = tuple(Kernel) if kernel is None else (kernel,)
        found = _stage(problem, np.ones(1), given, kernels, None)
        if length >= most or all(_settled(row) for row in found.response):
            return _result(_doubted(_whitened(found, given, kernels, noise_order)), traces, mapping)
        length = min(2 * length, most)


def _check(mapping: Mapping, lags: int | None, dead_times: Sequence[int] | None, noise_order: int | None) -> None:
    m = len(mapping.inputs)
    most = MOST_ASKED // max(m, 1)
    for holds, what, expected, got in (
        (m > 0, "there is no input to respond to", "a mapping with inputs", str(mapping)),
        (lags is None or 2 <= lags <= most, "not a length", f"2 to {most} lags", lags),
        (dead_times is None or (len(dead_times) == m and min(dead_times) >= 0), "not the dead times",
         f"{m} numbers of samples, from 0 on", dead_times),
        (noise_order is None or 0 <= noise_order <= 100, "not an order of the noise", "0 to 100", noise_order),
    ):  # fmt: skip
        if not holds:
            raise ConfigError(what, where="impulse response", expected=expected, got=got, remedy=f"give {expected}")


def _scale(segments: Sequence[Segment], mapping: Mapping) -> NDArray[np.float64]:
    """Root mean squares about the means of the stretches."""
    if not segments:
        raise TraceError("no samples that count", expected="two in a row at least", remedy="use a longer record")
    together = np.concatenate([np.column_stack([s.inputs, s.output]) - _mean(s) for s in segments])
    size = np.concatenate([np.abs(np.column_stack([s.inputs, s.output])) for s in segments]).max(axis=0)
    # Neither the square of what is tiny nor of what is huge may be lost.
    most = np.abs(together).max(axis=0)
    scale = most * np.sqrt(np.mean((together / np.where(most > 0.0, most, 1.0)) ** 2, axis=0))
    still = [name for name, s, top in zip(mapping.inputs, scale, size, strict=False) if s <= 1e-12 * top or s == 0.0]
    if still:
        raise TraceError(
            f"the input {', '.join(still)} never changes",
            expected="inputs that move within a record",
            remedy="leave it out of the mapping, or use a record in which it moves",
        )
    return np.where(scale > 0.0, scale, 1.0)


def _mean(segment: Segment) -> NDArray[np.float64]:
    return np.append(segment.inputs.mean(axis=0), segment.output.mean())


def _room(segments: Sequence[Segment], m: int, lags: int | None) -> int:
    """The longest response that the record has rows for."""
    longest = max(map(len, segments))
    if lags is not None:
        rows = sum(max(len(s) - lags + 1, 0) for s in segments)
        if rows < FEWEST_ROWS:
            raise TraceError(
                "the record is too short for so long a response",
                expected=f"{FEWEST_ROWS} rows at least: stretches of {lags + FEWEST_ROWS - 1} samples",
                got=f"stretches of at most {longest} samples",
                remedy=f"use at most {max(longest - FEWEST_ROWS + 1, 2)} lags, or a longer record",
            )
        return lags
    if longest < 2 * FEWEST_ROWS:
        raise TraceError(
            "the record is too short for an impulse response",
            expected=f"{2 * FEWEST_ROWS} samples in a row",
            got=f"stretches of at most {longest}",
            remedy="use a longer record",
        )
    total = sum(map(len, segments))
    return max(2, min(longest // 2, longest - FEWEST_ROWS, MOST_COLUMNS // m, max(total // (2 * m), 4)))


def _reach(segments: Sequence[Segment], m: int, most: int) -> int:
    """Lags that a response needs which begins later than the lags that are tried first: it would be taken for none."""
    found = 0
    targets = [s.output - s.output.mean() for s in segments]
    for j in range(m):
        share = shares([s.inputs[:, j] - s.inputs[:, j].mean() for s in segments], targets, most, 1)
        early = float(share[: FIRST_LENGTH // 2].max())
        if float(share.max()) > CLEARLY * early:
            found = max(found, int(share.argmax()) + FIRST_LENGTH)
    return found


@dataclass(frozen=True, kw_only=True, eq=False)
class _Fitted:
    problem: Regression
    posterior: Posterior
    prior: Prior
    dead: tuple[DeadTime, ...]
    whiten: NDArray[np.float64]

    @property
    def response(self) -> NDArray[np.float64]:
        """The scaled response at all lags, zero before each dead time."""
        return _full(self.posterior.mean, self.prior)


def _full(mean: NDArray[np.float64], prior: Prior) -> NDArray[np.float64]:
    g = np.zeros(len(prior.kept))
    g[prior.kept] = mean
    return g.reshape(len(prior.dead), prior.length)


def _whitened(
    found: _Fitted, given: NDArray[np.int64] | None, kernels: Sequence[Kernel], noise_order: int | None
) -> _Fitted:
    """The same responses, estimated again under the noise that they leave."""
    problem = found.problem
    if noise_order == 0:
        return found
    rows = problem.count(found.whiten)[0]
    most = noise_order if noise_order is not None else min(12, rows // 20)
    whiten = whitener(problem.residuals(found.response), most, exact=noise_order is not None)
    if len(whiten) == 1 or problem.count(whiten)[0] < FEWEST_ROWS:
        return found
    return _stage(problem, whiten, given, kernels, found.prior)


def _stage(
    problem: Regression,
    whiten: NDArray[np.float64],
    given: NDArray[np.int64] | None,
    kernels: Sequence[Kernel],
    start: Prior | None,
) -> _Fitted:
    data, n = problem.triangle(whiten), problem.length
    dead = np.zeros(problem.n_inputs, dtype=np.int64) if given is None else np.minimum(given, n - 1)
    if start is not None:
        dead = start.dead
    prior = tuned(data, n, dead, kernels[:1], start=start)
    if given is None:
        found, prior = dead_times(data, prior, most=max(n - 3, 0))
    else:
        found = tuple(DeadTime(best=int(k), low=int(k), high=int(k), odds=np.inf) for k in given)
    prior = tuned(data, n, prior.dead, kernels, start=prior)
    return _Fitted(
        problem=problem,
        posterior=posterior(data.columns(prior.kept), prior.factor()),
        prior=prior,
        dead=found,
        whiten=whiten,
    )


def _doubted(found: _Fitted) -> _Fitted:
    """The same responses, their bands wider by what is not known of the prior."""
    if not found.prior.kept.any():
        return found
    data = found.problem.triangle(found.whiten)
    return replace(found, posterior=with_doubt(data, found.prior))


def _settled(g: NDArray[np.float64]) -> bool:
    """Whether a response is near zero over its last tenth."""
    end = g[-max(len(g) // 10, 3) :]
    return bool(np.sqrt(np.mean(end**2)) <= TAIL * np.abs(g).max())


def _seen(fitted: _Fitted) -> tuple[DeadTime, ...]:
    """The dead times, none of them before a response that can be told from nothing."""
    problem, g = fitted.problem, fitted.response
    variance = np.zeros(g.size)
    variance[fitted.prior.kept] = np.diag(fitted.posterior.covariance)
    clear = np.abs(g) > SEEN * np.sqrt(variance.reshape(g.shape))
    found = []
    for one, row in zip(fitted.dead, clear, strict=True):
        later = np.flatnonzero(row & (np.arange(problem.length) >= one.best))
        best = int(later[0]) if len(later) and one.acts else one.best
        found.append(replace(one, best=best, high=max(one.high, best)))
    return tuple(found)


def _result(fitted: _Fitted, traces: Sequence[Trace], mapping: Mapping) -> ImpulseResponse:
    problem, found, prior, whiten = fitted.problem, fitted.posterior, fitted.prior, fitted.whiten
    m, n, g = problem.n_inputs, problem.length, fitted.response
    units = problem.scale[-1] / np.repeat(problem.scale[:-1], n)
    covariance = np.zeros((m * n, m * n))
    covariance[np.ix_(prior.kept, prior.kept)] = found.covariance
    left, y = problem.residuals(g), [s.output[n - 1 :] / problem.scale[-1] for s in problem.segments if len(s) > n]
    total = sum(float(np.sum((part - part.mean()) ** 2)) for part in y)
    rest = sum(float(part @ part) for part in left)
    unsettled = [name for name, row in zip(mapping.inputs, g, strict=True) if not _settled(row)]
    seconds = (n - 1) * traces[0].sample_time
    notes = (f"{', '.join(unsettled)}: not settled within {n} samples ({seconds:g} s)",) if unsettled else ()
    return ImpulseResponse(
        mapping=mapping,
        sample_time=traces[0].sample_time,
        input_units=tuple(traces[0].channel(name).unit for name in mapping.inputs),
        output_unit=traces[0].channel(mapping.output).unit,
        lags=np.arange(n),
        values=g * (problem.scale[-1] / problem.scale[:-1])[:, None],
        covariance=covariance * np.outer(units, units),
        kernel=prior.kernel,
        hyperparameters=prior.in_units(found.noise_variance * problem.scale[-1] ** 2, problem.scale[:-1]),
        dead_times=_seen(fitted),
        noise_variance=found.noise_variance * float(problem.scale[-1]) ** 2,
        noise_ar=tuple(whiten[1:].tolist()),
        explained=1.0 - rest / total if total > 0.0 else 0.0,
        log_evidence=found.log_evidence,
        effective=found.effective,
        samples=problem.count(whiten)[0],
        notes=notes,
    )
