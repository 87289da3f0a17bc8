"""A run of a pipeline that judges: models loaded, steps done or found again, figures, report, tracking."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sysid.errors import ConfigError
from sysid.reporting.judging.results import FOLDER, JudgementResults, SubjectRecord, parse_judgement
from sysid.reporting.judging.tables import judgement_headline
from sysid.reporting.kinds import read_run
from sysid.reporting.records import RESULTS_FILE, DataSetRecord, RunResults, write_record
from sysid.workbench.judging.config import JudgementConfig
from sysid.workbench.judging.judge import Judge, find_judge
from sysid.workbench.judging.sources import Fetch, Found, find_model
from sysid.workbench.kinds import RunRequest
from sysid.workbench.runner.environment import environment
from sysid.workbench.runner.events import Event, JudgementReady, StepDone, StepStarted, Warned, Watcher
from sysid.workbench.runner.kept_steps import do_steps
from sysid.workbench.runner.naming import nearby, slug
from sysid.workbench.runner.store import RunFolder, digest, strict, write_bytes, write_json
from sysid.yaml_files import check, read_yaml


def run_judgement(request: RunRequest) -> int:
    """Run a pipeline that judges.

    Args:
        request: What was asked.

    Returns:
        Exit code: 0, or 1 if everything is done and stored but something could not be tracked.

    Raises:
        UserError: If the pipeline, a model or an option cannot be used.
    """
    from sysid.workbench.runner.listeners import Audience, typed_command
    from sysid.workbench.tracking.mlflow_store import fetch_bundle, store_uri

    config = check(JudgementConfig, read_yaml(request.path), where=request.path)
    folder = (request.out or Path("runs") / config.name).resolve()
    command, audience = typed_command("run", request.typed, request.out), Audience.of(tracking=request.tracking)
    audience.log.write_to(folder, command)
    run = _Run(
        config=config,
        text=request.path.read_bytes(),
        judge=find_judge(config.kind, where=request.path),
        where=request.path,
        store=RunFolder(path=folder),
        command=command,
        fresh=request.fresh,
        watchers=audience.watchers,
        fetch=lambda address: fetch_bundle(store_uri(Path.cwd()), address, folder / "models"),
    )
    try:
        with run.store.locked():
            results, page = run.all()
    finally:
        audience.screen.close()
    audience.target.print()
    audience.target.print(judgement_headline(results.judgement), soft_wrap=True)
    return audience.end({"Report": nearby(page), "Results": nearby(run.store.results)})


@dataclass(frozen=True, kw_only=True, eq=False)
class _Run:
    """One run: what its steps have in common."""

    config: JudgementConfig
    text: bytes
    judge: Judge
    where: Path
    store: RunFolder
    command: str
    fresh: bool
    watchers: Sequence[Watcher]
    fetch: Fetch
    environment: Mapping[str, Any] = field(default_factory=environment)

    def all(self) -> tuple[JudgementResults, Path]:
        """Every step, in order; the results and the page."""
        write_bytes(self.store.path / "pipeline.yaml", self.text)
        write_json(self.store.path / "environment.json", self.environment)
        options = check(self.judge.options, self.config.options, where=f"{self.where}, options")
        found = self._find()
        subjects = {
            subject.name: [
                (one.model, part.options) for one, part in zip(found[subject.name], subject.parts, strict=True)
            ]
            for subject in self.config.subjects
        }
        done = do_steps(
            self.judge.steps(options, subjects),
            title="Judging",
            version=self.judge.version,
            store=self.store,
            fresh=self.fresh,
            tell=self._tell,
        )
        figures = self.judge.document(options, subjects, done)
        results = self._results(found, strict(figures))
        page = self._report(results, found)
        self._track(results, found, page)
        return results, page

    def _tell(self, event: Event) -> None:
        for watch in self.watchers:
            watch(event)

    def _find(self) -> dict[str, list[Found]]:
        step = "Loading the models"
        self._tell(StepStarted(step=step))
        found = {}
        for subject in self.config.subjects:
            for part in subject.parts:
                check(self.judge.part_options, part.options, where=f"{self.where}, {subject.name}, options")
            found[subject.name] = [find_model(part, workspace=Path.cwd(), fetch=self.fetch) for part in subject.parts]
        self._tell(StepDone(step=step, stored=False, detail=", ".join(found)))
        return found

    def _results(self, found: Mapping[str, Sequence[Found]], figures: Any) -> JudgementResults:
        results = JudgementResults(
            kind=self.config.kind,
            pipeline=self.config.name,
            description=self.config.description,
            command=self.command,
            created=time.strftime("%Y-%m-%dT%H:%M:%S%z"),
            environment=dict(self.environment),
            data=DataSetRecord(name=f"of the judge {self.config.kind}"),
            subjects=[SubjectRecord(name=name, parts=[one.said for one in parts]) for name, parts in found.items()],
            judgement=parse_judgement(figures, where=f"judge {self.config.kind}"),
        )
        before = _stored(self.store.path)
        if isinstance(before, JudgementResults) and _undated(before) == _undated(results):
            # Nothing is new, so that what was made then keeps its date.
            return before
        write_record(self.store.path / RESULTS_FILE, results)
        return results

    def _report(self, results: JudgementResults, found: Mapping[str, Sequence[Found]]) -> Path:
        from sysid.reporting.report import write_report

        step = "Writing the report"
        self._tell(StepStarted(step=step))
        page = write_report(self.store.path)
        folders = dict.fromkeys(one.run_folder for parts in found.values() for one in parts if one.run_folder)
        for folder in folders:
            # With the fits that were judged, so that their own report shows it too.
            write_json(folder / FOLDER / f"{slug(self.config.name)}.json", results.judgement.model_dump(mode="json"))
            try:
                write_report(folder)
            except ConfigError as error:
                self._tell(Warned(text=f"the report of {folder} is not written again: {error.what}"))
        self._tell(StepDone(step=step, stored=False, detail=str(nearby(page))))
        return page

    def _track(self, results: JudgementResults, found: Mapping[str, Sequence[Found]], page: Path) -> None:
        for subject, metrics in results.judgement.metrics().items():
            parts = found[subject]
            self._tell(
                JudgementReady(
                    pipeline=self.config.name,
                    subject=subject,
                    digest=digest(strict({"metrics": metrics, "title": results.judgement.title})),
                    metrics=metrics,
                    fit_keys=tuple(one.fit_key for one in parts if one.fit_key),
                    tracked_as=tuple(one.tracked_as for one in parts if one.tracked_as),
                    page=page,
                    document=self.store.results,
                    command=self.command,
                )
            )


def _stored(folder: Path) -> RunResults | None:
    try:
        return read_run(folder)
    except ConfigError:
        # None yet, damaged, or of another release: written anew.
        return None


def _undated(results: JudgementResults) -> str:
    return results.model_copy(update={"created": ""}).model_dump_json()
