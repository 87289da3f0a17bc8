"""The scores of a run, by kind of its pipeline."""

from __future__ import annotations

import math

from sysid.reporting.assembly.results import AssemblyResults
from sysid.reporting.fit_records import FitRecord
from sysid.reporting.judging.results import JudgementResults
from sysid.reporting.numbers import seconds
from sysid.reporting.results import Results
from sysid.reporting.scores import Score


def fit_scores(results: Results) -> list[Score]:
    """The score of the fit that a run chose.

    Args:
        results: Of a run, with the published figures where there are some.

    Returns:
        One score an output; none where no fit was chosen.
    """
    return [_fit_score(fit) for fit in results.best_fits]


def _fit_score(fit: FitRecord) -> Score:
    figures = {name: (case.published or {}).get("free_run") for name, case in fit.cases.items()}
    known = {name: figure for name, figure in figures.items() if figure is not None}
    return Score(
        mapping=fit.mapping,
        unit=fit.unit,
        model=f"{fit.label}, trained in {fit.loop.value} loop in {seconds(fit.train_time_s)}",
        mse={name: case.free_run.mse for name, case in fit.cases.items()},
        published={name: figure.value for name, figure in known.items()},
        source=", ".join(dict.fromkeys(f"{figure.source}: {figure.label}" for figure in known.values())),
    )


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
