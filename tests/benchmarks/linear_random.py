"""Linear fits of random plants that end as converged, unwarned, and far from the best: how many, and which.

    python -m tests.benchmarks linear_random [--plants=120] [--first=0] [--only=SS] [--list]

Plants of the orders 1 to 5, with and without resonances, 5 to 200 samples a time constant or 5 to 60 a period, driven
by steps, held multisines or filtered noise; white noise of a sensor (1 to 10 %), noise that passes the plant's poles
(ARMAX), or a drift; one input and output, or two and two. Each structure has the true order. Its free run over a new
record is held against the plant's own output without noise.

A fit is counted where it is ``CONVERGED`` and unwarned, and either more than 5 points of fit below the best of its
plant, or at more than 1.1 times the power that its own errors can have. Structures without a model of the noise are
held against each other and the run that is refined from the truth over the same record; the others against each
other and the power of the innovations.
"""

from __future__ import annotations

import argparse
import warnings
from collections import Counter
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from scipy.linalg import block_diag
from scipy.optimize import least_squares

import sysid
from sysid.api.system_fit import SystemFit

Array = NDArray[np.float64]
POINTS, POWER = 5.0, 1.1
REST = 10
"""Samples at rest that each record begins with, so that a run on it knows where it begins."""
FREE = ("OE", "TF", "SS")
"""Structures without a model of the noise."""
NOISES = ("white", "white", "armax", "drift")
INPUTS = ("steps", "multisine", "filtered")


@dataclass(frozen=True, kw_only=True, eq=False)
class Draw:
    """A plant with its records: ``u`` and ``y`` to fit, a new ``u`` with the output without noise.

    Args:
        A: Of the sampled plant; ``B``, ``C`` likewise.
        innovations: The white noise of each sample.
    """

    A: Array
    B: Array
    C: Array
    u: Array
    y: Array
    innovations: Array
    new_u: Array
    new_y: Array
    words: str
    noise: str


def draw(seed: int) -> Draw:
    """The plant of a seed."""
    rng = np.random.default_rng(seed)
    width, order = (2, int(rng.integers(2, 6))) if seed % 4 == 3 else (1, int(rng.integers(1, 6)))
    noise, kind = NOISES[(seed // 2) % 4], INPUTS[int(rng.integers(3))]
    A, B, C, told = _plant(rng, order, width)
    n, slow = int(10 ** rng.uniform(2.8, 3.6)), -1.0 / np.log(np.abs(np.linalg.eigvals(A)).max())
    n = max(n, int(min(15 * slow, 3000)))
    u, new_u = (_inputs(rng, kind, n, width, A) for _ in range(2))
    u[:REST] = new_u[:REST] = 0.0
    clean, new_y = _run(A, B, C, u), _run(A, B, C, new_u)
    size = clean.std(axis=0)
    clean, new_y, C = clean / size, new_y / size, C / size[:, None]
    share, e = float(10 ** rng.uniform(-2, -1)), rng.normal(size=clean.shape)
    if noise == "armax":
        v = signal.lfilter([1.0, 0.3], np.poly(np.linalg.eigvals(A)).real, e, axis=0)
        scale = share / v.std(axis=0)
    elif noise == "drift":
        v = np.cumsum(0.1 * e, axis=0)
        v, scale = v + rng.normal(size=v.shape), share / np.maximum(v.std(axis=0), 1e-12)
    else:
        v, scale = e, np.full(width, share)
    words = f"{width}x{width} order {order} {noise} {share:.1%} {kind} n={n} {told}"
    return Draw(
        A=A, B=B, C=C, u=u, y=clean + scale * v, innovations=scale * e, new_u=new_u, new_y=new_y, words=words,
        noise=noise,
    )  # fmt: skip


def _plant(rng: np.random.Generator, order: int, width: int) -> tuple[Array, Array, Array, str]:
    """Modes side by side, mixed by random gains; real ones over 5 to 200 samples, pairs over 5 to 60 a period."""
    blocks, told, left = [], [], order
    while left:
        if left >= 2 and rng.random() < 0.6:
            period, damping = 5.0 * 12.0 ** rng.random(), 10 ** rng.uniform(-1.7, -0.3)
            r, w = np.exp(-damping * 2 * np.pi / period), 2 * np.pi / period
            blocks.append(r * np.array([[np.cos(w), np.sin(w)], [-np.sin(w), np.cos(w)]]))
            told, left = [*told, f"pair T={period:.0f} d={damping:.2f}"], left - 2
        else:
            tau = 5.0 * 40.0 ** rng.random()
            blocks.append(np.array([[np.exp(-1.0 / tau)]]))
            told, left = [*told, f"tau={tau:.0f}"], left - 1
    A = block_diag(*blocks)
    B, C = rng.normal(size=(order, width)), rng.normal(size=(width, order))
    B = B * np.maximum(1.0 - np.abs(np.linalg.eigvals(A)), 1e-3)[:, None]  # modes of like size
    return A, B, C, ", ".join(told)


def _inputs(rng: np.random.Generator, kind: str, n: int, width: int, A: Array) -> Array:
    poles = np.abs(np.log(np.linalg.eigvals(A).astype(complex)))
    fast, slow = min(float(poles.max()), 1.2), float(poles.min())
    if kind == "steps":
        hold = max(int(0.7 / fast), 1)
        lasts = rng.integers(hold, max(int(1.5 / slow), hold + 2), size=n)
        found = [np.repeat(rng.uniform(-1, 1, size=n), rng.permutation(lasts))[:n] for _ in range(width)]
        return np.column_stack(found)
    if kind == "multisine":
        w = np.geomspace(max(slow / 3, 4 * np.pi / n), min(1.5 * fast, 1.3), 12)
        return np.column_stack([
            np.sum([np.sin(one * np.arange(n) + rng.uniform(0, 6.3)) for one in w], axis=0) for _ in range(width)
        ])  # fmt: skip
    b, a = signal.butter(2, min(fast / np.pi, 0.9))
    return np.asarray(signal.lfilter(b, a, rng.normal(size=(n, width)), axis=0))


def _run(A: Array, B: Array, C: Array, u: Array) -> Array:
    x, y = np.zeros(len(A)), np.zeros((len(u), len(C)))
    for t, now in enumerate(u):
        y[t] = C @ x
        x = A @ x + B @ now
    return y


def bound(one: Draw) -> tuple[float, float]:
    """The least mean squared error of a run of the true order, refined from the truth, and its fit; of one output."""
    b, a = signal.ss2tf(one.A, one.B, one.C, np.zeros((1, 1)))
    n, u, y = len(one.A), one.u[:, 0], one.y[:, 0]

    def errors(p: Array) -> Array:
        with np.errstate(all="ignore"):
            left = signal.lfilter(np.append(0.0, p[:n]), np.append(1.0, p[n:]), u) - y
        return np.clip(np.nan_to_num(left, nan=1e6), -1e6, 1e6)

    p = np.concatenate([b[0, 1:], a[1:]])
    end = least_squares(errors, p, x_scale="jac", max_nfev=60)
    new = signal.lfilter(np.append(0.0, end.x[:n]), np.append(1.0, end.x[n:]), one.new_u[:, 0])
    return 2.0 * float(end.cost) / len(y), float(_fit(new[:, None], one.new_y))


def _fit(run: Array, truth: Array) -> float:
    """Fit in per cent, the level left out: that at rest is no matter of the dynamics."""
    left = run - truth
    left = left - left[len(left) // 10 :].mean(axis=0)
    size = np.linalg.norm(truth - truth.mean(axis=0), axis=0)
    return float(100.0 * (1.0 - np.linalg.norm(left, axis=0) / size).mean())


def structures(one: Draw) -> dict[str, Any]:
    """Each structure, of the true order."""
    n, width = len(one.A), len(one.C)
    state = sysid.LinearStateSpace if width == 1 else sysid.VectorStateSpace
    each, d = (n,) * width, n if one.noise == "armax" else 1
    return {
        "OE": sysid.OE(nb=each, nf=each, nk=(1,) * width),
        "TF": sysid.TransferFunction(poles=each, zeros=(n - 1,) * width, domain="continuous"),
        "SS": state(states=n, noise=False),
        "SS, noise": state(states=n),
        "ARMAX": sysid.ARMAX(na=n, nb=each, nc=n, nk=(1,) * width),
        "BJ": sysid.BJ(nb=each, nc=d, nd=d, nf=each, nk=(1,) * width),
    }


@dataclass(frozen=True, kw_only=True)
class Row:
    """How one fit did: its fit in per cent on the new record, that from the truth, its errors' power over the least."""

    kind: str
    fit: float
    bound: float
    power: float
    converged: bool
    warned: bool
    seconds: float


def rows_of(one: Draw, only: str = "") -> list[Row]:
    """All fits of a plant."""
    traces = sysid.data((one.u, one.y), sample_time=1.0)
    width, found = one.u.shape[1], []
    ins, outs = ("u", "y") if width == 1 else ("u1+u2", "y1+y2")
    least, reached = bound(one) if width == 1 else (np.nan, -np.inf)
    for kind, structure in structures(one).items():
        if only and kind not in only.split("+"):
            continue
        began = process_time()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            fit = sysid.fit(traces, f"{ins} -> {outs}", structure, stability=sysid.StabilityOptions(count=0))
            parts = list(fit.fits.values()) if isinstance(fit, SystemFit) else [fit]
            try:
                own = np.asarray(fit.simulate(one.new_u)).reshape(one.new_y.shape)
            except Exception:  # noqa: BLE001 - a run that cannot be made is as bad as can be
                own = np.full(one.new_y.shape, np.inf)
        score = _fit(own, one.new_y)
        power = np.nan
        if width == 1 and (kind in FREE or one.noise != "drift"):
            free = kind in FREE
            reference = least if free else float(np.mean(one.innovations**2))
            power = float(fit.history["mse"][-1]) / reference
        found.append(
            Row(
                kind=kind,
                fit=score,
                bound=reached if kind in FREE else -np.inf,
                power=power,
                converged=all(p.status.name == "CONVERGED" for p in parts),
                warned=any(bool(p.warnings) for p in parts),
                seconds=process_time() - began,
            )
        )
    return found


def main() -> None:
    """Fit all, print a line for each that is counted, and the counts."""
    asked = argparse.ArgumentParser()
    asked.add_argument("--plants", type=int, default=120)
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--only", default="")
    asked.add_argument("--list", action="store_true")
    given = asked.parse_args()
    counts, fits, warned, seconds = Counter[str](), Counter[str](), Counter[str](), Counter[str]()
    for seed in range(given.first, given.first + given.plants):
        one = draw(seed)
        rows = rows_of(one, given.only)
        for row in rows:
            best = max([row.bound, *(other.fit for other in rows if (other.kind in FREE) == (row.kind in FREE))])
            fits[row.kind] += 1
            warned[row.kind] += row.warned
            seconds[row.kind] += row.seconds
            bad = not row.fit >= best - POINTS or row.power > POWER
            told = not row.converged or row.warned
            counts[row.kind] += bad and not told
            if bad or given.list:
                mark = "" if not bad else "told  " if told else "SILENT"
                print(
                    f"{seed:4d} {row.kind:<10} {mark:<6} fit {row.fit:6.1f} of {best:5.1f}  power {row.power:8.3f}  "
                    f"{row.seconds:5.1f} s  {one.words}",
                    flush=True,
                )
    print(f"\n{'structure':<12}{'fits':>6}{'counted':>9}{'warned':>8}{'seconds':>9}")
    for kind in fits:
        print(f"{kind:<12}{fits[kind]:>6}{counts[kind]:>9}{warned[kind]:>8}{seconds[kind]:>9.0f}")
    print(f"{'all':<12}{sum(fits.values()):>6}{sum(counts.values()):>9}{sum(warned.values()):>8}")


if __name__ == "__main__":
    main()
