"""What came of an assembly, as it stands in results.json and in the files of signals beside it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.composite import FixedMember
from sysid.composite.active_learning import ActiveLearned, Assessment
from sysid.composite.doubt.doubting import Doubting
from sysid.composite.doubt.figures import DoubtFigures
from sysid.composite.doubt.monte_carlo import MonteCarlo
from sysid.composite.fixed.equations import equation_of
from sysid.composite.limits_held import Holding
from sysid.composite.parameters import values_in
from sysid.composite.rounds.round import TrainedRound
from sysid.composite.training import TrainedComposite
from sysid.models import Activity, Cascade
from sysid.reporting.assembly.results import AssemblyResults
from sysid.reporting.records import RESULTS_FILE, parse_record
from sysid.reporting.signals import MONTE_CARLO_FILE, SIGNALS_FILE
from sysid.traces import Trace, TraceSet
from sysid.workbench.assembly.ablation import Ablation
from sysid.workbench.assembly.beside import Judged
from sysid.workbench.assembly.context import Context
from sysid.workbench.assembly.interpolation import InterpolationScores
from sysid.workbench.assembly.member_scores import CandidateScores, MemberScores
from sysid.workbench.runner.store import strict, write_arrays

if TYPE_CHECKING:
    from sysid.export import Bundle

Scores = Mapping[str, Mapping[str, float]]
"""Mean squared error of the free run of the whole by output and case, in the output's unit squared."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcome:
    """What came of a run.

    Args:
        whole: The assembly of the chosen stage.
        stages: Scores by stage, in their order.
        judged: What is scored, and which of it answers.
        timing: Seconds of a free run of the whole by case.
        stressed: What came of the random sequences.
        worst: The sequences that the whole did worst on, whose signals are kept.
        unseen: By round of active learning, how it does on the random sequences.
        interpolation: How positions do between those that are modelled, if they were asked for.
        exported: The bundle, if one was asked for.
        doubt: What is exported with its doubts.
        doubt_on: How far these can be trusted, by data set, the one that the threshold was found on first.
        holding: Which limits hold the outputs in free run.
        members: The members' candidates by themselves, where there are several or they were fitted one step ahead too.
        ablation: What the stages say of each step of modelling by parts.
    """

    whole: Cascade
    stages: Mapping[str, Scores]
    judged: Judged
    timing: Mapping[str, float]
    stressed: MonteCarlo | None
    worst: Sequence[Trace] = ()
    unseen: Mapping[str, Assessment] = field(default_factory=dict)
    interpolation: InterpolationScores | None = None
    exported: Bundle | None = None
    doubt: Doubting | None = None
    doubt_on: Mapping[str, DoubtFigures] = field(default_factory=dict)
    holding: Sequence[Holding] = ()
    members: Sequence[MemberScores] = ()
    ablation: Sequence[Ablation] = ()


def assembly_results(
    context: Context, trained: TrainedComposite, found: Outcome, cases: TraceSet, notes: Sequence[str]
) -> AssemblyResults:
    """The contents of results.json.

    Args:
        context: The run.
        trained: What it has trained.
        found: What came of it.
        cases: The scored cases.
        notes: Sentences on how it came about.

    Returns:
        The results; what is checked is what is stored.
    """
    config, first = context.config, next(iter(cases))
    document = {
        "pipeline": config.name,
        "description": config.description,
        "command": context.run.command,
        "created": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        "environment": dict(context.run.environment),
        "seed": config.seed,
        "data": {
            "name": cases.name,
            "digest": cases.digest,
            "others": {name: digest for name, digest in context.digests.items() if name != cases.name},
        },
        "cases": {trace.name: _case(trace, cases, found) for trace in cases},
        "outputs": {name: {"unit": first.channel(name).unit} for name in config.outputs},
        "whole": {
            "stage": found.judged.chosen,
            "inputs": list(found.whole.inputs),
            "models": len(found.whole.models),
            "parameters": found.whole.n_parameters,
        },
        "stages": _stages(found),
        "mean": list(found.judged.averaged),
        "published": {name: one.model_dump() for name, one in config.published.items() if name in config.outputs},
        "published_models": config.published_models,
        "published_whole": config.published_whole,
        "members": [_member(one) for one in found.members],
        "rounds": [_round(one) for one in trained.rounds],
        "active_learning": []
        if trained.active_learning is None
        else [_active_learning(trained.active_learning, found.unseen)],
        "ablation": [asdict(one) for one in found.ablation],
        "monte_carlo": None if found.stressed is None else _stress(found.stressed),
        "equations": [_equation(one, found.whole) for one in config.composite.fixed],
        "limits": [_holding(one) for one in found.holding],
        "limit_check": asdict(trained.limits) if trained.limits.limits else None,
        "interpolation": None if found.interpolation is None else _line(found.interpolation),
        "exports": [] if found.exported is None else _exports(found.exported),
        "doubt": None if found.doubt is None else _doubt(found.doubt, found.doubt_on),
        "notes": list(notes),
    }
    return parse_record(AssemblyResults, strict(document), where=context.store.path / RESULTS_FILE)


def _equation(one: FixedMember, whole: Cascade) -> dict[str, Any]:
    unit, values = whole.units.get(one.outputs[0], one.unit), values_in(whole)
    found = {"output": one.output, "unit": unit, "equation": equation_of(one), "instances": list(one.instances)}
    return found | {"parameters": {each.name: values[each.name] for each in one.free if each.name in values}}


def write_signals(folder: Path, found: Outcome, outputs: Sequence[str], cases: TraceSet) -> None:
    """Store reference and free run of every case, and of the random sequences that the whole is worst on.

    Args:
        folder: The run folder.
        found: What came of the run.
        outputs: The scored outputs.
        cases: The scored cases.
    """
    write_arrays(folder / SIGNALS_FILE, _signals(found.whole, tuple(cases), outputs))
    random = folder / MONTE_CARLO_FILE
    if found.stressed is None:
        random.unlink(missing_ok=True)  # of an earlier run
    else:
        write_arrays(random, _signals(found.whole, found.worst, [found.stressed.output]))


def _signals(whole: Cascade, traces: Sequence[Trace], outputs: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    found: dict[str, NDArray[np.float64]] = {}
    for trace in traces:
        run = whole.simulate_trace(trace)
        for name in outputs:
            signals = {"time": trace.time, "target": trace[name], "simulated": run[name]}
            found |= {f"{name}/{trace.name}/{part}": np.asarray(values) for part, values in signals.items()}
    return found


def _case(trace: Trace, cases: TraceSet, found: Outcome) -> dict[str, Any]:
    return {
        "role": cases.roles[trace.name].value,
        "samples": len(trace),
        "duration_s": len(trace) * trace.sample_time,
        "run_time_s": found.timing[trace.name],
    }


def _stages(found: Outcome) -> list[dict[str, Any]]:
    judged = found.judged
    return [
        {"name": name, "networks": judged.networks[name], "selection": judged.selection[name], "mse": mse}
        for name, mse in found.stages.items()
    ]


def _doubt(one: Doubting, on: Mapping[str, DoubtFigures]) -> dict[str, Any]:
    return {
        "output": one.output,
        "unit": one.whole.units[one.output],
        "error": one.figures.error,
        "threshold": one.figures.threshold,
        "of": one.judged_by,
        "sentence": one.sentence,
        "on": [{"data": data} | {k: getattr(each, k) for k in ("samples", "wrong", "flagged", "false")}
               for data, each in on.items()],
    }  # fmt: skip


def _member(one: MemberScores) -> dict[str, Any]:
    candidates = [_candidate(candidate) for candidate in one.candidates]
    return {"mapping": one.mapping, "unit": one.unit, "candidates": candidates}


def _candidate(one: CandidateScores) -> dict[str, Any]:
    return {
        "structure": one.candidate.member.structure.label,
        "seed": one.candidate.member.training.seed,
        "best_alone": one.best,
        "chosen": one.chosen,
        "selection": one.candidate.error,
        "free_run_mse": one.free_run,
        "run_time_s": one.run_time,
        "one_step": None if one.one_step is None else {"one_step_mse": one.one_step, "free_run_mse": one.closed},
    }


def _round(one: TrainedRound) -> dict[str, Any]:
    fit = one.fit
    return {
        "name": one.name,
        "trained": one.trained,
        "all_instances": one.shared,
        "measured": one.measured,
        "traces": one.traces,
        "iterations": one.iterations,
        "train_time_s": fit.train_time_s,
        "loss": one.loss,
        "selection_before": one.before,
        "selection_after": one.after,
        "status": fit.status.name,
        "attempts": [attempt.to_dict() for attempt in fit.attempts],
        "notes": [*fit.notes, *fit.told_of_equations],
    }


def _assessment(one: Assessment) -> dict[str, Any]:
    return {"within": one.within, "median": one.median, "p99": one.rare}


def _active_learning(learned: ActiveLearned, unseen: Mapping[str, Assessment]) -> dict[str, Any]:
    asked = learned.asked
    rounds = [
        {
            "number": one.number,
            "stage": one.stage,
            "added": one.added,
            "traces": one.traces,
            "samples": one.samples,
            "train_time_s": one.seconds,
            "held_out": _assessment(one.assessment),
            "monte_carlo": _assessment(unseen[one.stage]) if one.stage in unseen else None,
            "selection": one.score,
        }
        for one in learned.rounds
    ]
    return {
        "outputs": asked.outputs,
        "unit": learned.unit,
        "limit": asked.within,
        "aim": asked.until,
        "pick": asked.pick,
        "held_out": learned.held_out,
        "ended": learned.ended,
        "rounds": rounds,
    }


def _stress(one: MonteCarlo) -> dict[str, Any]:
    return {**asdict(one), "worst": [{"name": name, "rmse": error} for name, error in one.worst]}


def _holding(one: Holding) -> dict[str, Any]:
    activities = {"cases": _activity(one.cases), "sequences": _activity(one.sequences)}
    return {"output": one.output, "unit": one.unit, "low": one.low, "high": one.high, **activities}


def _activity(one: Activity | None) -> dict[str, Any] | None:
    return None if one is None else {name: getattr(one, name) for name in ("low", "high", "lost", "samples")}


def _line(scores: InterpolationScores) -> dict[str, Any]:
    return {
        "outputs": {
            name: {
                "positions": scores.positions[name].tolist(),
                "fitted": scores.seen[name].tolist(),
                "mse": {case: errors.tolist() for case, errors in by_case.items()},
            }
            for name, by_case in scores.mse.items()
        },
        "run_time_s": scores.timing,
    }


def _exports(bundle: Bundle) -> list[dict[str, Any]]:
    unit = ", ".join(sorted({str(output["unit"]) for output in bundle.outputs}))
    return [
        {
            "format": one.format,
            "file": f"{bundle.folder.name}/{one.name}",
            "largest_difference": one.largest_difference,
            "tolerance": one.tolerance,
            "unit": unit,
        }
        for one in bundle.files
    ]
