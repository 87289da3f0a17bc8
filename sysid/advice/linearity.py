r"""Is it linear? By the best linear approximation of a periodic input, or by what curvature explains of the rest.

Of a periodic input what does not repeat is noise, and what repeats but follows no smooth frequency response is
distortion (Pintelon and Schoukens, "System identification: a frequency domain approach", chapters 4 and 7): at the
excited lines the response is a parabola over some neighbours, at the others it is nothing.

Otherwise squares and cubes of the linear response, and the linear responses to squares and cubes of the inputs, are
looked for in what it leaves; then those of past outputs (:mod:`.curved_state`). That sees curvature, saturation and
what a state does to itself; it does not see friction, play or what depends on a state that moves little.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.advice.dynamics import AWAY
from sysid.advice.finding import Finding, Topic, Verdict
from sysid.advice.record import BARELY, Record, Residual
from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse
from sysid.estimation.nonparametric.noise import whitener
from sysid.estimation.nonparametric.response import FrequencyResponse
from sysid.estimation.nonparametric.segments import Segment
from sysid.estimation.records.informative import beyond_chance, by_chance

SURE, LIKELY = 1e-4, 1e-2
SLIGHT, CLEAR = 0.05, 0.2
"""Parts of what a linear response leaves that curvature explains: where it is told, and where it is clear."""
MATTERS = 1e-4
"""Part of the output's variance that curvature has to explain to be worth a network: one hundredth of its deviation."""
NOTHING_LEFT = 1e-6
"""Part of the output's variance that a linear response leaves, below which there is nothing to ask."""
NEIGHBOURS, SMOOTH = 6, 10
"""Excited lines to either side over which a response is a parabola; settling times that make a period long enough."""
COHERENT, SMEARED = 0.9, 0.1
"""Share of the output from which the inputs account for it, and how much less than an impulse response explains it is
where the windows are what is seen: what is linear is coherent."""


def check_linearity(record: Record) -> Iterator[Finding]:
    """By whichever way the record allows.

    Args:
        record: The record.

    Yields:
        Whether it is linear, and the coherence.
    """
    if not record.moving:
        return
    periodic = _periodic(record)
    yield periodic if periodic is not None else _curved(record)
    yield from _changed(record)
    yield from _coherence(record)


def _unknown(reason: str) -> Finding:
    return Finding(topic=Topic.LINEARITY, code="linearity.unknown", verdict=Verdict.UNKNOWN, reason=reason)


def _period_of(u: NDArray[np.float64]) -> int:
    """The period of a signal in samples; 0 where it does not come twice, to a thousandth of its size."""
    n = len(u)
    x = u - u.mean()
    power = float(x @ x)
    if n < 16 or power <= 1e-24 * float(u @ u):
        return 0
    X = np.fft.rfft(x, 2 * n)
    products = np.fft.irfft(np.abs(X) ** 2, 2 * n)[: n // 2 + 1]
    squares = np.concatenate([[0.0], np.cumsum(x**2)])
    lags = np.arange(n // 2 + 1)
    # |x(t) - x(t - lag)|² over the overlap, by the sums of squares and the products.
    apart = (squares[n] - squares[lags]) + squares[n - lags] - 2.0 * products
    usual = (squares[n] - squares[lags]) + squares[n - lags]
    same = np.flatnonzero((apart[4:] <= 1e-5 * usual[4:]) & (usual[4:] > 1e-3 * power)) + 4
    return int(same[0]) if len(same) else 0


def _periodic(record: Record) -> Finding | None:
    """The best linear approximation, of one input; ``None`` where the input is not periodic, or there are several."""
    if len(record.moving) != 1:
        return None
    j = record.mapping.inputs.index(record.moving[0])
    segment = max(record.segments, key=len)
    period = _period_of(segment.inputs[: 2**18, j])
    if period < 4 * NEIGHBOURS or len(segment) < 2 * period:
        return None
    # Between lines that lie so far apart a response is no parabola: its own bends would pass for distortion.
    slow, factor = record.slowed
    if not isinstance(slow.impulse, str) and period < SMOOTH * max(slow.impulse.settling()) * factor:
        return None
    return _approximation(segment, j, period)


def _approximation(segment: Segment, j: int, period: int) -> Finding | None:
    count = len(segment) // period
    # The first period still answers to what was before.
    first = len(segment) - (count - 1 if count > 2 else count) * period
    U, Y = (
        np.fft.rfft(x[first:].reshape(-1, period), axis=1)[:, 1 : (period + 1) // 2] / period
        for x in (segment.inputs[:, j], segment.output)
    )
    periods = len(Y)
    u, y = U.mean(axis=0), Y.mean(axis=0)
    excited = np.flatnonzero(np.abs(u) > 1e-3 * np.abs(u).max())
    if len(excited) < 3 * NEIGHBOURS or periods < 2:
        return None
    noise = np.sum(np.abs(Y - y) ** 2, axis=0) / (periods - 1) / periods
    total, silent = _local_rest(u[excited], y[excited], excited), np.setdiff1d(np.arange(len(u)), excited)
    power = float(np.sum(np.abs(y) ** 2))
    # Line numbers are one more than places.
    even, odd = silent[(silent + 1) % 2 == 0], silent[(silent + 1) % 2 == 1]
    shares = {
        name: max(float(np.sum(np.abs(y[lines]) ** 2 - noise[lines])), 0.0) / power
        for name, lines in (("even", even), ("odd", odd))
    }
    at_lines = max(total - float(noise[excited].sum()), 0.0) / power
    distortion = at_lines + shares["even"] + shares["odd"]
    noise_share = float(noise.sum()) * periods / power
    figures = {
        "distortion": distortion, "noise": noise_share, "period": period, "periods": periods, **shares,
        "distortion_db": 10.0 * np.log10(max(distortion, 1e-16)), "noise_db": 10.0 * np.log10(max(noise_share, 1e-16)),
    }  # fmt: skip
    above = distortion > 3.0 * noise_share / periods
    if above and distortion > 1e-2:
        code, verdict = "linearity.distorted", Verdict.LOOK
    elif above and distortion > 1e-4:
        code, verdict = "linearity.slightly_distorted", Verdict.NOTE
    else:
        code, verdict = "linearity.best_linear_is_enough", Verdict.FINE
    return Finding(topic=Topic.LINEARITY, code=code, verdict=verdict, figures=figures)


def _local_rest(u: NDArray[np.complex128], y: NDArray[np.complex128], lines: NDArray[np.int64]) -> float:
    """What a response that is a parabola over neighbouring lines leaves of the output, for all lines together."""
    n, width = len(u), 2 * NEIGHBOURS + 1
    rest = 0.0
    for k in range(n):
        start = min(max(k - NEIGHBOURS, 0), n - width)
        part = slice(start, start + width)
        d = (lines[part] - lines[k]) / max(abs(lines[part][-1] - lines[part][0]), 1)
        A = u[part, None] * d[:, None] ** np.arange(3)
        rest += float(np.sum(np.abs(y[part] - A @ np.linalg.lstsq(A, y[part], rcond=None)[0]) ** 2)) / (width - 3)
    return rest


def _curved(record: Record) -> Finding:
    """By curves of the response to the inputs; where these leave it open, by those of past outputs."""
    found, curve = _curvature(record), record.state_curve
    if curve is None or found.code == "linearity.curved":
        return found
    figures = {"share": curve.share, "p": curve.p, "seconds": curve.samples * record.sample_time}
    return Finding(topic=Topic.LINEARITY, code="linearity.curved_state", verdict=Verdict.LOOK, figures=figures)


def _curvature(record: Record) -> Finding:
    slow, _ = record.slowed
    found = slow.impulse
    if isinstance(found, str):
        return _unknown(found)
    if record.runs_away:
        return _unknown(AWAY)
    if record.lasts:
        return _unknown("the response lasts longer than the lags by which it is judged")
    if found.explained < BARELY:
        figures = {"explained": max(found.explained, 0.0)}
        return Finding(topic=Topic.LINEARITY, code="linearity.nothing_explained", verdict=Verdict.LOOK, figures=figures)
    records = _long_enough(record)
    if not records:
        return _unknown("the record is too short, or parted by gaps into stretches that are")
    total = float(np.sum([np.var(one.segment.output) * len(one.left) for one in records]))
    rest = float(np.sum([np.var(one.left) * len(one.left) for one in records]))
    if rest <= NOTHING_LEFT * total:
        return Finding(
            topic=Topic.LINEARITY, code="linearity.exact", verdict=Verdict.FINE, figures={"left": rest / total}
        )
    features = _moving([_features(one, found) for one in records])
    plain, share, p = _asked(features, records)
    figures = {"share": plain, "p": p, "left": rest / total}
    if p < SURE and plain > CLEAR and plain * rest / total >= MATTERS:
        code, verdict = "linearity.curved", Verdict.LOOK
    elif p < LIKELY and plain > CLEAR:
        code, verdict = "linearity.perhaps_curved", Verdict.NOTE
    elif p < SURE and max(plain, share) > SLIGHT:
        code, verdict = "linearity.slightly_curved", Verdict.NOTE
    else:
        code, verdict = "linearity.none_seen", Verdict.FINE
    return Finding(topic=Topic.LINEARITY, code=code, verdict=verdict, figures=figures)


def _long_enough(record: Record) -> list[Residual]:
    """What a response leaves, where it is long enough to ask what explains it."""
    records = [one for one in record.residuals if len(one.left) > 40]
    return records if sum(len(one.left) for one in records) >= 100 else []


def _asked(features: list[NDArray[np.float64]], records: list[Residual]) -> tuple[float, float, float]:
    """Share that the features explain of what is left, the same whitened, and the probability of that by chance."""
    left = [one.left for one in records]
    whiten = whitener([y - y.mean() for y in left], min(8, sum(map(len, left)) // 40))
    return (_explained(features, left, np.ones(1)), *_tested(features, left, whiten))


def _changed(record: Record) -> Iterator[Finding]:
    """What changes the response: an input that does nothing by itself, or the time."""
    found, records = record.slowed[0].impulse, _long_enough(record)
    if isinstance(found, str) or found.explained < BARELY or record.runs_away or record.lasts or not records:
        return
    for j, name in enumerate(found.mapping.inputs):
        if not found.dead_times[j].acts and len(found.mapping.inputs) > 1:
            features = _moving([_products(one, found, j) for one in records])
            share, _, p = _asked(features, records) if features[0].shape[1] else (0.0, 0.0, 1.0)
            if p < SURE and share > SLIGHT:
                yield Finding(
                    topic=Topic.LINEARITY, code="effect.by_product", verdict=Verdict.LOOK, subject=(name,),
                    figures={"share": share, "p": p},
                )  # fmt: skip
    times = np.split(np.linspace(-1.0, 1.0, n := sum(len(one.left) for one in records)), _ends(records))
    features = [
        (one.simulated - one.simulated.mean())[:, None] * np.column_stack([t, 1.5 * t**2 - 0.5, 2.5 * t**3 - 1.5 * t])
        for one, t in zip(records, times, strict=True)
    ]
    share, _, p = _asked(features, records)
    if p < SURE and share > CLEAR and n:
        yield _of_strength(features, records, np.concatenate(times), share)


def _ends(records: list[Residual]) -> NDArray[np.intp]:
    return np.cumsum([len(one.left) for one in records])[:-1]


def _of_strength(
    features: list[NDArray[np.float64]], records: list[Residual], t: NDArray[np.float64], share: float
) -> Finding:
    """How the strength of the response goes over the record, as a share of its mean."""
    left = np.concatenate([one.left - one.left.mean() for one in records])
    c = np.linalg.lstsq(np.vstack(features), left, rcond=None)[0]
    strength = 1.0 + np.column_stack([t, 1.5 * t**2 - 0.5, 2.5 * t**3 - 1.5 * t]) @ c
    figures = {"share": share, "low": float(strength.min()), "high": float(strength.max())}
    return Finding(topic=Topic.LINEARITY, code="response.varies", verdict=Verdict.LOOK, figures=figures)


def _late(w: NDArray[np.float64], found: ImpulseResponse) -> NDArray[np.float64]:
    """A signal some time before, a sixth of what it takes to settle."""
    step = max(int(max(found.settling()) // 6), 1)
    return np.concatenate([np.full(min(step, len(w)), w[0]), w[: max(len(w) - step, 0)]])


def _products(one: Residual, found: ImpulseResponse, j: int) -> NDArray[np.float64]:
    """The response, now and before, times an input: what it makes stronger, quicker or later."""
    w, u = one.simulated - one.simulated.mean(), one.segment.inputs[int(found.lags[-1]) :, j]
    w, x = w / (w.std() or 1.0), (u - u.mean()) / (u.std() or 1.0)
    late = _late(w, found)
    return np.column_stack([w * x, late * x, w * _late(x, found), late * _late(x, found)])


def _features(one: Residual, found: ImpulseResponse) -> NDArray[np.float64]:
    """Squares and cubes, orthogonal enough to a linear response to be told from it."""
    w = one.simulated - one.simulated.mean()
    w = w / (w.std() or 1.0)
    late = _late(w, found)
    columns = [w**2, w**3 - 3 * w, w * late, late**2, late**3 - 3 * late, w**2 * late, w * late**2]
    deepest = int(found.lags[-1])
    for j in range(one.segment.inputs.shape[1]):
        u = one.segment.inputs[:, j]
        x = (u - u.mean()) / (u.std() or 1.0)
        g = np.zeros(deepest + 1)
        g[found.lags] = found.values[j]
        size = float(np.sqrt(g @ g)) or 1.0
        curved = [z - z.mean() for z in (x**2, x**3 - 3 * x)]
        columns += [scipy.signal.lfilter(g / size, [1.0], z)[deepest:] for z in curved]
    return np.column_stack(columns)


def _moving(features: list[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Those that move in some record: of two levels a square says nothing, and of an input that stands nothing does."""
    moves = np.any([np.ptp(X, axis=0) > 1e-9 for X in features], axis=0)
    return [X[:, moves] for X in features]


def _tested(
    features: list[NDArray[np.float64]], left: list[NDArray[np.float64]], whiten: NDArray[np.float64]
) -> tuple[float, float]:
    """Share that the features explain of what is left, whitened, and the probability that chance does as much."""
    q, rows = features[0].shape[1], sum(len(y) - len(whiten) + 1 for y in left)
    share = _explained(features, left, whiten, corrected=False)
    free = rows - q - len(left)
    return beyond_chance(share, rows - len(left), free), by_chance(share, q, free)


def _explained(
    features: list[NDArray[np.float64]],
    left: list[NDArray[np.float64]],
    whiten: NDArray[np.float64],
    *,
    corrected: bool = True,
) -> float:
    blocks = []
    for X, y in zip(features, left, strict=True):
        block = scipy.signal.lfilter(whiten, [1.0], np.column_stack([X, y]), axis=0)[len(whiten) - 1 :]
        blocks.append(block - block.mean(axis=0))
    found = triangle(blocks, free=0)
    q, rows = features[0].shape[1], sum(map(len, blocks))
    share = 1.0 - float(np.sum(found.z[q:] ** 2)) / max(float(found.z @ found.z), 1e-300)
    return beyond_chance(share, rows - 1, max(rows - q - 1, 1)) if corrected else share


def _coherence(record: Record) -> Iterator[Finding]:
    """Up to which frequency the inputs account for the output."""
    found = record.response
    if isinstance(found, str):
        yield Finding(topic=Topic.LINEARITY, code="coherence.unknown", verdict=Verdict.UNKNOWN, reason=found)
        return
    seen = _weighted(found)
    if seen is None:
        yield Finding(
            topic=Topic.LINEARITY, code="coherence.unknown", verdict=Verdict.UNKNOWN,
            reason="the inputs hold too few frequencies",
        )  # fmt: skip
        return
    mean, top = seen
    impulse = record.slowed[0].impulse
    if not isinstance(impulse, str) and mean < impulse.explained - SMEARED:
        reason = "windows that fit between gaps, and its resolution, blur a response that explains more than they show"
        yield Finding(topic=Topic.LINEARITY, code="coherence.unknown", verdict=Verdict.UNKNOWN, reason=reason)
        return
    yield Finding(
        topic=Topic.LINEARITY,
        code="coherence" if mean >= COHERENT else "coherence.low",
        verdict=Verdict.FINE if mean >= COHERENT else Verdict.NOTE,
        figures={"mean": mean, "band": top / (2.0 * np.pi), "nyquist": 0.5 / record.sample_time},
    )


def _weighted(found: FrequencyResponse) -> tuple[float, float] | None:
    """Coherence by how much of the output is at each frequency, and the frequency up to which it is above a half."""
    known = np.isfinite(found.coherence)
    if np.count_nonzero(known) < 3:
        return None
    rest = found.noise[known] * (found.averages - len(found.mapping.inputs)) / found.averages
    coherence = found.coherence[known]
    power = rest / np.maximum(1.0 - coherence, 1e-12)
    mean = float(np.sum(power * coherence) / max(float(np.sum(power)), 1e-300))
    above = np.flatnonzero(coherence >= 0.5)
    return mean, float(found.frequency[known][above[-1]]) if len(above) else 0.0
