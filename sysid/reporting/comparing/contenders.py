"""What a run of any kind puts up against another: what it chose, with its figures case by case.

One row a kind of results, in :data:`MAKERS`: a fit, the outputs of an assembly, the subjects of a judgement.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from sysid.errors import ConfigError
from sysid.names import output_side
from sysid.reporting.assembly.results import AssemblyResults
from sysid.reporting.fit_records import FitRecord
from sysid.reporting.judging.results import JudgementResults
from sysid.reporting.judging.version_1 import ReadyResults
from sysid.reporting.numbers import number
from sysid.reporting.records import RunResults
from sysid.reporting.results import Results
from sysid.reporting.sections.fit_tables import SCORED
from sysid.reporting.signals import CaseSignals, read_signals
from sysid.reporting.tables import Column
from sysid.traces import Role
from sysid.validation.metrics import MERITS

ERROR: Final = "mse"
"""Key of the figure that says who is better, in every contender."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Entry:
    """A contender on one case.

    Args:
        role: What the case was used for; ``None`` of a scene, which is nobody's.
        figures: By key; NaN where the free run diverges, or nothing is known.
        target: Digest of what it was scored on; empty where that is not known.
        simulated_s: Length of the case in seconds; NaN where it is not known.
        run_time_s: Seconds of the free run; NaN where it is not known.
        signals: Target and free run, where they are stored.
    """

    role: Role | None
    figures: Dict[str, float]
    target: str = ""
    simulated_s: float = math.nan
    run_time_s: float = math.nan
    signals: CaseSignals | None = None

    @property
    def error(self) -> float:
        """The figure that says who is better."""
        return self.figures.get(ERROR, math.nan)

    @property
    def seen(self) -> bool:
        """Whether it was fitted to the case, or chosen on it."""
        return self.role is not None and self.role not in SCORED


@dataclass(frozen=True, kw_only=True, eq=False)
class Contender:
    """One output of what a run chose.

    Args:
        name: Name of the fit, the stage or the subject.
        output: Name of the output.
        unit: Its unit.
        columns: Of its figures, the error first.
        cases: By name.
        parameters: How many it has; ``None`` where that is not known.
        train_time_s: Seconds of its training; NaN where that is not known.
        facts: What it is, in words, by name.
    """

    name: str
    output: str
    unit: str
    columns: tuple[Column, ...]
    cases: Dict[str, Entry]
    parameters: int | None = None
    train_time_s: float = math.nan
    facts: Dict[str, str] = field(default_factory=dict)


def contenders(folder: Path, results: RunResults) -> list[Contender]:
    """What a run puts up.

    Args:
        folder: The run's folder, with its signals.
        results: Its results.

    Returns:
        One for each output, or subject.

    Raises:
        ConfigError: If its signals are missing or damaged, its figures have no names, or it ran over no cases.
    """
    if type(results) not in MAKERS:
        raise ConfigError(
            "the run has no cases to compare", where=folder, expected="a run that fitted or judged records",
            got=f"kind {results.kind}", remedy="set the fits in per cent of its results.json beside each other",
        )  # fmt: skip
    return MAKERS[type(results)](Path(folder), results)


def _of_fits(folder: Path, results: Results) -> list[Contender]:
    return [_of_fit(folder, fit) for fit in results.best_fits or results.fits[:1]]


def _of_fit(folder: Path, fit: FitRecord) -> Contender:
    signals = read_signals(folder / "fits" / fit.slug, list(fit.cases))
    merits = [merit for merit in MERITS if merit.compared]
    cases = {
        name: Entry(
            role=case.role,
            figures={merit.key: getattr(case.free_run, merit.key) for merit in merits},
            target=_digest(signals[name]),
            simulated_s=case.simulated_s,
            run_time_s=case.run_time_s,
            signals=signals[name],
        )
        for name, case in fit.cases.items()
    }
    facts = {
        "fit": fit.name,
        "mapping": fit.mapping,
        "structure": fit.label,
        "trained in": f"{fit.loop.value} loop",
        "parameters": "unknown" if fit.n_parameters is None else str(fit.n_parameters),
        "training time [s]": number(fit.train_time_s),
    }
    return Contender(
        # Beside another run, a fit is told by its name in the pipeline; its output stands beside it.
        name=fit.system or fit.name,
        output=_output(fit.mapping),
        unit=fit.unit,
        columns=tuple(Column.of(merit, fit.unit) for merit in merits),
        cases=cases,
        parameters=fit.n_parameters,
        train_time_s=fit.train_time_s,
        facts=facts,
    )


def _of_assembly(folder: Path, results: AssemblyResults) -> list[Contender]:
    error = next(merit for merit in MERITS if merit.key == ERROR)
    found = []
    for output, about in results.outputs.items():
        signals = read_signals(folder, list(results.cases), of=output)
        cases = {
            name: Entry(
                role=case.role,
                figures={ERROR: results.chosen.mse[output][name]},
                target=_digest(signals[name]),
                simulated_s=case.duration_s,
                run_time_s=case.run_time_s,
                signals=signals[name],
            )
            for name, case in results.cases.items()
        }
        facts = {
            "stage": results.whole.stage,
            "mapping": f"{'+'.join(results.whole.inputs)} -> {output}",
            "structure": f"{results.whole.models} models as one",
            "parameters": str(results.whole.parameters),
        }
        found.append(
            Contender(
                name=results.whole.stage,
                output=output,
                unit=about.unit,
                columns=(Column.of(error, about.unit),),
                cases=cases,
                parameters=results.whole.parameters,
                facts=facts,
            )
        )
    return found


def _of_judgement(_: Path, results: JudgementResults) -> list[Contender]:
    record = results.judgement
    if record.error is None:
        raise ConfigError(
            "the judgement has no error to compare by",
            where=f"judgement of {results.pipeline}",
            expected="a judge that names the difference that is the error of the models",
            got=f"differences {', '.join(record.quantities)}",
            remedy="compare runs of a judge that does",
        )
    error, parts = record.quantities[record.error], {one.name: "; ".join(one.parts) for one in results.subjects}
    limited = {key: record.quantities[key] for key in record.limited}
    columns = (
        Column(key=ERROR, heading=error.name, below=error.unit),
        *(Column(key=key, heading=one.name, below=one.unit) for key, one in limited.items()),
    )
    return [
        Contender(
            name=subject,
            output=f"{subject}: {error.name}" if len(record.subjects) > 1 else error.name,
            unit=error.unit.removesuffix("²"),
            columns=columns,
            cases={
                scene: Entry(
                    role=None,
                    figures={ERROR: one.differences.get(record.error, math.nan)}
                    | {key: one.differences.get(key, math.nan) for key in limited},
                    target=_text_digest(record.reference[scene].measures if scene in record.reference else {}),
                )
                for scene, one in record.run(subject).items()
            },
            facts={"subject": subject, "models": parts.get(subject, "")},
        )
        for subject in record.subjects
    ]


def _of_ready(_: Path, results: ReadyResults) -> list[Contender]:
    """Of version 1 there are the scores that a scorecard reads, and no signals."""
    if not results.judgement.scores:
        raise ConfigError(
            "the run has no figures that can be compared",
            where=f"results of {results.pipeline}",
            expected="results.json of version 2, or scores",
            got="tables that were stored ready-made, of an earlier release",
            remedy="run the pipeline again; it resumes from what is finished",
        )
    error = next(merit for merit in MERITS if merit.key == ERROR)
    return [
        Contender(
            name=score.model,
            output=_output(score.mapping),
            unit=score.unit,
            columns=(Column.of(error, score.unit),),
            cases={name: Entry(role=None, figures={ERROR: mse}) for name, mse in score.mse.items()},
            facts={"mapping": score.mapping, "structure": score.model},
        )
        for score in results.judgement.scores
    ]


MAKERS: Final[dict[type[RunResults], Callable[[Path, Any], list[Contender]]]] = {
    Results: _of_fits,
    AssemblyResults: _of_assembly,
    JudgementResults: _of_judgement,
    ReadyResults: _of_ready,
}


def _output(mapping: str) -> str:
    return output_side(mapping)


def _digest(signals: CaseSignals) -> str:
    return hashlib.sha256(signals.target.tobytes()).hexdigest()


def _text_digest(values: Dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest() if values else ""
