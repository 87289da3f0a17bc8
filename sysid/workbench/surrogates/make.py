"""The way from a pipeline of kind ``experiment`` to a surrogate that is proven; what is done is not done again."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path

from sysid.export.reading import read_bundle
from sysid.reporting.results import read_results
from sysid.workbench.experiments.run import Experiments
from sysid.workbench.runner.events import Watcher
from sysid.workbench.surrogates.limits import limits
from sysid.workbench.surrogates.proof import Proof
from sysid.workbench.surrogates.told import poor, short_of_time
from sysid.workbench.surrogates.work import TIMES, Perform, Proving, Work, first_look


@dataclass(frozen=True, kw_only=True, eq=False)
class Made:
    """A surrogate.

    Args:
        bundle: Its folder.
        fmu: The drop-in FMU; ``None`` where it was not exported.
        report: The page.
        proof: How it does on new experiments.
        notes: What a reader has to know.
        pipeline: What was run, as a file; of a reference the one that was proposed.
        proposed: What of it was taken from where.
    """

    bundle: Path
    fmu: Path | None
    report: Path
    proof: Proof
    notes: Sequence[str]
    pipeline: Path
    proposed: Sequence[str] = ()


def make_surrogate(
    pipeline: Path,
    folder: Path,
    *,
    perform: Perform,
    minutes: float,
    proof: int | None = None,
    iterations: int | None = None,
    rounds: int | None = None,
    workers: int | None = None,
    seed: int = 0,
    began: float | None = None,
    say: Callable[[str], None] = lambda _: None,
    watch: Watcher = lambda _: None,
) -> Made:
    """Run experiments, find a model of them, or fit the given ones, export it with the reference's ports, and prove it.

    Args:
        pipeline: YAML of kind ``experiment``. **What it names is run.**
        folder: Where everything is kept; a run that was killed goes on there.
        perform: Carries a program out.
        minutes: Time for all.
        proof: New experiments; 1,000 by default, or as many as there is time for.
        iterations: In place of the search's time: the same result on every machine.
        rounds: Rounds of added experiments, in place of those of the pipeline.
        workers: Processes, in place of those of the pipeline.
        seed: Of the search.
        began: When the time began, by ``time.monotonic``; now by default.
        say: Told what makes a surrogate wrong.
        watch: Told how the proof goes.

    Returns:
        The surrogate.

    Raises:
        UserError: If the pipeline or its reference cannot be used.
    """
    began = time.monotonic() if began is None else began
    work = Work.of(
        pipeline, folder, perform=perform, minutes=minutes, iterations=iterations, rounds=rounds, workers=workers,
        seed=seed, say=say,
    )  # fmt: skip
    first = first_look(Experiments(config=work.config, reference=work.reference), minutes=minutes)
    if first is not None:
        say(first)
    found = work.experimented()
    notes = work.noted(found)
    plan, planned, count = work.planned(found, minutes=minutes, spent=time.monotonic() - began, proof=proof)
    if not iterations and not (folder / TIMES).is_file():
        say(plan.sentence(planned, count))
    seconds_left = work.seconds_left(plan)
    proving = Proving(
        reference=work.reference, design=work.config.experiment, taught=found.traces, count=count,
        workers=work.config.workers, ends=inf if proof or iterations else began + plan.whole, whole_s=60.0 * minutes,
        watch=watch,
    )  # fmt: skip
    place, said, searched = work.modelled(found, seconds_left / 60.0, proving, whole=minutes)
    shown = proving.done.get(place) or proving(place)
    page, fmu = work.page(place), work.delivered(place)
    bundle = read_bundle(place / "bundle")
    notes += [*said, *work.learnt(bundle, found, shown), *poor(shown, minutes, searched.needs_s if searched else 0.0)]
    notes += limits(read_results(place), shown, searched=searched, iterations=iterations)
    notes += short_of_time(shown, plan, count, took=0.0 if iterations else time.monotonic() - began)
    return Made(bundle=bundle.folder, fmu=fmu, report=page, proof=shown, notes=notes, pipeline=pipeline)
