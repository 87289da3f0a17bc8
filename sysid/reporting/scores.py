"""Figures of a published report for programs: errors of the free run by case, beside what is published."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from sysid.atomic import replacing
from sysid.reporting.assembly.results import AssemblyResults
from sysid.reporting.comparing.figures_file import read_figures
from sysid.reporting.judging.results import JudgementResults
from sysid.reporting.numbers import seconds
from sysid.reporting.records import Number
from sysid.reporting.results import Results

SCORES_FILE: Final = "scores.json"
"""Beside the page of a published run."""


class Score(BaseModel):
    """Mean squared errors of one model's free run by case."""

    model_config = ConfigDict(frozen=True, extra="allow", protected_namespaces=())

    mapping: str = Field(description="Written as in 'BP+AR -> BC'.")
    unit: str = Field(description="The output's unit.")
    model: str = Field(description="Which model, in a few words.")
    mse: dict[str, Number] = Field(description="By case, in the unit squared; null where the free run diverges.")
    published: dict[str, Number] = Field(default={}, description="Published figures by case, in the same unit.")
    source: str = Field(default="", description="Where they are printed, and of which model they are.")

    def typical(self, *, without: Sequence[str] = ("EST01",)) -> float:
        """Geometric mean over the cases; infinite where one diverges, so that such a model is nobody's best.

        Example:
            >>> Score(mapping="u -> y", unit="V", model="a", mse={"EST01": 9.0, "A": 1.0, "B": 4.0}).typical()
            2.0
        """
        errors = [error for case, error in self.mse.items() if case not in without]
        if not errors or not all(math.isfinite(error) for error in errors):
            return math.inf
        return math.exp(sum(math.log(error) for error in errors) / len(errors))


_SCORES: Final = TypeAdapter(list[Score])


def fit_scores(results: Results) -> list[Score]:
    """The score of the fit that a run chose.

    Args:
        results: Of a run, with the published figures where there are some.

    Returns:
        One score; none where no fit was chosen.
    """
    fit = results.best_fit
    if fit is None:
        return []
    figures = {name: (case.published or {}).get("free_run") for name, case in fit.cases.items()}
    known = {name: figure for name, figure in figures.items() if figure is not None}
    return [
        Score(
            mapping=fit.mapping,
            unit=fit.unit,
            model=f"{fit.label}, trained in {fit.loop.value} loop in {seconds(fit.train_time_s)}",
            mse={name: case.free_run.mse for name, case in fit.cases.items()},
            published={name: figure.value for name, figure in known.items()},
            source=", ".join(dict.fromkeys(f"{figure.source}: {figure.label}" for figure in known.values())),
        )
    ]


def assembly_scores(results: AssemblyResults) -> list[Score]:
    """The scores of the chosen whole.

    Args:
        results: Of a run.

    Returns:
        One for each output.
    """
    found = []
    for output, mse in results.chosen.mse.items():
        published = results.published.get(output)
        found.append(
            Score(
                mapping=f"{'+'.join(results.whole.inputs)} -> {output}",
                unit=results.outputs[output].unit,
                model=f"{results.whole.models} models as one, {results.whole.parameters} parameters",
                mse=dict(mse),
                published={} if published is None else dict(published.mse),
                source="" if published is None else published.source,
            )
        )
    return found


def judgement_scores(results: JudgementResults) -> list[Score]:
    """The error of every subject by scene.

    Args:
        results: Of a run.

    Returns:
        One for each subject; none where the judge has no such figure, or not as a squared error.
    """
    record = results.judgement
    error = record.error
    unit = "" if error is None else record.quantities[error].unit
    if error is None or not unit.endswith("²"):
        return []
    return [
        Score(
            mapping=f"{record.title}, {record.quantities[error].name}",
            unit=unit.removesuffix("²"),
            model=subject,
            mse={scene: one.differences.get(error, math.nan) for scene, one in record.run(subject).items()},
        )
        for subject in record.subjects
    ]


def write_scores(folder: Path, scores: Sequence[Score]) -> Path:
    """Write scores.json.

    Args:
        folder: Folder of the report.
        scores: The scores.

    Returns:
        The file.
    """
    path = Path(folder) / SCORES_FILE
    with replacing(path) as draft:
        draft.write_bytes(_SCORES.dump_json(list(scores), indent=1) + b"\n")
    return path


def read_scores(folder: Path) -> list[Score]:
    """The scores of a published report.

    Args:
        folder: Folder of the report.

    Returns:
        The scores.

    Raises:
        ConfigError: If there are none, or they are damaged.
    """
    return read_figures(
        Path(folder) / SCORES_FILE,
        _SCORES,
        what="the scores of the report cannot be read",
        expected="what sysid publish writes beside the page of a run",
        remedy="publish the run again",
    )
