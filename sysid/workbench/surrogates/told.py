"""What is told of a surrogate beside its proof: what it has not seen, how it begins, what helps, what was left out."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from sysid.bounded_text import read_bounded
from sysid.export.bundle import Bundle
from sysid.models import Mapping
from sysid.references.told import reasons_of
from sysid.traces import Role, Trace
from sysid.workbench.auto.finish import slowness, span
from sysid.workbench.auto.look import MOVED, in_motion, span_of
from sysid.workbench.experiments.run import UNLIKE, Experimented
from sysid.workbench.surrogates.plan import PROOF, Times
from sysid.workbench.surrogates.proof import Proof

OVERRUN = 0.05
"""Share of the time by which it is exceeded without a word."""
IDLE, LOOKED = 1e-3, 4
"""Share of an output's range below which nothing moves it, and runs on which that is looked at."""
GOOD = 0.9
"""Share of the proof's experiments within the tolerance below which a surrogate is said to be poor."""


def without_effect(bundle: Bundle, traces: Sequence[Trace], shown: Proof) -> list[str]:
    """Inputs and parameters that move no output, as the surrogate has learnt it.

    Args:
        bundle: The surrogate.
        traces: Runs of the reference.
        shown: How it does on new experiments: what a poor one has not learnt may move the reference all the same.

    Returns:
        A sentence for each that may stand still in every run without an output going elsewhere; of one input, none.
    """
    if shown.share < GOOD:
        return []
    names = [str(entry["name"]) for entry in bundle.inputs]
    outputs = [str(entry["name"]) for entry in bundle.outputs]
    spans = np.array([span_of(traces, name) or 1.0 for name in outputs])
    moved = dict.fromkeys(names, 0.0)
    for trace in traces[:LOOKED] if len(names) > 1 else ():
        given = {name: trace[name] for name in names}
        before = np.asarray(bundle.simulate(given, warn=False)).reshape(len(trace), -1)
        for name in names:
            middle = np.full(len(trace), np.mean([(one[name].min() + one[name].max()) / 2.0 for one in traces]))
            found = np.asarray(bundle.simulate({**given, name: middle}, warn=False)).reshape(len(trace), -1)
            moved[name] = max(moved[name], float(np.nan_to_num(np.abs(found - before) / spans, nan=np.inf).max()))
    return [
        f"{name} moves no output by more than {100.0 * by:.2g} % of its range, as far as the surrogate has learnt: "
        f"leave it out, or let it go farther"
        for name, by in moved.items()
        if len(names) > 1 and by < IDLE
    ]


def unlike(folder: Path) -> list[str]:
    """That the reference did not repeat itself when its experiments were run.

    Args:
        folder: Of the experiments.

    Returns:
        What was said then, or nothing.
    """
    with suppress(OSError):
        return [read_bounded(folder / UNLIKE).decode(errors="replace").strip()]
    return []


def elsewhere(shown: Proof, begun: Dict[str, float]) -> list[str]:
    """That a surrogate is poor where its inputs begin at others than in its experiments; nothing of one that is not.

    Args:
        shown: How it does on new experiments.
        begun: What the inputs begin at in these.

    Returns:
        A sentence, or none.
    """
    chance = 2.0 * (shown.share * (1.0 - shown.share) / max(shown.n_elsewhere, 1)) ** 0.5
    if not shown.share_elsewhere < min(GOOD, shown.share - chance):
        return []
    at = ", ".join(f"{name} {value:.6g}" for name, value in begun.items())
    return [
        f"begun at other inputs than {at} only {100.0 * shown.share_elsewhere:.0f} % of {shown.n_elsewhere} "
        f"new experiments are within {100.0 * shown.tolerance:g} %: begin its runs there, or say settling, which lets "
        "every experiment begin at rest"
    ]


def poor(shown: Proof, minutes: float, needs_s: float = 0.0) -> list[str]:
    """That a surrogate is not good enough, and what helps; nothing of one that is.

    Args:
        shown: How it does on new experiments.
        minutes: Time that was asked for.
        needs_s: Seconds that a search takes at least, where there was no time for one.

    Returns:
        A sentence, or none.
    """
    if shown.share >= GOOD:
        return []
    more = max(2.0 * minutes, np.ceil(needs_s / 60.0))
    worst = int(np.argmax(np.median(np.nan_to_num(shown.errors, nan=np.inf, posinf=np.inf), axis=0)))
    median = float(np.median(shown.errors[:, worst]))
    how = f"{100.0 * median:.2g} % of its range off in half of them" if np.isfinite(median) else "without bound in half"
    return [
        f"this surrogate is poor: {100.0 * shown.share:.0f} % of the new experiments are within "
        f"{100.0 * shown.tolerance:g} %, and {shown.outputs[worst]} is {how}. What helps: more time (--minutes "
        f"{more:g} or more: more experiments, and more structures are tried), experiments where it is worst "
        "(--rounds 4), narrower ranges, or equations where you know them (docs/how/events.md)"
    ]


def short_of_time(shown: Proof, plan: Times, count: int, *, took: float) -> list[str]:
    """What was left out for want of time, and how much longer it took than that and a proof that was asked for."""
    notes, run = [], len(shown.errors) + shown.failed
    if run < PROOF:
        why = f", not of {count:,}, as the time was up" if run < count else ""
        notes.append(f"the proof is of {run} experiments{why}; --proof 1000 makes it of 1,000")
    if took > (1.0 + OVERRUN) * plan.asked:
        notes.append(
            f"it took {span(took)}, {span(took - plan.asked)} more than was asked for: experiments, a few fits, export "
            f"and report come to that here, where a second of work takes {slowness():.2g} s"
        )
    return notes


def failed(found: Experimented) -> list[str]:
    """That some experiments gave no record, and why: the surrogate has seen nothing of what they would have shown."""
    of = sum(map(len, found.outcomes.values()))
    if not found.failed:
        return []
    return [
        f"{len(found.failed)} of {of} experiments gave no record, so that nothing was learnt there: "
        f"{reasons_of(found.failed)}"
    ]


def restless(found: Experimented, mapping: Mapping) -> list[str]:
    """What of a reference does not begin at rest, in words.

    Args:
        found: The experiments.
        mapping: What moves, and what answers.

    Returns:
        A sentence for each output that moves before any input does, or begins elsewhere from run to run.
    """
    traces = found.traces.with_role(Role.ESTIMATION)
    moving = in_motion(traces, mapping)
    uneven = {name: by for name, by in found.spread.items() if by > MOVED * span_of(traces, name)}
    told = [f"{name} moves by up to {by:.3g} while the inputs stand still" for name, by in moving.items()]
    told += [f"{name} begins at values up to {by:.3g} apart" for name, by in uneven.items()]
    return [
        f"{one}: the reference does not begin at rest, and where it begins is learnt with the model" for one in told
    ]


def beginning_of(bundle: Bundle, traces: Sequence[Trace]) -> list[str]:
    """How near a surrogate begins to where its reference does, on runs that were not fitted.

    Args:
        bundle: The surrogate.
        traces: Those runs.

    Returns:
        A sentence for each output; none without runs.
    """
    names = [str(entry["name"]) for entry in bundle.outputs]
    inputs = [str(entry["name"]) for entry in bundle.inputs]
    off = [
        np.abs(
            np.asarray(bundle.simulate({name: trace[name][:2] for name in inputs}, warn=False)).reshape(2, -1)
            - measured
        )[0]
        for trace in traces
        for measured in [trace.columns(names)[:2]]
    ]
    worst = dict(zip(names, np.max(off, axis=0, initial=0.0), strict=True)) if off else {}
    shares = {name: 100.0 * float(by) / (span_of(traces, name) or 1.0) for name, by in worst.items()}
    return [
        f"at its first sample {name} is at most {share:.2g} % of its range off on {len(off)} runs that were not fitted"
        + ("; give settling, a start at which it is at rest, or more experiments" if share > 100.0 * MOVED else "")
        for name, share in shares.items()
    ]
