"""A pipeline that judges, as steps: models loaded, the judge's steps kept by their content, figures, report."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.names import slug
from sysid.plugins import find_plugin
from sysid.reporting.judging.results import FOLDER, JudgementResults, SubjectRecord, parse_judgement
from sysid.reporting.judging.tables import judgement_headline
from sysid.reporting.records import DataSetRecord
from sysid.workbench.judging.config import JudgementConfig
from sysid.workbench.judging.judge import GROUP, Judge
from sysid.workbench.judging.sources import Found, find_model, run_folder_of
from sysid.workbench.runner.events import JudgementReady, Warned
from sysid.workbench.runner.kept_steps import kept_steps
from sysid.workbench.runner.naming import nearby
from sysid.workbench.runner.program import Closing, Program
from sysid.workbench.runner.run import REPORT, Run
from sysid.workbench.runner.steps import NOT_KNOWN, Estimate, Outlined, Step, Work
from sysid.workbench.runner.store import digest, strict, write_json
from sysid.workbench.written import Written

if TYPE_CHECKING:
    from sysid.workbench.kinds import RunRequest

TITLE = "Judging"
LOADING = Outlined(name="models", title="Loading the models")
Subjects = Mapping[str, Sequence[Found]]
"""The models by what is judged."""


def program(request: RunRequest) -> Program[JudgementResults]:
    """What ``sysid run`` does of a pipeline that judges.

    Args:
        request: What was asked.

    Returns:
        The program.

    Raises:
        UserError: If the pipeline or an option cannot be used.
    """
    written = Written.read(JudgementConfig, request.path)
    config = written.config
    judge: Judge = find_plugin(GROUP, config.kind, what="judge", where=request.path)
    for subject in config.subjects:
        for part in subject.parts:
            check(judge.part_options, part.options, where=f"{request.path}, {subject.name}, options")
    options = check(judge.options, config.options, where=f"{request.path}, options")
    work = _Judging(config=config, judge=judge, options=options)
    return Program(
        name=config.name,
        keep=written.keep,
        steps=work.run,
        outline=lambda: [LOADING, Outlined(name=TITLE, title=TITLE), REPORT],
        closing=lambda results, folder: closing(judgement_headline(results.judgement), folder),
    )


def closing(headline: str, folder: Path) -> Closing:
    """What is said at the end of a judgement, and of whatever else is told in a sentence.

    Args:
        headline: The sentence.
        folder: The run folder.

    Returns:
        The lines and files.
    """
    page, results = (nearby(folder.resolve() / file) for file in ("report/index.html", "results.json"))
    return Closing(lines=[headline], files={"Report": page, "Results": results})


@dataclass(frozen=True, kw_only=True, eq=False)
class _Judging:
    """The steps of one pipeline."""

    config: JudgementConfig
    judge: Judge
    options: Any

    def run(self, run: Run) -> JudgementResults:
        """Every step, in order."""
        found = run.do(self._loading(run)).value
        subjects = {
            subject.name: [
                (one.model, part.options, one.ranges)
                for one, part in zip(found[subject.name], subject.parts, strict=True)
            ]
            for subject in self.config.subjects
        }
        asked = self.judge.steps(self.options, subjects)
        done = run.do_all(TITLE, kept_steps(asked, title=TITLE, version=self.judge.version, store=run.store))
        answers = {step.name: one.value for step, one in zip(asked, done, strict=True)}
        results = self._results(run, found, strict(self.judge.document(self.options, subjects, answers)))
        page = run.report(results)
        run.then(lambda: self._with_what_was_judged(run, results, found))
        run.then(lambda: self._track(run, results, found, page.value))
        return results

    def _loading(self, run: Run) -> Step[Subjects]:
        def fetch(address: str) -> tuple[Path, str]:
            from sysid.workbench.tracking.mlflow_store import fetch_bundle, store_uri

            return fetch_bundle(store_uri(Path.cwd()), address, run.store.path / "models")

        def make(_: Work) -> Subjects:
            return {
                subject.name: [find_model(part, workspace=Path.cwd(), fetch=fetch) for part in subject.parts]
                for subject in self.config.subjects
            }

        return Step(
            name=LOADING.name,
            title=LOADING.title,
            make=make,
            outcome=", ".join,
            at_hand=lambda: self._lacking() is None,
            how_long=lambda: self._lacking() or NOT_KNOWN,
        )

    def _lacking(self) -> Estimate | None:
        """What has to be there before the models can be loaded; ``None`` if it is."""
        parts = [part for subject in self.config.subjects for part in subject.parts]
        if any(part.model is not None for part in parts):
            return NOT_KNOWN
        asked = dict.fromkeys(str(part.run) for part in parts if part.run is not None)
        missing = [name for name in asked if not (run_folder_of(name, Path.cwd()) / "results.json").is_file()]
        if not missing:
            return None
        commands = ", ".join(f"sysid run {Path(name).name}" for name in missing)
        return Estimate(seconds=None, basis=f"not known before they are there: {commands}")

    def _results(self, run: Run, found: Subjects, figures: Any) -> JudgementResults:
        results = JudgementResults(
            kind=self.config.kind,
            pipeline=self.config.name,
            description=self.config.description,
            command=run.command,
            created=time.strftime("%Y-%m-%dT%H:%M:%S%z"),
            environment=dict(run.environment),
            data=DataSetRecord(name=f"of the judge {self.config.kind}"),
            subjects=[SubjectRecord(name=name, parts=[one.said for one in parts]) for name, parts in found.items()],
            judgement=parse_judgement(figures, where=f"judge {self.config.kind}"),
        )
        return run.results(results)

    def _with_what_was_judged(self, run: Run, results: JudgementResults, found: Subjects) -> None:
        """With the fits that were judged, so that their own report shows it too."""
        from sysid.reporting import report

        folders = dict.fromkeys(one.run_folder for parts in found.values() for one in parts if one.run_folder)
        for folder in folders:
            write_json(folder / FOLDER / f"{slug(self.config.name)}.json", results.judgement.model_dump(mode="json"))
            try:
                report.write_report(folder)
            except ConfigError as error:
                run.tell(Warned(text=f"the report of {folder} is not written again: {error.what}"))

    def _track(self, run: Run, results: JudgementResults, found: Subjects, page: Path) -> None:
        for subject, metrics in results.judgement.metrics().items():
            parts = found[subject]
            run.tell(
                JudgementReady(
                    pipeline=self.config.name,
                    subject=subject,
                    digest=digest(strict({"metrics": metrics, "title": results.judgement.title})),
                    metrics=metrics,
                    fit_keys=tuple(one.fit_key for one in parts if one.fit_key),
                    tracked_as=tuple(one.tracked_as for one in parts if one.tracked_as),
                    page=page,
                    document=run.store.results,
                    command=run.command,
                )
            )
