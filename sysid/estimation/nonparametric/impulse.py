r"""The impulse response of every input, regularised: no structure, no order, and bands that hold.

Least squares on past inputs under a prior that decays and is smooth (:mod:`.kernels`), whose hyperparameters are those
of largest evidence (:mod:`.evidence`). Coloured noise is whitened by an autoregression of the residuals, after which
the response is estimated again: without that its bands would be too narrow.

Where an input is set from the output of its own sample, the response of the same sample is the controller's and not the
plant's. It is left out then: with its noise whitened, what is left is a direct estimate in closed loop (Ljung 1999,
section 13.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.nonparametric.dead_time import shares
from sysid.estimation.nonparametric.evidence import Posterior, Triangle, posterior
from sysid.estimation.nonparametric.feedback import find_feedback
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse, settled
from sysid.estimation.nonparametric.kernels import Kernel
from sysid.estimation.nonparametric.lagged_rows import Regression
from sysid.estimation.nonparametric.noise import whitener
from sysid.estimation.nonparametric.prior import DeadTime, Prior, dead_times, tuned, with_doubt
from sysid.estimation.nonparametric.segments import Segment, segments_of
from sysid.models import Mapping
from sysid.traces import Trace

FIRST_LENGTH, LONGEST, MOST_COLUMNS = 32, 512, 512
"""Lags that are tried first and at most, and columns at most that all inputs may have together."""

CLEARLY = 1.5
"""How much more of the output a late response must explain than an early one, for more lags to be tried first."""
FEWEST_ROWS, MOST_ASKED = 8, 4096
ROUNDING = 1e-18
"""Part of the output's square that is left where it is rounding and no noise: a billionth of its size."""
SEEN = 2.5
"""Standard deviations that a response is away from nothing where it is seen to begin."""


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
            and the response begins at the earliest that the data allow; at lag 1 where an input is set from the
            output of its own sample.
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
    segments = segments_of(traces, mapping, shortest=2, of_inputs=True)
    scale = _scale(segments, mapping)
    late = int(dead_times is None and _set_at_once(segments_of(traces, mapping, shortest=2)))
    if late:
        segments = tuple(_one_later(s) for s in segments if len(s) > 2 and s.counts()[1:].any())
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
        if length >= most or all(settled(row) for row in found.response):
            result = _result(_doubted(_whitened(found, given, kernels, noise_order)), traces, mapping)
            return _later(result) if late else result
        length = min(2 * length, most)


def _one_later(s: Segment) -> Segment:
    """Each output beside the inputs of the sample before."""
    seen = None if s.seen is None else s.seen[1:]
    return replace(s, inputs=s.inputs[:-1], output=s.output[1:], first=s.first + 1, seen=seen)


def _set_at_once(segments: Sequence[Segment]) -> bool:
    """Whether an input is set from the output of its own sample."""
    found = find_feedback(segments)
    return not isinstance(found, str) and found.at_once


def _later(found: ImpulseResponse) -> ImpulseResponse:
    """A response to the inputs of one sample before, as one to the inputs."""
    dead = tuple(replace(one, best=one.best + 1, low=one.low + 1, high=one.high + 1) for one in found.dead_times)
    told = (
        f"{found.mapping.output} acts on {', '.join(found.mapping.inputs)} within the sample (closed loop): what moves "
        "together there is the controller's, and is left out. What is left is right as far as the noise is modelled."
    )
    return replace(found, lags=found.lags + 1, dead_times=dead, notes=(*found.notes, told))


def _check(mapping: Mapping, lags: int | None, dead_times: Sequence[int] | None, noise_order: int | None) -> None:
    m = len(mapping.inputs)
    most = MOST_ASKED // max(m, 1)
    long = lags is None or (isinstance(lags, int | np.integer) and 2 <= lags <= most)
    for holds, what, expected, got in (
        (m > 0, "there is no input to respond to", "a mapping with inputs", str(mapping)),
        (long, "not a length", f"2 to {most} lags", lags),
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
    together = np.concatenate([_seen_signals(s) - _mean(s) for s in segments])
    size = np.concatenate([np.abs(_seen_signals(s)) for s in segments]).max(axis=0)
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


def _seen_signals(segment: Segment) -> NDArray[np.float64]:
    """Inputs and output where the output counts."""
    signals = np.column_stack([segment.inputs, segment.output])
    return signals if segment.seen is None else signals[segment.seen]


def _mean(segment: Segment) -> NDArray[np.float64]:
    return np.asarray(_seen_signals(segment).mean(axis=0))


def _room(segments: Sequence[Segment], m: int, lags: int | None) -> int:
    """The longest response that the record has rows for."""
    longest = max(map(len, segments))
    if lags is not None:
        rows = sum(int(np.count_nonzero(s.counts()[lags - 1 :])) for s in segments)
        if rows < FEWEST_ROWS:
            raise TraceError(
                "the record is too short for so long a response",
                expected=f"{FEWEST_ROWS} rows at least: stretches of {lags + FEWEST_ROWS - 1} samples",
                got=f"stretches of at most {longest} samples",
                remedy=f"use at most {max(longest - FEWEST_ROWS + 1, 2)} lags, or a longer record",
            )
        return lags
    total = sum(int(np.count_nonzero(s.counts())) for s in segments)
    if min(longest, total) < 2 * FEWEST_ROWS:
        raise TraceError(
            "the record is too short for an impulse response",
            expected=f"{2 * FEWEST_ROWS} samples in a row",
            got=f"stretches of at most {longest}",
            remedy="use a longer record",
        )
    return max(2, min(longest // 2, longest - FEWEST_ROWS, MOST_COLUMNS // m, max(total // (2 * m), 4)))


def _reach(segments: Sequence[Segment], m: int, most: int) -> int:
    """Lags that a response needs which begins later than the lags that are tried first: it would be taken for none."""
    found = 0
    targets = [np.where(s.counts(), s.output - s.output[s.counts()].mean(), 0.0) for s in segments]
    for j in range(m):
        share = shares([s.inputs[:, j] - s.inputs[:, j].mean() for s in segments], targets, most, 1)
        early = float(share[: FIRST_LENGTH // 2].max())
        if float(share.max()) > CLEARLY * early:
            found = max(found, int(share.argmax()) + FIRST_LENGTH)
    return found


@dataclass(frozen=True, kw_only=True, eq=False)
class _Fitted:
    problem: Regression
    data: Triangle
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
    rows, left = problem.count(found.whiten)[0], problem.residuals(found.response)
    if noise_order is None and sum(float(part @ part) for part in left) <= ROUNDING * float(
        found.data.z @ found.data.z
    ):
        return found  # of a simulation that it explains whole: what is left has no colour
    most = noise_order if noise_order is not None else min(12, rows // 20)
    whiten = whitener(left, most, exact=noise_order is not None)
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
        data=data,
        posterior=posterior(data.columns(prior.kept), prior.factor()),
        prior=prior,
        dead=found,
        whiten=whiten,
    )


def _doubted(found: _Fitted) -> _Fitted:
    """The same responses, their bands wider by what is not known of the prior."""
    if not found.prior.kept.any():
        return found
    return replace(found, posterior=with_doubt(found.data, found.prior))


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
    left = problem.residuals(g)
    seen = [s.output[n - 1 :][s.counts()[n - 1 :]] / problem.scale[-1] for s in problem.segments if len(s) > n]
    y = [part for part in seen if len(part)]
    total = sum(float(np.sum((part - part.mean()) ** 2)) for part in y)
    rest = sum(float(part @ part) for part in left)
    unsettled = [name for name, row in zip(mapping.inputs, g, strict=True) if not settled(row)]
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
