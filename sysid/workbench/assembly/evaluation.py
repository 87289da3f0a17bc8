"""What a trained assembly comes to: scored, proven, exported, reported and tracked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid.composite.active_learning import Assessment, sequence_errors
from sysid.composite.doubt.doubting import Doubting
from sysid.composite.doubt.figures import DoubtFigures, doubt_figures
from sysid.composite.doubt.monte_carlo import MonteCarlo, run_monte_carlo
from sysid.composite.keeper import Decision
from sysid.composite.limits_held import holding
from sysid.composite.training import TrainedComposite
from sysid.export.exporters import wanted_formats
from sysid.models import Cascade
from sysid.reporting.assembly.results import AssemblyResults
from sysid.traces import Trace, TraceSet
from sysid.validation import evaluate_cascade
from sysid.workbench.annotation import find_annotator
from sysid.workbench.assembly.ablation import ablations_of
from sysid.workbench.assembly.beside import Beside, Judged
from sysid.workbench.assembly.context import Context
from sysid.workbench.assembly.data import AssemblyData
from sysid.workbench.assembly.interpolation import (
    InterpolationScores,
    StoredInterpolation,
    score_interpolation,
)
from sysid.workbench.assembly.member_scores import score_candidates
from sysid.workbench.assembly.record import Outcome, assembly_results, write_signals
from sysid.workbench.runner import events
from sysid.workbench.runner.steps import Outlined, Step, Work
from sysid.workbench.runner.store import LINE, digest, strict, write_json

if TYPE_CHECKING:
    from sysid.export import Bundle
    from sysid.workbench.fits.shared_config import ExportConfig

ASSEMBLY = "assembly.json"
"""In the run folder: the chosen whole."""

SCORING = Outlined(name="scoring", title="Scoring every stage")
WHOLE = Outlined(name="assembly", title="Choosing the stage that does best", called="assembly")
MONTE_CARLO = Outlined(name="monte_carlo", title="Running the whole on random sequences")
INTERPOLATION = Outlined(name="interpolation", title="Running every position of the line")
DOUBT = Outlined(name="doubt", title="Finding where it does not know")
MEMBERS = Outlined(name="member-scores", title="Scoring the members alone")


def export_step(asked: ExportConfig) -> Outlined:
    """The step that exports the whole.

    Args:
        asked: What leaves the workbench.

    Returns:
        Its title names the formats.

    Raises:
        UserError: If a format cannot be written here.
    """
    return Outlined(name="export", title=f"Exporting the assembly as {wanted_formats(asked.formats)}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluating:
    """The end of one run.

    Args:
        context: The run.
        trained: What it has trained.
        beside: Who stands beside that.
        notes: Sentences on how that came about.
    """

    context: Context
    trained: TrainedComposite
    beside: Beside
    notes: tuple[str, ...]

    def results(self, cases: TraceSet, data: AssemblyData) -> AssemblyResults:
        """Score every stage, choose one, and prove and export it.

        Args:
            cases: The cases that are scored.
            data: What was trained on, and chooses.

        Returns:
            What is stored.
        """
        found = self._outcome(cases, data)
        write_signals(self.context.store.path, found, self.context.config.outputs, cases)
        refused = tuple(f"It is not exported: {one.summary}." for one in self.context.run.refused)
        notes = (*self.notes, *refused)
        return self.context.run.results(assembly_results(self.context, self.trained, found, cases, notes))

    def _outcome(self, cases: TraceSet, data: AssemblyData) -> Outcome:
        """Every stage scored, one chosen by the selection traces, proven and exported."""
        config = self.context.config
        judged = self.beside.judged(self.trained, data.data, config)
        scored = self._scored(cases, judged.stages)
        scores = scored["scores"]
        whole = self._chosen(judged)
        stressed, worst, sequences = self._stressed(whole)
        line = self._line(data)
        doubt = self._doubting()
        exported = self._export(whole, cases, evaluate_cascade(whole, cases), data, doubt)
        candidates = self.trained.candidates
        members = []
        if candidates is not None:
            members = self.context.compute(MEMBERS, lambda _: score_candidates(candidates, tuple(cases)))
        trained = {stage: scores[stage] for stage in self.trained.stages}
        return Outcome(
            whole=whole, stages=scores, judged=judged, timing=scored["timing"][judged.chosen], stressed=stressed,
            worst=worst, interpolation=line, unseen=self._unseen(sequences), exported=exported,
            holding=holding(whole, config.outputs, tuple(cases), sequences), members=members,
            ablation=ablations_of(trained, members, cases, config.ablation), doubt=doubt,
            doubt_on={} if doubt is None else self._doubted_on(doubt, cases, sequences),
        )  # fmt: skip

    def _scored(self, cases: TraceSet, stages: Mapping[str, Cascade]) -> dict[str, Any]:
        """Of every stage ``scores``, errors by output and case, and ``timing``, seconds of a run by case."""
        config = self.context.config

        def make(say: Callable[[str], None]) -> dict[str, Any]:
            scores, timing = {}, {}
            for stage, whole in stages.items():
                say(stage)
                evaluation = evaluate_cascade(whole, cases, outputs=config.outputs)
                scores[stage] = {name: evaluation.mse(name) for name in config.outputs}
                timing[stage] = {n: c.run_time_s for n, c in evaluation.outputs[config.outputs[0]].cases.items()}
            return {"scores": scores, "timing": timing}

        return self.context.decide(
            Decision(
                name=SCORING.name,
                title=SCORING.title,
                terms={
                    "stages": {stage: whole.to_dict() for stage, whole in stages.items()},
                    "cases": cases.digest,
                    "outputs": list(config.outputs),
                },
                runs=(evaluate_cascade, *{type(one) for whole in stages.values() for one in whole.models}),
                make=make,
                outcome=lambda _: f"{len(stages)} stages",
            )
        )

    def _chosen(self, judged: Judged) -> Cascade:
        """What a run leaves: the whole that does best, or the mean of it and others."""
        whole = judged.stages[judged.chosen]
        file, key = self.context.store.path / ASSEMBLY, digest(strict(whole.to_dict()))

        def write(found: Cascade) -> list[Path]:
            write_json(file, found.to_dict())
            return [file]

        step = Step(
            name=WHOLE.name,
            title=WHOLE.title,
            make=lambda _: whole,
            key=lambda: key,
            write=write,
            read=lambda _: whole,
            outcome=lambda _: judged.chosen,
            called=WHOLE.called,
            export=self.context.export,
        )
        return self.context.run.do(step).value

    def _stressed(self, whole: Cascade) -> tuple[MonteCarlo | None, tuple[Trace, ...], tuple[Trace, ...]]:
        """What came of the random sequences, those that the whole did worst on, and all of them."""
        asked = self.context.config.monte_carlo
        if asked is None:
            return None, (), ()
        annotator = None if asked.states is None else find_annotator(asked.states, where="monte_carlo, states")
        sequences = self.context.load(asked.data)

        def make(work: Work) -> MonteCarlo:
            def report(done: int) -> None:
                work.say(f"{done} of {len(sequences)}", done / len(sequences))

            return run_monte_carlo(whole, tuple(sequences), asked.output, asked.within, report, annotator=annotator)

        found = self.context.compute(
            MONTE_CARLO,
            make,
            outcome=lambda one: f"{one.lost} of {one.sequences} diverged, {100 * one.within:.3g} % within",
        )
        return found, tuple(sequences[name] for name, _ in found.worst), tuple(sequences)

    def _unseen(self, sequences: Sequence[Trace]) -> dict[str, Assessment]:
        """Every round of active learning on the random sequences, which had no say in anything."""
        asked, stages = self.context.config.monte_carlo, self.trained.stages
        rounds = (
            [] if self.trained.active_learning is None else [one.stage for one in self.trained.active_learning.rounds]
        )
        if asked is None or not rounds:
            return {}
        wholes = {stage: stages[stage].upstream_of([asked.output]) for stage in rounds}
        return {
            stage: Assessment.at(sequence_errors(whole, sequences, [asked.output]), asked.within)
            for stage, whole in wholes.items()
        }

    def _line(self, data: AssemblyData) -> InterpolationScores | None:
        asked = self.context.config.interpolation
        if asked is None:
            return None
        line, cases = self.beside.line(asked, self.trained.model), self.context.load(asked.data)
        stored = StoredInterpolation.of(asked, line, next(iter(cases)), data.data.estimation)
        write_json(self.context.store.path / LINE, stored.to_dict())
        return self.context.compute(
            INTERPOLATION,
            lambda _: score_interpolation(asked, line, cases),
            outcome=lambda scores: f"all positions of the longest case in {max(scores.timing.values()):.3g} s",
        )

    def _doubting(self) -> Doubting | None:
        """What answers with its doubts, if it is to have some."""
        asked = self.context.config.doubt
        if asked is None:
            return None
        sequences = tuple(self.context.load(asked.data))
        whole = self.trained.model.upstream_of(self.context.config.wanted)
        return self.context.compute(
            DOUBT, lambda _: self.beside.doubts(whole, asked, sequences), outcome=lambda one: one.sentence
        )

    def _doubted_on(self, doubt: Doubting, cases: TraceSet, sequences: Sequence[Trace]) -> dict[str, DoubtFigures]:
        """What the flag is worth, by the data: where its threshold was found, and where nothing of it was."""
        config, found = self.context.config, {}
        if (asked := config.doubt) is None:
            return {}
        beside = {config.data: tuple(cases)} if asked.output in config.outputs else {}
        if config.monte_carlo is not None and config.monte_carlo.output == asked.output:
            beside[config.monte_carlo.data] = tuple(sequences)
        for name, traces in beside.items():
            found[name] = doubt_figures(doubt.whole, traces, asked.output, error=asked.error)
        return {asked.data: doubt.figures} | {name: one for name, one in found.items() if name != asked.data}

    def _export(
        self, whole: Cascade, cases: TraceSet, evaluation: Any, data: AssemblyData, doubt: Doubting | None
    ) -> Bundle | None:
        from sysid.export import export_bundle

        asked = self.context.config.export
        if asked is None:
            return None
        formats = wanted_formats(asked.formats).names
        provenance = {
            "pipeline": self.context.config.name,
            "command": self.context.run.command,
            "training": {
                "fitted": [self._data(name) for name in data.fitted],
                "chosen": [self._data(name) for name in data.chosen],
                "notes": list(self.notes),
            },
            **({} if doubt is None else {"doubt": doubt.sentence}),
            **({"mean": said} if (said := self.beside.sentence()) else {}),
        }
        exported = whole if doubt is None else doubt.whole

        def make(_: Work) -> Bundle:
            return export_bundle(
                exported, cases, self.context.store.bundle, outputs=self.context.config.leaving,
                formats=formats, tolerance=asked.tolerance, metrics=evaluation, provenance=provenance,
            )  # fmt: skip

        def outcome(bundle: Bundle) -> str:
            worst = max((entry.largest_difference for entry in bundle.files), default=0.0)
            return f"{len(bundle.files)} files, at most {worst:.1e} off"

        step = export_step(asked)
        done = self.context.run.export(Step(name=step.name, title=step.title, make=make, outcome=outcome))
        return None if done is None else done.value

    def _data(self, name: str) -> dict[str, str]:
        return {"name": name, "sha256": self.context.digests[name]}

    def track(self, results: AssemblyResults, page: Path) -> None:
        """Have each stage tracked as a run of its own, its figures beside the others'.

        Args:
            results: What is reported.
            page: The report.
        """
        chosen = results.whole.stage
        for stage, metrics in results.metrics().items():
            self.context.run.tell(
                events.JudgementReady(
                    pipeline=self.context.config.name,
                    subject=stage,
                    digest=digest(strict({"stage": stage, "metrics": metrics, "chosen": stage == chosen})),
                    metrics=metrics,
                    fit_keys=(),
                    tracked_as=(),
                    page=page,
                    document=self.context.store.results,
                    command=self.context.run.command,
                    chosen=stage == chosen,
                )
            )
