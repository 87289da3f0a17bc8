"""The parts of the way to a surrogate: experiments, a model of them, its page, its FMU, its proof."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from sysid.atomic import replacing, write_bytes
from sysid.bounded_text import read_bounded
from sysid.errors import ConfigError
from sysid.export.bundle import Bundle
from sysid.export.reading import read_bundle
from sysid.field_checks import check
from sysid.models import Mapping, Start
from sysid.references.config import ReferenceConfig
from sysid.references.design import Design
from sysid.references.runs import ReferenceRuns
from sysid.reporting.growth import FILE
from sysid.reporting.judging.results import FOLDER
from sysid.reporting.records import write_record
from sysid.reporting.report import write_report
from sysid.traces import Role, Trace, TraceSet
from sysid.workbench.auto.config import AutoConfig
from sysid.workbench.auto.finish import drawn_in, finish_s, page_s, slowness, span
from sysid.workbench.auto.jumps import jumps_told
from sysid.workbench.auto.look import resets_of, span_of
from sysid.workbench.auto.mechanisms import mechanism_of
from sysid.workbench.auto.run import Searched, auto_of
from sysid.workbench.auto.run import program_of as search_program
from sysid.workbench.experiments.config import ExperimentConfig, GrowConfig
from sysid.workbench.experiments.run import DATASET, Experimented, Experiments
from sysid.workbench.experiments.run import program_of as experiment_program
from sysid.workbench.fits.config import PipelineConfig
from sysid.workbench.fits.data import data_of
from sysid.workbench.runner.events import StepDone, StepProgress, StepStarted, Watcher
from sysid.workbench.runner.program import Program
from sysid.workbench.surrogates.beginning import stood_at
from sysid.workbench.surrogates.grown import GROWN, Ground, grow
from sysid.workbench.surrogates.grown import program_of as grown_program
from sysid.workbench.surrogates.known import pipeline_of
from sysid.workbench.surrogates.known import program_of as known_program
from sysid.workbench.surrogates.plan import PROOF, RUNNING, SEARCHING, WARMED, Times, times
from sysid.workbench.surrogates.proof import FEWEST, Proof, fmu_of, prove
from sysid.workbench.surrogates.told import beginning_of, elsewhere, failed, restless, unlike, without_effect
from sysid.workbench.written import Written
from sysid.yaml_files import read_yaml

Perform = Callable[[Program[Any], Path], Any]
"""Carries a program out in a folder, and gives its results."""
RUNS_MOST = 1.0 - SEARCHING
"""Share of the time beyond which it is told before, how long the experiments take."""
GROWING = 0.25
"""Share of the time in which data grow, where they do; it is taken from the search's."""
TIMES = "search-seconds.txt"
"""The search's time: decided once, so that a run that was killed finds its trials again."""
LEAST_MINUTES = 0.1
"""Of a surrogate."""
TOLERANCE = 0.01
"""Share of an output's range: what a proof counts, and what models are chosen by."""
PROVING = "Proving it on new experiments"
"""The step of the proof, for people."""
EXPORT: dict[str, Any] = {"formats": ("c", "fmi2", "fmi3")}
"""What leaves the workbench as a surrogate."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Work:
    """The parts of a surrogate that are programs, each kept in a folder of its own."""

    pipeline: Path
    config: ExperimentConfig
    reference: ReferenceConfig
    mapping: Mapping
    folder: Path
    perform: Perform
    seed: int
    iterations: int | None
    growth: GrowConfig | None
    say: Callable[[str], None]

    @classmethod
    def of(
        cls, pipeline: Path, folder: Path, *, perform: Perform, minutes: float, iterations: int | None,
        rounds: int | None, workers: int | None, seed: int, say: Callable[[str], None],
    ) -> Work:  # fmt: skip
        """What a pipeline asks for; what does not go together is refused before anything is run."""
        if not LEAST_MINUTES <= minutes < inf:
            raise ConfigError(
                "there is no such time, or nothing can be done in it", where="minutes",
                expected=f"{LEAST_MINUTES:g} or more, and an end of them", got=minutes,
                remedy="give some minutes: 5 for a fast model, 60 for a slow one",
            )  # fmt: skip
        config = check(ExperimentConfig, read_yaml(pipeline), where=pipeline)
        config = config if workers is None else config.model_copy(update={"workers": workers})
        growth = config.grow if rounds is None else (config.grow or GrowConfig()).model_copy(update={"rounds": rounds})
        reference = config.reference.at(pipeline.resolve().parent)
        mapping = Mapping(inputs=(*reference.inputs, *reference.parameters), outputs=tuple(reference.outputs))
        work = cls(
            pipeline=pipeline, config=config, reference=reference, mapping=mapping, folder=folder, perform=perform,
            seed=seed, iterations=iterations, growth=growth, say=say,
        )  # fmt: skip
        if config.fits:
            work.known(Path(DATASET), None, None)
            if rounds is not None:
                raise ConfigError(
                    "experiments grow around what a search has chosen", where=pipeline, expected="rounds, or fits",
                    got="both", remedy="leave rounds out, or the fits of the pipeline",
                )  # fmt: skip
        return work

    @property
    def place(self) -> Path:
        """Of the experiments."""
        return self.folder / "experiment"

    def experimented(self) -> Experimented:
        """The experiments."""
        asked = replace(Written.read(ExperimentConfig, self.pipeline), config=self.config)
        found: Experimented = self.perform(experiment_program(asked), self.place)
        return found

    def noted(self, found: Experimented) -> list[str]:
        """What of the experiments makes a surrogate wrong, said before an hour is spent."""
        fitted = found.traces.with_role(Role.ESTIMATION)
        _check_moving(fitted, self.reference)
        # What a search has to learn; of fits that are asked for somebody knows it.
        learnt = [] if self.config.fits else [*restless(found, self.mapping), *self._jumps(fitted)]
        notes = [*failed(found), *unlike(self.place), *learnt]
        for note in notes:
            self.say(f"note: {note}")
        return notes

    def planned(
        self, found: Experimented, *, minutes: float, spent: float, proof: int | None
    ) -> tuple[Times, int, int]:
        """How the time is spent, of how many experiments the proof is for certain, and if it has time of how many."""
        whole = None if self.iterations else 60.0 * minutes
        workers, slowed = self.config.workers, slowness()
        finish = finish_s(len(found.traces), len(self.mapping.outputs), whole, slowed=slowed)
        with ReferenceRuns(config=self.reference) as runs:
            each = runs.seconds_each()[0]
        each = self.reference.time_limit if each is None else max(each, 1e-3)
        # What is short of time is not the search first: a proof of fewer experiments says the same, less sharply.
        left = (1.0 - SEARCHING) * 60.0 * minutes - spent - finish
        planned, most = (
            proof or int(np.clip(min(RUNNING * 60.0 * minutes, seconds) * workers / each, FEWEST, PROOF))
            for seconds in (max(left, 0.0), inf)
        )
        plan = times(
            each, minutes=minutes, spent=spent, experiments=planned, workers=workers, finish=finish,
            apart=proof is not None, slowed=slowed,
        )  # fmt: skip
        return plan, planned, most

    def _jumps(self, traces: Sequence[Trace]) -> list[str]:
        understood = resets_of(traces, self.mapping) is not None
        held = mechanism_of(traces, self.mapping)
        return [*jumps_told(traces, self.mapping, understood=understood), *([] if held is None else [held.told])]

    def seconds_left(self, plan: Times) -> float:
        """The time of the search, or of the fits that are asked for."""
        # A search counts its scores, export and report in its minutes; fits that are asked for do not.
        seconds = _kept(self.folder / TIMES, plan.shared - (plan.finish if self.config.fits else 0.0))
        return seconds - (0.0 if self.growth is None else GROWING * plan.whole)

    def modelled(
        self, found: Experimented, minutes: float, proving: Proving, *, whole: float
    ) -> tuple[Path, list[str], Searched | None]:
        """The folder of the model, what is to be said of it, and what came of the search; ``None`` of given fits."""
        place = self.folder / "model"
        if self.config.fits:
            self.fitted(found, minutes)
            return place, [], None
        searched = self.searched(found, minutes, partial(proving, place) if self.growth is None else None, whole=whole)
        said = [searched.hurried] if searched.hurried else []
        if self.growth is not None:
            place, brought = self.grown(found, searched, seconds=None if self.iterations else GROWING * 60.0 * whole)
            said.append(brought)
        return place, said, searched

    def grown(self, found: Experimented, searched: Searched, *, seconds: float | None) -> tuple[Path, str]:
        """The folder of the surrogate once its data have grown, and what that brought."""
        assert self.growth is not None  # noqa: S101 - the caller has seen that
        ground = Ground(config=self.config, reference=self.reference, found=found, folder=self.folder)
        grower, grown = grow(ground, self.growth, searched, seconds=seconds, say=self.say)
        place = self.folder / (GROWN if grown.best.added else "model")
        if grown.best.added:
            self.perform(grown_program(ground, grower, grown, self.export(found)), place)
        else:
            write_record(place / FILE, grown.record)
        return place, grown.record.sentence

    def page(self, place: Path) -> Path:
        """The report, made anew where the proof came after it."""
        page = place / "report" / "index.html"
        if page.stat().st_mtime < (place / FOLDER / "proof.json").stat().st_mtime:
            page = write_report(place)
        return page

    def export(self, found: Experimented) -> dict[str, Any]:
        """What leaves the workbench, begun where the reference begins."""
        fitted = found.traces.with_role(Role.ESTIMATION)
        spans = [span_of(fitted, name) for name in self.mapping.outputs]
        return {**EXPORT, "input_levels": stood_at(self.reference, found.outcomes["estimation"][0].case, spans)}

    def delivered(self, place: Path) -> Path | None:
        """The FMU where it is looked for, beside the folders; ``None`` where there is none."""
        fmu = fmu_of(read_bundle(place / "bundle"))
        if fmu is None:
            return None
        target = self.folder / f"{Path(self.reference.fmu or self.config.name).stem}-surrogate.fmu"
        with replacing(target) as draft:
            shutil.copyfile(fmu, draft)
        return target

    def learnt(self, bundle: Bundle, found: Experimented, shown: Proof) -> list[str]:
        """What the surrogate itself shows: where it begins, and what moves none of its outputs."""
        moving = not self.config.fits and restless(found, self.mapping)
        begun = beginning_of(bundle, found.traces.with_role(Role.SELECTION)) if moving else []
        inputs = {name: port.begin for name, port in self.reference.inputs.items()}
        return [
            *begun, *elsewhere(shown, inputs),
            *without_effect(bundle, found.traces.with_role(Role.ESTIMATION), shown),
        ]  # fmt: skip

    def searched(
        self, found: Experimented, minutes: float, before_page: Callable[[], object] | None, *, whole: float
    ) -> Searched:
        """A model that is looked for in some minutes, of the whole."""
        fields: dict[str, Any] = {
            **{"kind": "auto", "name": "model", "data": str((self.place / DATASET).resolve())},
            **{"mapping": self.mapping, "start": Start(), "rest": dict(found.before), "seed": self.seed},
            **({"iterations": self.iterations} if self.iterations else {"minutes": minutes}),
            **{"workers": self.config.workers, "tolerance": TOLERANCE},
            **{"export": self.export(found), "report": {"drawn": drawn_in(60.0 * whole, len(self.mapping.outputs))}},
        }
        search = check(AutoConfig, fields, where=self.pipeline)
        auto = replace(auto_of(search, load=lambda: data_of(found.traces, self.mapping)), before_page=before_page)
        done: Searched = self.perform(search_program(auto), self.folder / "model")
        return done

    def known(self, data: Path, found: Experimented | None, minutes: float | None) -> PipelineConfig:
        """The fits that are asked for in place of a search."""
        seconds = None if minutes is None or self.iterations else 60.0 * minutes
        return pipeline_of(
            self.config, self.mapping, where=self.pipeline, data=data, rest={} if found is None else found.before,
            seconds=seconds, seed=self.seed, export=EXPORT if found is None else self.export(found),
            tolerance=TOLERANCE,
        )  # fmt: skip

    def fitted(self, found: Experimented, minutes: float) -> None:
        """They are fitted, scored and exported."""
        place = self.folder / "model"
        known = self.known((self.place / DATASET).resolve(), found, minutes)
        self.perform(known_program(known, place), place)


@dataclass(frozen=True, kw_only=True, eq=False)
class Proving:
    """The proof of a model, written beside its results: its report shows it."""

    reference: ReferenceConfig
    design: Design
    taught: TraceSet
    count: int
    workers: int
    ends: float
    whole_s: float
    watch: Watcher
    done: dict[Path, Proof] = field(default_factory=dict)

    def __call__(self, place: Path) -> Proof:
        """Prove the bundle in a folder; what time the page takes, which comes after it, is seen now."""
        until = inf
        if np.isfinite(self.ends):
            until = self.ends - page_s(len(self.taught), len(self.reference.outputs), self.whole_s)
        self.watch(StepStarted(step=PROVING))
        proof, section = prove(
            read_bundle(place / "bundle"), self.reference, self.design, self.taught, count=self.count,
            workers=self.workers, tolerance=TOLERANCE, until=until, progress=self._progress,
            drawn=drawn_in(self.whole_s, len(self.reference.outputs)),
        )  # fmt: skip
        (place / FOLDER).mkdir(exist_ok=True)
        write_record(place / FOLDER / "proof.json", section)
        self.done[place] = proof
        within = f"{100.0 * proof.share:.1f} % within {100.0 * TOLERANCE:g} % of the range"
        self.watch(StepDone(step=PROVING, stored=False, detail=f"{len(proof.errors):,} new experiments, {within}"))
        return proof

    def _progress(self, _: str, n: int, of: int) -> None:
        self.watch(StepProgress(step=PROVING, fraction=n / of, detail=f"{n:,} of {of:,} experiments"))


def first_look(experiments: Experiments, *, minutes: float) -> str | None:
    """What experiments take, told before they are run: the first is run to see where nobody knows.

    Args:
        experiments: What is to be run.
        minutes: Time for all.

    Returns:
        A sentence where they take much of the time, or the first gave no record; else nothing.
    """
    config, cases = experiments.config, [case for some in experiments.cases().values() for case in some]
    left, each, _ = experiments.lacking(cases)
    failed = ""
    if left and each is None:
        with ReferenceRuns(config=experiments.reference, workers=1) as runs:
            (one,) = runs.run(cases[:1])
            warm = runs.seconds_warm(one, most=WARMED * 60.0 * minutes)
        left, each = left - (not one.stored), warm if np.isfinite(warm) else None
        failed = "" if one.reason is None else f"; it gave no record: {one.reason}"
    each = each or 0.0
    seconds = left * each / config.workers
    if seconds <= RUNS_MOST * 60.0 * minutes and not failed:
        return None
    return (
        f"Time: {left} experiments are to be run, about {span(seconds)} of the {span(60.0 * minutes)} that were "
        f"asked for, as one takes {each:.3g} s{failed}. Fewer runs take less, and a shorter time_limit where they hang."
    )


def _check_moving(traces: Sequence[Trace], reference: ReferenceConfig) -> None:
    """Refuse outputs that no experiment moves: nothing is to be learnt of them, and there is no range for an error."""
    still = [name for name in reference.outputs if span_of(traces, name) == 0.0]
    if still:
        raise ConfigError(
            f"{still[0]} has one value in all experiments", where=f"output {still[0]}", expected="an output that moves",
            got=f"{float(traces[0][still[0]][0]):.6g} throughout {len(traces)} experiments",
            remedy="leave the output out, or move what it depends on: wider ranges, a longer duration",
        )  # fmt: skip


def _kept(file: Path, seconds: float) -> float:
    """Seconds of the search, as they were decided first."""
    with suppress(OSError, ValueError, TypeError):
        return float(read_bounded(file))
    write_bytes(file, f"{seconds:.1f}\n".encode())
    return round(seconds, 1)
