"""The way from a pipeline of kind ``experiment`` to a surrogate that is proven; what is done is not done again."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sysid.bounded_text import read_bounded
from sysid.errors import ConfigError
from sysid.export.bundle import Bundle
from sysid.export.reading import read_bundle
from sysid.models import Mapping, Start
from sysid.references.config import ReferenceConfig
from sysid.references.runs import ReferenceRuns
from sysid.reporting.growth import FILE
from sysid.reporting.judging.results import FOLDER
from sysid.reporting.records import write_record
from sysid.reporting.report import write_report
from sysid.traces import Role, Trace
from sysid.workbench.auto.config import AutoConfig
from sysid.workbench.auto.jumps import jumps_told
from sysid.workbench.auto.look import MOVED, in_motion, span_of
from sysid.workbench.auto.run import Searched, auto_of
from sysid.workbench.auto.run import program_of as search_program
from sysid.workbench.experiments.config import ExperimentConfig, GrowConfig
from sysid.workbench.experiments.run import DATASET, Experimented
from sysid.workbench.experiments.run import program_of as experiment_program
from sysid.workbench.fits.config import PipelineConfig
from sysid.workbench.fits.data import data_of
from sysid.workbench.runner.program import Program
from sysid.workbench.runner.store import write_bytes
from sysid.workbench.surrogates.grown import GROWN, Ground, grow
from sysid.workbench.surrogates.grown import program_of as grown_program
from sysid.workbench.surrogates.known import pipeline_of
from sysid.workbench.surrogates.known import program_of as known_program
from sysid.workbench.surrogates.plan import PROOF, RUNNING, search_share
from sysid.workbench.surrogates.proof import Proof, fmu_of, prove
from sysid.yaml_files import check, read_yaml

T = TypeVar("T")
Perform = Callable[[Program[Any], Path], Any]
"""Carries a program out in a folder, and gives its results."""
GROWING = 0.25
"""Share of the time in which data grow, where they do; it is taken from the search's."""
TIMES = "search-share.txt"
"""The search's share of the time: decided once, so that a run that was killed finds its trials again."""
FORMATS = ("c", "fmi2", "fmi3")


@dataclass(frozen=True, kw_only=True, eq=False)
class Made:
    """A surrogate.

    Args:
        bundle: Its folder.
        fmu: The drop-in FMU; ``None`` where it was not exported.
        report: The page.
        proof: How it does on new experiments.
        notes: What a reader has to know.
    """

    bundle: Path
    fmu: Path | None
    report: Path
    proof: Proof
    notes: Sequence[str] = ()


def make_surrogate(
    pipeline: Path,
    folder: Path,
    *,
    perform: Perform,
    minutes: float,
    proof: int | None = None,
    iterations: int | None = None,
    rounds: int | None = None,
    seed: int = 0,
    say: Callable[[str], None] = lambda _: None,
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
        seed: Of the search.
        say: Told what makes a surrogate wrong, and how the proof goes.

    Returns:
        The surrogate.

    Raises:
        UserError: If the pipeline or its reference cannot be used.
    """
    config = check(ExperimentConfig, read_yaml(pipeline), where=pipeline)
    growth = config.grow if rounds is None else (config.grow or GrowConfig()).model_copy(update={"rounds": rounds})
    reference = config.reference.at(pipeline.resolve().parent)
    mapping = Mapping(inputs=(*reference.inputs, *reference.parameters), outputs=tuple(reference.outputs))
    work = _Work(
        pipeline=pipeline, config=config, reference=reference, mapping=mapping, folder=folder, perform=perform,
        seed=seed, iterations=iterations,
    )  # fmt: skip
    if config.fits:
        work.known(Path(DATASET), {}, None)  # what does not go together is refused before anything is run
        if rounds is not None:
            raise ConfigError(
                "experiments grow around what a search has chosen", where=pipeline, expected="rounds, or fits",
                got="both", remedy="leave rounds out, or the fits of the pipeline",
            )  # fmt: skip
    found = work.experimented()
    # What a search has to learn; of fits that are asked for somebody knows it.
    begins = [] if config.fits else restless(found, mapping)
    jumps = [] if config.fits else jumps_told(found.traces.with_role(Role.ESTIMATION), mapping)
    notes = [*begins, *jumps]
    for note in notes:  # before an hour is spent
        say(f"note: {note}")
    runs = ReferenceRuns(config=reference)
    share = _share(folder / TIMES, runs, len(found.traces), minutes=minutes, workers=config.workers)
    share -= 0.0 if growth is None else GROWING
    place = folder / "model"
    if config.fits:
        work.fitted(found, share * minutes)
    else:
        searched = work.searched(found, share * minutes)
        if growth is not None:
            ground = Ground(config=config, reference=reference, found=found, folder=folder)
            seconds = None if iterations else GROWING * 60.0 * minutes
            place, said = _grown(ground, growth, searched, seconds=seconds, perform=perform, say=say)
            notes.append(said)
    bundle = read_bundle(place / "bundle")
    notes += beginning_of(bundle, found.traces.with_role(Role.SELECTION)) if begins else []
    count = proof or _affordable(config, reference_runs=runs, minutes=minutes)
    shown, section = prove(
        bundle, reference, config.experiment, found.traces, count=count, workers=config.workers,
        progress=lambda name, n, of: say(f"proof: {name} ({n} of {of})") if n % max(1, of // 20) == 0 else None,
    )  # fmt: skip
    (place / FOLDER).mkdir(exist_ok=True)
    write_record(place / FOLDER / "proof.json", section)
    page, fmu = write_report(place), fmu_of(bundle)
    if fmu is not None:
        fmu = Path(shutil.copyfile(fmu, folder / f"{Path(reference.fmu or config.name).stem}-surrogate.fmu"))
    if len(shown.errors) < PROOF:
        notes.append(f"the proof is of {len(shown.errors)} experiments; --proof 1000 makes it of 1,000")
    return Made(bundle=bundle.folder, fmu=fmu, report=page, proof=shown, notes=notes)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Work:
    """The parts of a surrogate that are programs, each kept in a folder of its own."""

    pipeline: Path
    config: ExperimentConfig
    reference: ReferenceConfig
    mapping: Mapping
    folder: Path
    perform: Perform
    seed: int
    iterations: int | None

    @property
    def _experiment(self) -> Path:
        return self.folder / "experiment"

    def experimented(self) -> Experimented:
        """The experiments."""
        text, beside = self.pipeline.read_text(encoding="utf-8-sig"), self.pipeline.resolve().parent
        found: Experimented = self.perform(experiment_program(self.config, text=text, folder=beside), self._experiment)
        return found

    def searched(self, found: Experimented, minutes: float) -> Searched:
        """A model that is looked for."""
        fields: dict[str, Any] = {
            **{"kind": "auto", "name": "model", "data": str((self._experiment / DATASET).resolve())},
            **{"mapping": self.mapping, "start": Start(), "rest": dict(found.before), "seed": self.seed},
            **({"iterations": self.iterations} if self.iterations else {"minutes": minutes}),
            **{"workers": self.config.workers, "export": {"formats": FORMATS}},
        }
        search = check(AutoConfig, fields, where=self.pipeline)
        auto = auto_of(search, load=lambda: data_of(found.traces, self.mapping))
        done: Searched = self.perform(search_program(auto), self.folder / "model")
        return done

    def known(self, data: Path, rest: Dict[str, float], minutes: float | None) -> PipelineConfig:
        """The fits that are asked for in place of a search."""
        seconds = None if minutes is None or self.iterations else 60.0 * minutes
        return pipeline_of(
            self.config, self.mapping, where=self.pipeline, data=data, rest=rest, seconds=seconds, seed=self.seed,
            formats=FORMATS,
        )  # fmt: skip

    def fitted(self, found: Experimented, minutes: float) -> None:
        """They are fitted, scored and exported."""
        place = self.folder / "model"
        known = self.known((self._experiment / DATASET).resolve(), found.before, minutes)
        self.perform(known_program(known, place), place)


def _grown(
    ground: Ground,
    how: GrowConfig,
    searched: Searched,
    *,
    seconds: float | None,
    perform: Perform,
    say: Callable[[str], None],
) -> tuple[Path, str]:
    """The folder of the surrogate once its data have grown, and what that brought."""
    grower, grown = grow(ground, how, searched, seconds=seconds, say=say)
    place = ground.folder / (GROWN if grown.best.added else "model")
    if grown.best.added:
        perform(grown_program(ground, grower, grown, FORMATS), place)
    else:
        write_record(place / FILE, grown.record)
    return place, grown.record.sentence


def _affordable(config: ExperimentConfig, *, reference_runs: ReferenceRuns, minutes: float) -> int:
    """New experiments for which there is time, at most 1,000."""
    with reference_runs as runs:
        each = runs.seconds_each()[0]
    each = config.reference.time_limit if each is None else max(each, 1e-3)
    return int(np.clip(RUNNING * 60.0 * minutes * config.workers / each, 20, PROOF))


def _share(kept: Path, runs: ReferenceRuns, count: int, *, minutes: float, workers: int) -> float:
    """Share of the time for the search, as it was decided first."""
    with suppress(OSError, ValueError, TypeError):
        return float(read_bounded(kept))
    with runs as known:
        share = round(search_share(known.seconds_each()[0], count, minutes=minutes, workers=workers), 3)
    write_bytes(kept, f"{share}\n".encode())
    return share


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
        np.abs(np.asarray(bundle.simulate({name: trace[name][:2] for name in inputs})).reshape(2, -1) - measured)[0]
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
