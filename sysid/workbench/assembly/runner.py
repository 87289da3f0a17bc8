"""A run of an assembly: every fit and every stage on disk before it is announced, and found again."""

from __future__ import annotations

import shlex
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sysid.content import content_folders
from sysid.errors import ConfigError
from sysid.estimation import CascadeFit, FitProgress, FitResult
from sysid.models import Cascade, NARXModel, cascade_from_dict
from sysid.reporting.judgement import parse_judgement
from sysid.reporting.judgement_report import (
    JudgementResults,
    SceneRecord,
    SubjectRecord,
    write_judgement_results,
)
from sysid.traces import Role, Trace, TraceSet
from sysid.validation import evaluate_cascade
from sysid.workbench import events
from sysid.workbench.annotation import find_annotator
from sysid.workbench.assembly.config import AssemblyConfig, MemberConfig
from sysid.workbench.assembly.document import Outcome, document
from sysid.workbench.assembly.growth import Growth, Round, grow
from sysid.workbench.assembly.line import LineScores, StoredLine, line_of, score_line
from sysid.workbench.assembly.members import Members, assembled, own_traces, whole_score, written
from sysid.workbench.assembly.stages import choose_together, fit_member, model_of, retrain, train_together
from sysid.workbench.assembly.stress import Stress, stress
from sysid.workbench.environment import environment
from sysid.workbench.kinds import RunRequest
from sysid.workbench.record import is_final, read_fit, write_fit
from sysid.workbench.store import RunFolder, code_digest, digest, read_json, strict, write_bytes, write_json
from sysid.yaml_files import check, read_yaml

ALONE, CHOSEN, RETRAINED = "each alone", "chosen together", "retrained"
LINE = "line.json"
GROWN, TOGETHER = "grown", "trained end to end"


def run_assembly(request: RunRequest) -> int:
    """Run a pipeline of kind ``assembly``.

    Args:
        request: What was asked.

    Returns:
        Exit code: 0, or 1 if everything is done and stored but something could not be tracked.

    Raises:
        UserError: If the pipeline or its data cannot be used.
    """
    from sysid.workbench.commands.run import console
    from sysid.workbench.screen import LogFile, Screen
    from sysid.workbench.tracking import Tracker

    config = check(AssemblyConfig, read_yaml(request.path), where=request.path)
    folder = (request.out or Path("runs") / config.name).resolve()
    command = shlex.join(["sysid", "run", request.typed, *(["--out", str(request.out)] if request.out else [])])
    target = console()
    screen, log = Screen(target), LogFile()
    log.write_to(folder, command)

    def warn(text: str) -> None:
        for watch in (screen, log):
            watch(events.Warned(text=text))

    tracker = Tracker.of_workspace(Path.cwd(), warn) if request.tracking else None
    run = _Run(
        config=config,
        text=request.path.read_bytes(),
        beside=request.path.parent,
        store=RunFolder(path=folder),
        command=command,
        fresh=request.fresh,
        watchers=(screen, log, *([tracker] if tracker else [])),
    )
    try:
        with run.store.locked():
            results, page = run.all()
    finally:
        screen.close()
    target.print()
    target.print(results.judgement.headline, soft_wrap=True)
    target.print(f"Report:  {page}\nResults: {run.store.results}", soft_wrap=True)
    if tracker is not None and tracker.failures:
        target.print(
            "Everything above is done and stored, but not all of it is tracked in MLflow; run it again to retry."
        )
        return 1
    return 0


@dataclass(frozen=True, kw_only=True, eq=False)
class _Run:
    """One run: what its steps have in common."""

    config: AssemblyConfig
    text: bytes
    beside: Path
    store: RunFolder
    command: str
    fresh: bool
    watchers: Sequence[events.Watcher]
    notes: list[str] = field(default_factory=list)
    stages: dict[str, Cascade] = field(default_factory=dict)
    """The whole after each stage."""
    growth: list[Growth] = field(default_factory=list)
    """What growing the training data brought, where it was asked for."""
    digests: dict[str, str] = field(default_factory=dict)
    """SHA-256 of every data set that was read, by name."""

    def all(self) -> tuple[JudgementResults, Path]:
        """Every step, in order; the results and the page."""
        write_bytes(self.store.path / "pipeline.yaml", self.text)
        write_json(self.store.path / "environment.json", environment())
        cases = self._load(self.config.data)
        training = self._load(self.config.training)
        estimation, selection = training.with_role(Role.ESTIMATION), training.with_role(Role.SELECTION)
        if self.config.selection is not None:
            selection = (*selection, *self._load(self.config.selection).with_role(Role.SELECTION))
        if not estimation or not selection:
            raise _lacks_a_role(training, "the training data lack a role")
        models, key = self._members(estimation, selection)
        models, key = self._retrained(models, key, estimation, selection)
        models, key = self._grown(models, key, estimation, selection)
        self._together(models, key, estimation, selection)
        results = self._results(cases, selection)
        page = self._report()
        self._track(results, page)
        return results, page

    def _tell(self, event: events.Event) -> None:
        for watch in self.watchers:
            watch(event)

    def _load(self, name: str) -> TraceSet:
        from sysid.ingest import load_dataset

        step, local = f"Loading {name}", self.beside / name
        self._tell(events.StepStarted(step=step))
        loaded = load_dataset(
            local if local.exists() else name,
            search=(self.beside.parent / "datasets", *content_folders("datasets")),
            progress=lambda case, index, count: self._tell(
                events.StepProgress(step=step, fraction=index / count, detail=f"{case} ({index + 1} of {count})")
            ),
        )
        self._tell(events.StepDone(step=step, stored=False, detail=f"{len(loaded)} traces"))
        self.digests[loaded.name] = loaded.digest
        return loaded

    def _fit(
        self,
        name: str,
        title: str,
        terms: Mapping[str, Any],
        work: Callable[[Callable[[FitProgress], None]], FitResult],
    ) -> tuple[FitResult, str]:
        """A fit that is stored under what it depends on; and that key."""
        key = digest(strict({"code": code_digest("estimation", "models", "kernels"), "terms": dict(terms)}))
        folder = self.store.fit(name)
        self._tell(events.StepStarted(step=title))
        stored = not self.fresh and self.store.is_done(f"fit-{name}", key)
        if stored:
            fit = read_fit(folder)
        else:
            fit = work(self._reporter(title))
            files = write_fit(folder, fit)
            if is_final(fit):
                self.store.mark_done(f"fit-{name}", key, files)
        self._tell(events.StepDone(step=title, stored=stored, detail=f"{fit.train_time_s:.1f} s, {fit.status.value}"))
        return fit, key

    def _reporter(self, step: str) -> Callable[[FitProgress], None]:
        def report(entry: FitProgress) -> None:
            detail = f"start {entry.start} of {entry.starts}, {entry.stage}, iteration {entry.iteration}"
            self._tell(events.StepProgress(step=step, fraction=entry.fraction, detail=f"{detail}, mse {entry.mse:.3g}"))

        return report

    def _members(self, estimation: Sequence[Trace], selection: Sequence[Trace]) -> tuple[Members, str]:
        """Every member's candidates; the best of each alone, and those that are best together."""
        candidates, alone, keys = {}, {}, []
        data = [trace.digest for trace in (*estimation, *selection)]
        for member in self.config.members:
            fits = []
            for number in range(member.candidates):
                seed = self.config.seed + 1000 * number
                fit, key = self._fit(
                    f"{member.slug}-{number}",
                    f"Fitting {member.mapping}, candidate {number + 1} of {member.candidates}",
                    {"member": member.model_dump(mode="json", exclude={"candidates"}), "seed": seed, "data": data},
                    partial(fit_member, member, estimation, selection, seed=seed),
                )
                fits.append(model_of(fit))
                keys.append(key)
            candidates[member.mapping.output] = fits
            alone[member.mapping.output] = int(np.argmin([self._alone(member, fit, selection) for fit in fits]))
        self.stages[ALONE] = assembled(self.config, {name: models[alone[name]] for name, models in candidates.items()})
        if max(map(len, candidates.values())) > 1:
            step = "Choosing the members by the error of the whole"
            self._tell(events.StepStarted(step=step))
            choice = choose_together(
                self.config,
                candidates,
                alone,
                selection,
                report=lambda text: self._tell(events.StepProgress(step=step, fraction=None, detail=text)),
            )
            self._tell(
                events.StepDone(step=step, stored=False, detail=f"{choice.tried} wholes, best {choice.score:.3g}")
            )
            changed = [name for name in alone if choice.members[name] != alone[name]]
            self.notes.append(
                f"Of {choice.tried} wholes tried, the best has another {', '.join(changed)} than the best alone."
                if changed
                else f"Of {choice.tried} wholes tried, none beats the one of the members that are best alone."
            )
            alone = choice.members
            self.stages[CHOSEN] = assembled(
                self.config, {name: models[alone[name]] for name, models in candidates.items()}
            )
        return {name: models[alone[name]] for name, models in candidates.items()}, digest(strict([keys, alone]))

    def _alone(self, member: MemberConfig, model: Any, selection: Sequence[Trace]) -> float:
        errors = [
            float(np.mean((model.simulate(t.columns(model.mapping.inputs)) - t[model.mapping.output]) ** 2))
            for t in own_traces(member, selection)
        ]
        return float(np.exp(np.mean(np.log(np.maximum(errors, np.finfo(np.float64).tiny)))))

    def _retrained(
        self, models: Members, key: str, estimation: Sequence[Trace], selection: Sequence[Trace]
    ) -> tuple[Members, str]:
        asked = self.config.retrain
        if asked is None:
            return models, key
        outputs = self.config.choose_on or self.config.outputs
        best = whole_score(assembled(self.config, models), selection, outputs)
        members = {member.mapping.output: member for member in self.config.members}
        for number in range(asked.rounds):
            for name in asked.members:
                member = members[name]
                fit, key = self._fit(
                    f"{member.slug}-retrained-{number}",
                    f"Retraining {member.mapping} on what the others put out, round {number + 1}",
                    {"before": key, "member": name, "iterations": asked.max_iterations},
                    partial(
                        retrain,
                        self.config,
                        member,
                        models,
                        estimation=estimation,
                        selection=selection,
                        max_iterations=asked.max_iterations,
                    ),
                )
                changed = {**models, name: model_of(fit)}
                score = whole_score(assembled(self.config, changed), selection, outputs)
                verdict = "kept" if score < best else "not kept"
                self.notes.append(
                    f"{name} retrained on what the others put out (round {number + 1}): the whole's error on the "
                    f"selection traces goes from {best:.3g} to {score:.3g}; {verdict}."
                )
                if score < best:
                    models, best = changed, score
        self.stages[RETRAINED] = assembled(self.config, models)
        return models, key

    def _grown(
        self, models: Members, key: str, estimation: Sequence[Trace], selection: Sequence[Trace]
    ) -> tuple[Members, str]:
        asked = self.config.grow
        if asked is None:
            return models, key
        pool = self._load(asked.data)
        sources, held_out = pool.with_role(Role.ESTIMATION), pool.with_role(Role.SELECTION)
        if not sources or not held_out:
            raise _lacks_a_role(pool, "the pool lacks a role")

        def fit(
            member: MemberConfig, now: Members, traces: Sequence[Trace], number: int, before: str
        ) -> tuple[NARXModel, str]:
            found, own = self._fit(
                f"{member.slug}-grown-{number}",
                f"Training {member.mapping} on {len(traces)} traces, round {number}",
                {
                    "before": before, "member": member.mapping.output, "iterations": asked.max_iterations,
                    "data": [trace.digest for trace in traces],
                },
                partial(
                    retrain, self.config, member, now, estimation=traces, selection=selection,
                    max_iterations=asked.max_iterations,
                ),
            )  # fmt: skip
            return model_of(found), own

        def report(done: Round) -> None:
            step = f"Looking for the sequences that the whole is worst at, after round {done.number}"
            detail = f"{100.0 * done.look.within:.3g} % within, 99 % under {done.look.rare:.3g}, {done.samples} samples"
            self._tell(events.StepStarted(step=step))
            self._tell(events.StepDone(step=step, stored=False, detail=detail))

        grown = grow(
            self.config, models, key, fit, estimation=estimation, selection=selection, pool=sources,
            held_out=held_out, report=report,
        )  # fmt: skip
        self.growth.append(grown)
        self.notes.append(grown.sentence)
        self.stages[GROWN] = assembled(self.config, grown.models)
        return grown.models, grown.key

    def _together(self, models: Members, key: str, estimation: Sequence[Trace], selection: Sequence[Trace]) -> None:
        if self.config.together is None:
            return
        step = "Training end to end"
        name = "together"
        terms = {
            "code": code_digest("estimation", "models", "kernels"),
            "before": key,
            "together": self.config.together.model_dump(mode="json"),
            "start": assembled(self.config, models).to_dict(),
        }
        whole_key, file = digest(strict(terms)), self.store.path / "together.json"
        self._tell(events.StepStarted(step=step))
        stored = not self.fresh and self.store.is_done(name, whole_key)
        if stored:
            fit = CascadeFit.from_dict(read_json(file))
        else:
            fit = train_together(
                self.config, assembled(self.config, models), estimation, selection, self._reporter(step)
            )
            write_json(file, fit.to_dict())
            self.store.mark_done(name, whole_key, [file])
        self._tell(events.StepDone(step=step, stored=stored, detail=f"{fit.train_time_s:.1f} s, {fit.status.value}"))
        self.notes.extend(fit.notes)
        self.stages[TOGETHER] = fit.model

    def _results(self, cases: TraceSet, selection: Sequence[Trace]) -> JudgementResults:
        config = self.config
        outputs = config.choose_on or config.outputs
        scores, timing, chosen_by = {}, {}, {}
        for stage, cascade in self.stages.items():
            evaluation = evaluate_cascade(cascade, cases, outputs=config.outputs)
            scores[stage] = {name: evaluation.mse(name) for name in config.outputs}
            timing[stage] = {n: c.run_time_s for n, c in evaluation.outputs[config.outputs[0]].cases.items()}
            chosen_by[stage] = whole_score(cascade, selection, outputs)
        chosen = min(chosen_by, key=lambda stage: chosen_by[stage])
        whole = self.stages[chosen]
        write_json(self.store.path / "assembly.json", whole.to_dict())
        stressed, worst = self._stressed(whole)
        line = self._line(whole)
        self._export(whole, cases, evaluate_cascade(whole, cases))
        said = document(
            config,
            Outcome(
                whole=whole, stages=scores, selection=chosen_by, chosen=chosen, notes=self.notes,
                timing=timing[chosen], cases=tuple(cases), stressed=stressed, worst=worst, growth=tuple(self.growth),
                line=line,
            ),
        )  # fmt: skip
        results = JudgementResults(
            kind=config.kind,
            pipeline=config.name,
            description=config.description,
            command=self.command,
            created=time.strftime("%Y-%m-%dT%H:%M:%S%z"),
            environment=dict(environment()),
            seed=config.seed,
            data=SceneRecord(
                name=cases.name,
                digest=cases.digest,
                others={name: found for name, found in self.digests.items() if name != cases.name},
            ),
            subjects=[SubjectRecord(name=stage, parts=written(cascade)) for stage, cascade in self.stages.items()],
            judgement=parse_judgement(strict(said), where="assembly"),
        )
        write_judgement_results(self.store.path, results)
        return results

    def _stressed(self, whole: Cascade) -> tuple[Stress | None, tuple[Trace, ...]]:
        """What came of the random sequences, and those that the whole did worst on."""
        asked = self.config.stress
        if asked is None:
            return None, ()
        annotator = None if asked.states is None else find_annotator(asked.states, where="stress, states")
        step, sequences = "Running the whole on random sequences", self._load(asked.data)
        self._tell(events.StepStarted(step=step))
        found = stress(whole, tuple(sequences), asked.output, asked.within, annotator=annotator)
        detail = f"{found.lost} of {found.sequences} diverged, {100 * found.within:.3g} % within"
        self._tell(events.StepDone(step=step, stored=False, detail=detail))
        return found, tuple(sequences[name] for name, _ in found.worst)

    def _line(self, whole: Cascade) -> LineScores | None:
        asked = self.config.line
        if asked is None:
            return None
        line, cases, step = line_of(asked, whole), self._load(asked.data), "Running every place of the line"
        write_json(self.store.path / LINE, StoredLine.of(asked, line, next(iter(cases))).to_dict())
        self._tell(events.StepStarted(step=step))
        scores = score_line(asked, line, cases)
        slowest = max(scores.timing.values())
        self._tell(
            events.StepDone(step=step, stored=False, detail=f"all places of the longest case in {slowest:.3g} s")
        )
        return scores

    def _export(self, whole: Cascade, cases: TraceSet, evaluation: Any) -> None:
        from sysid.export import export_bundle

        asked, step = self.config.export, "Exporting the assembly"
        if asked is None:
            return
        self._tell(events.StepStarted(step=step))
        provenance = {"pipeline": self.config.name, "command": self.command}
        bundle = export_bundle(
            whole, cases, self.store.path / "bundle", formats=asked.formats, tolerance=asked.tolerance,
            metrics=evaluation, provenance=provenance,
        )  # fmt: skip
        worst = max((entry.largest_difference for entry in bundle.files), default=0.0)
        self._tell(
            events.StepDone(step=step, stored=False, detail=f"{len(bundle.files)} files, at most {worst:.1e} off")
        )

    def _report(self) -> Path:
        from sysid.reporting.report import write_report

        step = "Writing the report"
        self._tell(events.StepStarted(step=step))
        page = write_report(self.store.path)
        self._tell(events.StepDone(step=step, stored=False, detail=str(page)))
        return page

    def _track(self, results: JudgementResults, page: Path) -> None:
        """Each stage as a run of its own, its figures beside the others'."""
        for stage, metrics in results.judgement.metrics.items():
            self._tell(
                events.JudgementReady(
                    kind=self.config.kind,
                    pipeline=self.config.name,
                    subject=stage,
                    digest=digest(strict({"pipeline": self.config.name, "stage": stage, "metrics": metrics})),
                    metrics=metrics,
                    fit_keys=(),
                    tracked_as=(),
                    page=page,
                    document=self.store.results,
                    command=self.command,
                )
            )


def _lacks_a_role(found: TraceSet, what: str) -> ConfigError:
    return ConfigError(
        what,
        where=f"data set {found.name}",
        expected="cases with role: estimation, and cases with role: selection",
        got=", ".join(f"{name}: {role.value}" for name, role in found.roles.items()),
        remedy="give some cases that role in the data set's dataset.yaml",
    )


def read_assembly(folder: Path) -> Cascade:
    """The assembly that a run chose.

    Args:
        folder: Its run folder.

    Returns:
        The cascade.

    Raises:
        ConfigError: If the run has not come so far.
    """
    return cascade_from_dict(_left(folder, "assembly.json", "the run has no assembly"))


def read_line(folder: Path) -> StoredLine:
    """The line that a run left: every place between those that it modelled.

    Args:
        folder: Its run folder.

    Returns:
        The line, with its channels.

    Raises:
        ConfigError: If the run has not come so far, or its pipeline has no ``line``.
    """
    return StoredLine.from_dict(_left(folder, LINE, "the run has no line"))


def _left(folder: Path, name: str, what: str) -> Any:
    file = Path(folder) / name
    if not file.is_file():
        raise ConfigError(
            what,
            where=folder,
            expected=f"{name}, which a finished run of kind assembly leaves",
            got="no such file",
            remedy="let the pipeline finish: sysid run NAME",
        )
    return read_json(file)
