"""The way from a pipeline of kind ``experiment`` to a surrogate that is proven; what is done is not done again."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sysid.export.reading import read_bundle
from sysid.models import Mapping, Start
from sysid.references.runs import ReferenceRuns
from sysid.reporting.judging.results import FOLDER
from sysid.reporting.records import write_record
from sysid.reporting.report import write_report
from sysid.traces import Role
from sysid.workbench.auto.config import AutoConfig
from sysid.workbench.auto.run import auto_of
from sysid.workbench.auto.run import program_of as search_program
from sysid.workbench.experiments.config import ExperimentConfig
from sysid.workbench.experiments.run import DATASET, Experimented
from sysid.workbench.experiments.run import program_of as experiment_program
from sysid.workbench.fits.data import data_of
from sysid.workbench.runner.program import Program
from sysid.workbench.surrogates.plan import RUNNING
from sysid.workbench.surrogates.proof import Proof, fmu_of, prove
from sysid.yaml_files import check, read_yaml

T = TypeVar("T")
Perform = Callable[[Program[Any], Path], Any]
"""Carries a program out in a folder, and gives its results."""
SEARCHING = 0.5
"""Share of the time in which a model is looked for."""
UNEQUAL = 0.01
"""Share of an output's range by which it may begin at different values before that is told."""


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
    seed: int = 0,
    say: Callable[[str], None] = lambda _: None,
) -> Made:
    """Run experiments, find a model of them, export it with the reference's ports, and prove it.

    Args:
        pipeline: YAML of kind ``experiment``. **What it names is run.**
        folder: Where everything is kept; a run that was killed goes on there.
        perform: Carries a program out.
        minutes: Time for all.
        proof: New experiments; 1,000 by default, or as many as there is time for.
        iterations: In place of the search's time: the same result on every machine.
        seed: Of the search.
        say: Told what makes a surrogate wrong, and how the proof goes.

    Returns:
        The surrogate.

    Raises:
        UserError: If the pipeline or its reference cannot be used.
    """
    config = check(ExperimentConfig, read_yaml(pipeline), where=pipeline)
    text = pipeline.read_text(encoding="utf-8-sig")
    place, reference = folder / "experiment", config.reference.at(pipeline.resolve().parent)
    found: Experimented = perform(experiment_program(config, text=text, folder=pipeline.resolve().parent), place)
    mapping = Mapping(inputs=(*reference.inputs, *reference.parameters), outputs=tuple(reference.outputs))
    notes = [*_uneven(found), *in_motion(found, mapping)]
    for note in notes:  # before an hour is spent
        say(f"note: {note}")
    fields: dict[str, Any] = {
        **{"kind": "auto", "name": "model", "data": str((place / DATASET).resolve()), "mapping": mapping},
        **{"start": Start(), "rest": dict(found.before), "seed": seed, "workers": config.workers},
        **({"iterations": iterations} if iterations else {"minutes": SEARCHING * minutes}),
        "export": {"formats": ["c", "fmi2", "fmi3"]},
    }
    search = check(AutoConfig, fields, where=pipeline)
    perform(search_program(auto_of(search, load=lambda: data_of(found.traces, mapping))), folder / "model")
    bundle = read_bundle(folder / "model" / "bundle")
    count = proof or _affordable(config, reference_runs=ReferenceRuns(config=reference), minutes=minutes)
    shown, section = prove(
        bundle, reference, config.experiment, found.traces, count=count, workers=config.workers,
        progress=lambda name, n, of: say(f"proof: {name} ({n} of {of})") if n % max(1, of // 20) == 0 else None,
    )  # fmt: skip
    (folder / "model" / FOLDER).mkdir(exist_ok=True)
    write_record(folder / "model" / FOLDER / "proof.json", section)
    page, fmu = write_report(folder / "model"), fmu_of(bundle)
    if fmu is not None:
        fmu = Path(shutil.copyfile(fmu, folder / f"{Path(reference.fmu or config.name).stem}-surrogate.fmu"))
    if len(shown.errors) < 1000:
        notes.append(f"the proof is of {len(shown.errors)} experiments; --proof 1000 makes it of 1,000")
    return Made(bundle=bundle.folder, fmu=fmu, report=page, proof=shown, notes=notes)


def _affordable(config: ExperimentConfig, *, reference_runs: ReferenceRuns, minutes: float) -> int:
    """New experiments for which there is time, at most 1,000."""
    with reference_runs as runs:
        each = runs.seconds_each()[0]
    each = config.reference.time_limit if each is None else max(each, 1e-3)
    return int(np.clip(RUNNING * 60.0 * minutes * config.workers / each, 20, 1000))


def _uneven(found: Experimented) -> list[str]:
    """Outputs that do not begin at one value, which a surrogate at rest does."""
    spans = _spans(found)
    return [
        f"{name} begins at values up to {spread:.3g} apart, the surrogate always at {found.before[name]:.6g}: its "
        "first samples are wrong where the reference begins elsewhere; give settling, or a start at which it is at rest"
        for name, spread in found.spread.items()
        if spread > UNEQUAL * spans[name]
    ]


def in_motion(found: Experimented, mapping: Mapping) -> list[str]:
    """Outputs that move before any input does, which those of a surrogate at rest do not.

    Args:
        found: The experiments.
        mapping: What moves, and what answers.

    Returns:
        A sentence for each.
    """
    moved = dict.fromkeys(found.before, 0.0)
    for trace in found.traces.with_role(Role.ESTIMATION):
        inputs = trace.columns(mapping.inputs)
        changed = np.flatnonzero((inputs != inputs[:1]).any(axis=1))
        still = slice(0, int(changed[0]) if len(changed) else len(inputs))
        moved = {name: max(most, float(np.ptp(trace[name][still]))) for name, most in moved.items()}
    spans = _spans(found)
    return [
        f"{name} moves by up to {by:.3g} while the inputs stand still: the reference does not begin at rest, and the "
        "surrogate does; give settling, or a start at which it is at rest"
        for name, by in moved.items()
        if by > UNEQUAL * spans[name]
    ]


def _spans(found: Experimented) -> dict[str, float]:
    """How far each output moves over all that was fitted."""
    traces = found.traces.with_role(Role.ESTIMATION)
    return {name: float(np.ptp(np.concatenate([trace[name] for trace in traces]))) for name in found.before}
