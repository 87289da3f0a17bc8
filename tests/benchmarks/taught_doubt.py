"""Can a surrogate's doubt be taught? A classifier of its own errors, taught on kinds of command, asked about others.

    python -m tests.benchmarks taught_doubt
    python -m tests.benchmarks taught_doubt --count=20 --fresh=30000

The whole is ``service-cascade-wide``. On commands of the four kinds that train it, from seeds of their own
(``--teach=40`` of each, 1,000 s), its error at every sample is known, and what says whether that is over 1 psi is
taught: from what the whole computes, its averages and sums over up to 300 s, how long ago and from where its valve
switched, how near the relay is to switching, and how far its cylinder is from that of ``service-cascade-held`` and
from its own where the relay reads the pipe 0.1 and 0.3 psi off. Judges are that distance alone (the committee of the
benchmark ``doubt``), a network of 12 neurons (its weights drawn by ``--seed=``), boosted trees (scikit-learn), and the
committee or the trees, whichever is surer.

* Of each taught kind in turn what a judge finds that was taught on the other three: share of the wrong samples that are
  flagged where 5 % of the others are.
* Then on ``abdx-kinds-unseen`` (``--count=`` sequences of each kind from number ``--first=`` on, or of other seeds with
  ``--fresh=``), with the threshold that flags 5 % of the right samples of ``abdx-kinds-calibration``.
* The limit: the trees taught on half of the sequences of the unseen kinds as well, asked about the other half.
"""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numba
import numpy as np
import torch
from numpy.typing import NDArray
from scipy.signal import lfilter
from sklearn.ensemble import HistGradientBoostingClassifier

from sysid.composite import perturbed
from sysid.export import read_bundle
from sysid.ingest.datasets.dataset import find_dataset
from sysid.models import Cascade
from sysid.traces import Trace
from tests.benchmarks.doubt import CALIBRATION, OUTPUT, REPORTS, UNSEEN, fresh, option, sequences

Array = NDArray[np.float64]
Judge = Callable[[Array], Array]
ERROR, FALSE = 1.0, 0.05
AVERAGES = (2.0, 10.0, 30.0, 100.0, 300.0)  # s
STRIDE = 20  # samples: errors last
HOLDS = ((20, 60), (30, 120), (60, 180), (80, 160), (100, 190), (210, 400), (250, 600), (400, 1200))
NOISE = ((0.004, 2), (0.008, 2), (0.015, 3), (0.02, 3), (0.03, 1.2), (0.05, 1.2))
BANDS = (0.01, 0.015, 0.02, 0.03, 0.05)


def taught(count: int) -> dict[str, list[Trace]]:
    """Commands of the kinds of ``abdx-kinds-pool``, by kind."""
    recipes: dict[str, list[str]] = {"levels": [], "noise": [], "multisine": [], "random": []}
    for k in range(count):
        (hold, longest), (band, peak), upper = HOLDS[k % 8], NOISE[k % 6], BANDS[k % 5]
        drawn = "excitation: {{kind: {}, seed: {}, duration: 1000, options: {{{}}}}}".format
        recipes["levels"].append(drawn("aprbs", 2_100_000 + k, f"hold: {hold}, longest: {longest}"))
        recipes["noise"].append(drawn("noise", 2_101_000 + k, f"band: [0.0, {band}], peak: {peak}"))
        recipes["multisine"].append(drawn("multisine", 2_102_000 + k, f"band: [0.002, {upper}]"))
        recharge = ", recharge: [20, 200]" if k % 2 else ""
        recipes["random"].append(f"random: {{seed: {2_103_000 + k}, duration: 1000{recharge}}}")
    text = find_dataset("abdx-kinds-calibration").read_text(encoding="utf-8").partition("cases:")[0] + "cases:\n"
    for kind, rows in recipes.items():
        text += "".join(f"  {kind}-{k:03}: {{role: estimation, recipe: {{{row}}}}}\n" for k, row in enumerate(rows))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "dataset.yaml").write_text(text, encoding="utf-8")
        return sequences(folder, tuple(recipes), 0, count)


@numba.njit(cache=True)
def summed(values: Array, back: Array, most: float) -> Array:
    """A sum that begins anew wherever ``back`` is set."""
    out, total = np.empty_like(values), 0.0
    for k in range(len(values)):
        total = 0.0 if back[k] > 0.5 else min(total + values[k], most)
        out[k] = total
    return out


@numba.njit(cache=True)
def kept(values: Array, taken: Array) -> Array:
    """The value where ``taken`` was last set."""
    out, last = np.empty_like(values), values[0]
    for k in range(len(values)):
        last = values[k] if taken[k] > 0.5 else last
        out[k] = last
    return out


@numba.njit(cache=True)
def peak(values: Array, factor: float) -> Array:
    """The largest so far, forgotten by a factor a sample."""
    out, largest = np.empty_like(values), 0.0
    for k in range(len(values)):
        largest = max(values[k], factor * largest)
        out[k] = largest
    return out


def leaky(values: Array, seconds: float) -> Array:
    """Leaky average."""
    a = np.exp(-0.1 / seconds)
    return np.asarray(lfilter([1.0 - a], [1.0, -a], values, zi=[a * values[0]])[0])


def features(handle: Array, run: dict[str, Array], moved: Sequence[Array]) -> Array:
    """What a judge sees, shape ``(samples, features)``; the first is the committee's distance.

    Args:
        handle: The command, in psi.
        run: What the whole computes.
        moved: Its cylinder as ``service-cascade-held`` has it, and with its relay's pipe 0.1 and 0.3 psi up and down.
    """
    bp, ar, er, bc, rl, bp10, ar10 = (run[name] for name in ("BP", "AR", "ER", OUTPUT, "RL", "BP10", "AR10"))
    steps, pipe = (np.diff(one, prepend=one[0]) for one in (handle, bp))
    apart = [np.abs(one - bc) for one in moved]
    logs = [np.log1p(3.0 * one) for one in apart]
    found = [*logs, np.maximum(logs[1], logs[2]), np.maximum(logs[3], logs[4])]
    found += [np.log1p(3.0 * peak(one, np.exp(-0.1 / 30.0))) for one in apart]
    found += [np.log1p(3.0 * peak(apart[0], np.exp(-0.1 / 100.0))), np.log1p(3.0 * leaky(apart[0], 100.0))]
    found += [handle, bp, ar, bc, rl, run["RL10"], ar - bp, bp - bp10, handle - bp, ar - ar10, er - ar, bp10 - ar10]
    found += [run["EQ"] - bp, er - bp, run["ER10"] - er]
    for seconds in AVERAGES:
        found += [leaky(one, seconds) - one for one in (handle, bp, bc, ar, bp10)]
        found += [leaky(rl, seconds), leaky(run["RL10"], seconds)]
        found += [seconds * leaky(np.abs(one), seconds) for one in (steps, pipe)]
    clock = np.full_like(handle, 0.1)
    found += [np.log1p(summed(clock, rl, 1000.0)), np.log1p(summed(clock, 1.0 - rl, 1000.0))]
    found += [summed(np.abs(one), rl, 200.0) for one in (steps, pipe)]
    found += [summed(np.maximum(pipe, 0.0), 1.0 - rl, 200.0)]
    found += [kept(bp, rl) - bp, kept(ar, rl) - ar, kept(ar, 1.0 - rl) - ar, kept(bc, 1.0 - rl) - bc]
    near = np.maximum(0.0, 0.4 - np.minimum(np.abs(bp - ar - 1.45), np.abs(bp - ar + 0.985)))
    found += [near, summed(0.1 * near, rl, 100.0), peak(near, np.exp(-0.1 / 30.0)), peak(near, np.exp(-0.1 / 100.0))]
    return np.column_stack(found)


class Samples:
    """Of sequences every ``STRIDE``-th sample: what a judge sees, the error, its kind and its sequence."""

    def __init__(self, by_kind: dict[str, list[Trace]], whole: Cascade, others: Sequence[Cascade]) -> None:
        seen, errors, kinds, numbers = [], [], [], []
        for kind, traces in by_kind.items():
            for number, trace in enumerate(traces):
                run = whole.simulate_trace(trace)
                moved = [other.simulate_trace(trace)[OUTPUT] for other in others]
                at = slice(STRIDE - 1, None, STRIDE)
                seen.append(features(trace["STP"], run, moved)[at])
                errors.append(np.abs(run[OUTPUT] - trace[OUTPUT])[at])
                kinds += [kind] * len(errors[-1])
                numbers += [number] * len(errors[-1])
        self.seen, self.errors = np.concatenate(seen), np.concatenate(errors)
        self.kinds, self.numbers = np.array(kinds), np.array(numbers)
        self.wrong = self.errors > ERROR


def trees(seen: Array, wrong: NDArray[np.bool_]) -> Judge:
    """Boosted trees."""
    found = HistGradientBoostingClassifier(
        max_iter=120, max_leaf_nodes=15, min_samples_leaf=100, l2_regularization=1.0, random_state=0
    )
    return found.fit(seen, wrong).decision_function


def network(seen: Array, wrong: NDArray[np.bool_]) -> Judge:
    """A network of 12 neurons beside a linear part; its output is the logarithm of the odds."""
    middle, spread = seen.mean(axis=0), seen.std(axis=0) + 1e-9
    draw = torch.Generator().manual_seed(int(option("seed", 0)))

    def scaled(values: Array) -> torch.Tensor:
        return torch.tensor(np.clip((values - middle) / spread, -6.0, 6.0), dtype=torch.float32)

    x, t, n = scaled(seen), torch.tensor(wrong, dtype=torch.float32), seen.shape[1]
    first = torch.cat([torch.randn(n, 12, generator=draw) / n**0.5, 0.5 * torch.randn(1, 12, generator=draw)])
    theta = [first, 0.1 * torch.randn(12, generator=draw), torch.zeros(n), torch.tensor(-3.0)]
    for part in theta:
        part.requires_grad_()

    def odds(z: torch.Tensor) -> torch.Tensor:
        return torch.tanh(z @ theta[0][:-1] + theta[0][-1]) @ theta[1] + z @ theta[2] + theta[3]

    optimiser = torch.optim.Adam(theta, lr=0.02)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, 500)
    for _ in range(500):
        batch = torch.randint(len(x), (8192,), generator=draw)
        loss = torch.nn.functional.binary_cross_entropy_with_logits(odds(x[batch]), t[batch])
        loss = loss + 1e-3 * sum(part.square().sum() for part in (theta[0], theta[1], 12.0**0.5 * theta[2])) / 12.0
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
    return lambda values: odds(scaled(values)).detach().numpy().astype(np.float64)


def committee_alone(seen: Array, wrong: NDArray[np.bool_]) -> Judge:
    """How far apart the two wholes are; nothing is taught."""
    return lambda values: values[:, 0]


def surest(judges: Sequence[Judge], right: Array) -> Judge:
    """The surest of several: each by the share of right samples that it holds for less doubtful."""
    order = [np.sort(judge(right)) for judge in judges]

    def judge(values: Array) -> Array:
        above = [
            1.0 - np.searchsorted(one, by(values), side="right") / len(one)
            for one, by in zip(order, judges, strict=True)
        ]
        return -np.log10(np.maximum(np.min(above, axis=0), 0.3 / len(right)))

    return judge


def flagged(doubt: Array, wrong: NDArray[np.bool_]) -> float:
    """Share of the wrong that are flagged where 5 % of the others are, in %."""
    return 100.0 * float(np.mean(doubt[wrong] > np.quantile(doubt[~wrong], 1.0 - FALSE))) if wrong.any() else np.nan


def main(known: Samples, kept_back: Samples, unseen: Samples) -> None:
    """Print what each judge finds."""
    right = kept_back.seen[~kept_back.wrong]
    teachers = {"committee": committee_alone, "network": network, "trees": trees}
    kinds = tuple(dict.fromkeys(known.kinds))
    print("a taught kind left out in turn, wrong samples flagged where 5 % of the others are, %:", *kinds)
    for name, teach in teachers.items():
        out = [known.kinds == kind for kind in kinds]
        found = [flagged(teach(known.seen[~te], known.wrong[~te])(known.seen[te]), known.wrong[te]) for te in out]
        print(f"  {name:<24}", *(f"{one:5.0f}" for one in found))
    judges = {name: teach(known.seen, known.wrong) for name, teach in teachers.items()}
    judges["committee or trees"] = surest([judges["committee"], judges["trees"]], right)
    by_kind = {kind: unseen.kinds == kind for kind in dict.fromkeys(unseen.kinds)}
    shares = ", ".join(f"{kind} {100 * unseen.wrong[there].mean():.1f}" for kind, there in by_kind.items())
    print(f"unseen, wrong {100 * unseen.wrong.mean():.1f} % ({shares}); wrong / others flagged, by kind, and at 5 %:")
    ends = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, np.inf)
    sizes = [(unseen.errors >= low) & (unseen.errors < high) for low, high in itertools.pairwise(ends)]
    print("  by error from 0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 2 psi on:", *(f"{100 * one.mean():.2f}" for one in sizes))
    for name, judge in judges.items():
        doubted = judge(unseen.seen)
        flag = doubted > np.quantile(judge(right), 1.0 - FALSE)
        rows = {"all": np.ones(len(flag), dtype=bool), **by_kind}
        told = [
            f"{kind} {100 * flag[there & unseen.wrong].mean() if (there & unseen.wrong).any() else np.nan:.0f}"
            f"/{100 * flag[there & ~unseen.wrong].mean():.1f}"
            for kind, there in rows.items()
        ]
        print(f"  {name:<24}", *told, f"at 5 %: {flagged(doubted, unseen.wrong):.0f}")
        told = [f"{100 * flag[one].mean() if one.any() else np.nan:.0f}" for one in sizes]
        print("    of these flagged:", *told)
    even = unseen.numbers % 2 == 0
    for half in (even, ~even):
        judge = trees(np.concatenate([known.seen, unseen.seen[half]]), np.append(known.wrong, unseen.wrong[half]))
        found = flagged(judge(unseen.seen[~half]), unseen.wrong[~half])
        print(f"taught on half of their sequences too, asked about the other half, at 5 %: {found:.0f}")


if __name__ == "__main__":
    torch.set_num_threads(1)
    number, begins = int(option("count", 10)), int(option("fresh", 0))
    wide, held = (read_bundle(REPORTS / f"service-cascade-{name}" / "bundle").model for name in ("wide", "held"))
    besides = [held, *(perturbed(wide, "BP", by, readers=["RL"]) for by in (0.1, -0.1, 0.3, -0.3))]
    asked = (
        fresh("abdx-kinds-unseen", number, begins)
        if begins
        else sequences("abdx-kinds-unseen", UNSEEN, int(option("first", 0)), number)
    )
    calibration = sequences("abdx-kinds-calibration", CALIBRATION, 0, 20)
    main(*(Samples(one, wide, besides) for one in (taught(int(option("teach", 40))), calibration, asked)))
