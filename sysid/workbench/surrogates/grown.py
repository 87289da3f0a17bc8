"""A search's model on data that grow: the rounds, then what was chosen of them as a pipeline of fits of its own."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from sysid.atomic import write_bytes
from sysid.estimation import FitResult
from sysid.models import Mapping, Start
from sysid.references.config import ReferenceConfig
from sysid.reporting.growth import FILE
from sysid.reporting.records import write_record
from sysid.reporting.results import Results
from sysid.workbench.auto.found import FOUND
from sysid.workbench.auto.run import Searched
from sysid.workbench.experiments.config import ExperimentConfig, GrowConfig
from sysid.workbench.experiments.run import Experimented, write_dataset
from sysid.workbench.fits.choice import Choice
from sysid.workbench.fits.config import FitConfig, Pipeline, PipelineConfig
from sysid.workbench.fits.data import data_of
from sysid.workbench.fits.fit_steps import FitSteps, GivenFit
from sysid.workbench.fits.outputs import models_of
from sysid.workbench.fits.record import read_fit
from sysid.workbench.runner.program import Program
from sysid.workbench.runner.run import Run
from sysid.workbench.runner.steps import Step
from sysid.workbench.runner.store import digest, strict
from sysid.workbench.surrogates.grow import Grower, Grown
from sysid.yaml_files import yaml_text

GROWN = "grown"
"""Name of the fit, and of its folder."""


def _found_fits(searched: Searched, folder: Path) -> list[FitResult]:
    """The fits of what a search has chosen, one a model."""
    own = [one for one in searched.results.fits if one.name == FOUND or one.name.startswith(f"{FOUND}, ")]
    return [read_fit(folder / "fits" / slug) for slug in dict.fromkeys(one.model_slug or one.slug for one in own)]


def _training_of(searched: Searched) -> dict[str, Any]:
    """The options of training that a search has chosen with the structure, by name."""
    (trial,) = [one for one in searched.record.trials if one.number == searched.record.winner]
    return {name: value for name, value in trial.values.items() if name not in {"structure", "seed"}}


@dataclass(frozen=True, kw_only=True, eq=False)
class Ground:
    """What data grow from.

    Args:
        config: The pipeline of the experiments.
        reference: With whole paths.
        found: The experiments that the search was on.
        folder: Of all; the search's is ``model`` in it.
    """

    config: ExperimentConfig
    reference: ReferenceConfig
    found: Experimented
    folder: Path


def grow(
    ground: Ground, how: GrowConfig, searched: Searched, *, seconds: float | None, say: Callable[[str], None]
) -> tuple[Grower, Grown]:
    """Let the experiments of a search's model grow.

    Args:
        ground: What they grow from.
        how: How they grow.
        searched: What came of the search.
        seconds: Wall time of the rounds; ``None`` for no limit.
        say: Told how it goes.

    Returns:
        What grew, and what came of it.
    """
    grower = Grower(
        reference=ground.reference, design=ground.config.experiment, config=how, taught=ground.found.traces,
        rest=ground.found.before, folder=ground.folder / GROWN / "rounds", training=_training_of(searched),
        workers=ground.config.workers, seconds=seconds, say=say,
    )  # fmt: skip
    return grower, grower.grow(_found_fits(searched, ground.folder / "model"))


def program_of(ground: Ground, grower: Grower, grown: Grown, export: Dict[str, Any]) -> Program[Results]:
    """The model of the chosen round as a pipeline of fits: scored, exported, with a report.

    Args:
        ground: What it grew from.
        grower: What grew.
        grown: What came of it.
        export: Fields of the export.

    Returns:
        The program.
    """
    config, reference, found, folder = ground.config, ground.reference, ground.found, ground.folder / GROWN
    fits, added = grown.best.fits, grown.best.added
    outcomes = {**found.outcomes, "estimation": [*found.outcomes["estimation"], *added]}
    named = config.model_copy(update={"name": f"{config.name}-{GROWN}"})
    file = write_dataset(named, reference, outcomes, folder / "data", f"growth of {config.name}")
    mapping = Mapping(inputs=(*reference.inputs, *reference.parameters), outputs=tuple(reference.outputs))
    structure: Any = fits[0].model.structure.to_dict()
    fields: dict[str, Any] = {
        "name": GROWN, "data": str(file), "mapping": mapping, "start": Start(), "rest": dict(found.before),
        "fits": (FitConfig(name=GROWN, structure=structure),), "export": dict(export),
    }  # fmt: skip
    checked = PipelineConfig.model_validate(fields)
    text = yaml_text(checked.model_dump(mode="json", exclude_defaults=True))
    by_mapping = {str(fit.model.mapping): fit for fit in fits}
    given = {
        model.fit.name: GivenFit(key=digest(strict(fit.to_dict())), make=partial(_made, fit))
        for model in models_of(checked.fits[0], checked)
        for fit in [by_mapping[str(model.config.mapping)]]
    }
    work = FitSteps(
        pipeline=Pipeline(config=checked, text=text, path=folder / "pipeline.yaml"), given=given,
        chosen=Choice(name=GROWN, chosen_by=f"{grown.record.sentence}."),
    )  # fmt: skip
    data = data_of(grower.traces(added), mapping)

    def keep(place: Path) -> None:
        write_bytes(place / "pipeline.yaml", text.encode())
        write_record(place / FILE, grown.record)

    def run(run: Run) -> Results:
        loading: Step[Any] = Step(name="data", title="Loading the traces", make=lambda _: data, at_hand=lambda: True)
        return work.run(run, run.do(loading))

    return Program(name=GROWN, keep=keep, steps=run, outline=work.outline)


def _made(fit: FitResult, _: object) -> FitResult:
    return fit
