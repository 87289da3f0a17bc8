"""A pipeline from traces to report: each step's result is on disk before it is announced, and found again."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sysid.code_digest import code_digest
from sysid.errors import ConfigError, SysidError
from sysid.estimation import FitProgress, FitResult
from sysid.reporting.comparing.published import read_published
from sysid.reporting.results import Results, parse_results, read_results, write_results
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig, Pipeline
from sysid.workbench.fits.data import Data, load_data
from sysid.workbench.fits.evidence import residuals
from sysid.workbench.fits.record import (
    export_record,
    is_final,
    read_fit,
    read_scores,
    results_document,
    write_fit,
    write_residuals,
    write_scores,
)
from sysid.workbench.runner import events
from sysid.workbench.runner.environment import environment
from sysid.workbench.runner.naming import nearby
from sysid.workbench.runner.store import RunFolder, digest, strict, write_bytes, write_json


@dataclass(frozen=True, kw_only=True, eq=False)
class GivenFit:
    """A fit that was made elsewhere, such as by a sweep, and goes through the steps like any other.

    Args:
        key: Digest of everything that it depends on.
        make: Gives it, when it is not stored yet.
    """

    key: str
    make: Callable[[], FitResult]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Fitted:
    """A fit on its way through the steps.

    Args:
        ready: The fit and its figures.
        fit_key: Digest of what the fit alone depends on, for those that start from it.
        final: Whether it and the fit it started from ran to their end, so that it may be stored for good.
    """

    ready: events.FitReady
    fit_key: str
    final: bool

    @property
    def scores(self) -> steps.Scores:
        """The figures."""
        return steps.Scores(evaluation=self.ready.evaluation, selection_mse=self.ready.selection_mse)


def run_pipeline(
    pipeline: Pipeline,
    folder: Path,
    *,
    command: str,
    fresh: bool = False,
    watchers: Sequence[events.Watcher] = (),
    given: Mapping[str, GivenFit] | None = None,
    chosen: steps.Choice | None = None,
) -> Results:
    """Run a pipeline; what an earlier run has finished is not done again.

    Ctrl-C ends the fit that is running and keeps its best model so far; that fit is used now, and done
    again by the next run.

    Args:
        pipeline: What to do.
        folder: The run folder.
        command: The command that makes the run again, for the report.
        fresh: Do everything again.
        watchers: Told everything that happens, in order.
        given: Fits that are made already, by name.
        chosen: The fit that comes first, where it was chosen elsewhere; chosen here by default.

    Returns:
        The contents of ``results.json``.

    Raises:
        BusyError: If another run is at work in the folder.
        UserError: If data or options cannot be used as they are.
        ParityError: If an exported file differs from its model.
    """
    run = _Run(
        pipeline=pipeline,
        store=RunFolder(path=folder.resolve()),
        command=command,
        fresh=fresh,
        watchers=watchers,
        given=given or {},
        chosen=chosen,
    )
    with run.store.locked():
        return run.all()


@dataclass(frozen=True, kw_only=True, eq=False)
class _Run:
    """One run: what its steps have in common."""

    pipeline: Pipeline
    store: RunFolder
    command: str
    fresh: bool
    watchers: Sequence[events.Watcher]
    given: Mapping[str, GivenFit]
    chosen: steps.Choice | None
    run_id: str = field(default_factory=lambda: time.strftime("%Y%m%d-%H%M%S"))
    environment: Mapping[str, Any] = field(default_factory=environment)

    def all(self) -> Results:
        """Every step, in order."""
        config = self.pipeline.config
        write_bytes(self.store.path / "pipeline.yaml", self.pipeline.text.encode())
        write_json(self.store.path / "environment.json", self.environment)
        self._tell(events.RunStarted(config=config, folder=self.store.path, run_id=self.run_id, command=self.command))
        data = self._load()
        fitted: dict[str, _Fitted] = {}
        for fit in config.fits:
            fitted[fit.name] = self._fit(fit, data, fitted)
            if not fitted[fit.name].ready.stored:
                # A killed run leaves results.json with what is finished, not with what an older run had.
                self._write_results(data, fitted, choice=None, exports=())
        asked = config.export.fit if config.export else "best"
        choice = self.chosen or steps.choose({name: (one.ready.fit, one.scores) for name, one in fitted.items()}, asked)
        exports = self._export(fitted[choice.name], data) if config.export else ()
        results = self._write_results(data, fitted, choice=choice, exports=exports)
        self._report(fitted[choice.name], results)
        self._tell(events.RunDone(results=results))
        return results

    def _tell(self, event: events.Event) -> None:
        for watch in self.watchers:
            watch(event)

    def _done(self, step: str, key: str) -> bool:
        return not self.fresh and self.store.is_done(step, key)

    def _load(self) -> Data:
        step = "Loading the traces"
        self._tell(events.StepStarted(step=step))
        if self.pipeline.config.report.published is not None:
            # A misspelt name is told before the fits are done, not after.
            read_published(self.pipeline.config.report.published)
        data = load_data(
            self.pipeline.config,
            beside=self.pipeline.path.parent,
            progress=lambda text: self._tell(events.StepProgress(step=step, fraction=None, detail=text)),
        )
        cases = f"{len(data.traces)} cases of {data.traces.name}"
        detail = f"{cases}, {len(data.selection)} to choose by" if data.selection else cases
        self._tell(events.StepDone(step=step, stored=False, detail=detail))
        self._tell(events.DataLoaded(traces=data.traces, selection=tuple(trace.name for trace in data.selection)))
        return data

    def _fit(self, fit: FitConfig, data: Data, earlier: Mapping[str, _Fitted]) -> _Fitted:
        config, folder = self.pipeline.config, self.store.fit(fit.slug)
        initial = earlier[fit.initial] if fit.initial else None
        given = self.given.get(fit.name)
        key = given.key if given else steps.fit_key(fit, config, data, initial.fit_key if initial else None)
        step = (
            f"Fitting {fit.name}" if fit.name == fit.structure.label else f"Fitting {fit.name}, {fit.structure.label}"
        )
        self._tell(events.StepStarted(step=step))
        fit_stored = self._done(f"fit-{fit.slug}", key)
        if fit_stored:
            result = read_fit(folder)
        elif given is not None:
            result = given.make()
        else:
            limit = getattr(fit.training_options(config.seed), "max_time_s", math.inf)
            progress = _Progress(step=step, limit_s=limit, tell=self._tell)
            try:
                result = steps.fit_traces(fit, config, data, initial.ready.fit if initial else None, progress.report)
            except SysidError as error:
                error.add_note(f"{step[0].lower()}{step[1:]}, {config.mapping}")
                raise
        final = is_final(result) and (initial is None or initial.final)
        if not fit_stored:
            files = write_fit(folder, result)
            if final:
                self.store.mark_done(f"fit-{fit.slug}", key, files)
        score_key, scores, scores_stored = self._score(fit, result, data, key, reuse=fit_stored, final=final)
        stored = fit_stored and scores_stored
        self._tell(events.StepDone(step=step, stored=stored, detail=_outcome(result, scores)))
        ready = events.FitReady(
            config=fit,
            key=score_key,
            fit=result,
            evaluation=scores.evaluation,
            selection_mse=scores.selection_mse,
            stored=stored,
            folder=folder,
        )
        self._tell(ready)
        return _Fitted(ready=ready, fit_key=key, final=final)

    def _score(
        self, fit: FitConfig, result: FitResult, data: Data, fit_key: str, *, reuse: bool, final: bool
    ) -> tuple[str, steps.Scores, bool]:
        """The key of the figures, the figures, and whether they were stored."""
        config, folder, step = self.pipeline.config, self.store.fit(fit.slug), f"scores-{fit.slug}"
        key = steps.scores_key(fit_key, fit.structure, data, config)
        if reuse and self._done(step, key):
            return key, read_scores(folder), True
        scores = steps.score(result, data, config)
        files = write_scores(folder, scores) + write_residuals(folder, residuals(result, data, config))
        if final:
            self.store.mark_done(step, key, files)
        return key, scores, False

    def _export(self, best: _Fitted, data: Data) -> tuple[dict[str, Any], ...]:
        config, folder = self.pipeline.config, self.store.path / "bundle"
        step = f"Exporting {best.ready.config.name}"
        key = steps.export_key(best.ready.key, config)
        self._tell(events.StepStarted(step=step))
        stored = self._done("export", key)
        if not stored:
            provenance = {"pipeline": config.name, "fit": best.ready.config.name, "command": self.command}
            began = time.perf_counter()
            bundle = steps.export(best.ready.fit, best.scores, data, config, folder=folder, provenance=provenance)
            timed = steps.export_run_times(bundle) if config.export and config.export.run_times else ()
            unit = best.ready.fit.model.output_unit
            exports = [export_record(entry, folder.name, unit, timed) for entry in bundle.files]
            if best.final:
                files = [file for file in sorted(folder.rglob("*")) if file.is_file()]
                self.store.mark_done("export", key, files, exports=exports, seconds=time.perf_counter() - began)
        else:
            exports = self.store.facts("export")["exports"]
        worst = max((float(entry["largest_difference"]) for entry in exports), default=0.0)
        detail = f"{len(exports)} files, at most {worst:.1e} {best.ready.fit.model.output_unit} from the model"
        self._tell(events.StepDone(step=step, stored=stored, detail=detail))
        self._tell(events.BundleReady(of=best.ready, folder=folder, exports=tuple(exports), stored=stored))
        return tuple(exports)

    def _report(self, best: _Fitted, results: Results) -> None:
        from sysid.reporting import report

        step, page = "Writing the report", self.store.path / "report" / "index.html"
        key = report_key(results)
        self._tell(events.StepStarted(step=step))
        stored = self._done("report", key)
        if not stored:
            began = time.perf_counter()
            page = report.write_report(self.store.path)
            self.store.mark_done("report", key, [page], seconds=time.perf_counter() - began)
        self._tell(events.StepDone(step=step, stored=stored, detail=str(nearby(page))))
        self._tell(events.ReportReady(page=page, results=self.store.results, of=best.ready))

    def _write_results(
        self,
        data: Data,
        fitted: Mapping[str, _Fitted],
        *,
        choice: steps.Choice | None,
        exports: Sequence[Mapping[str, Any]],
    ) -> Results:
        document = results_document(
            config=self.pipeline.config,
            command=self.command,
            environment=self.environment,
            data=data,
            fits=[one.ready for one in fitted.values()],
            choice=choice,
            exports=exports,
        )
        results = parse_results(strict(document), where=self.store.results)
        before = self._stored_results()
        if before is not None and _undated(before) == _undated(results):
            # Nothing is new, so that what was made then keeps its date.
            return before
        write_results(self.store.path, results)
        return results

    def _stored_results(self) -> Results | None:
        try:
            return read_results(self.store.path)
        except ConfigError:
            # None yet, or damaged: either way they are written anew.
            return None


def report_key(results: Results) -> str:
    """Digest of everything that a report depends on.

    Args:
        results: The contents of ``results.json``.

    Returns:
        64 hexadecimal digits.
    """
    # As text: an infinity that was never written differs, as a number, from the nothing that is read back.
    code = code_digest("sysid.reporting.report:write_report", files=("sysid/reporting/templates",))
    return digest({"results": results.model_dump_json(), "code": code})


def _undated(results: Results) -> str:
    """Results without their date; as text, because NaN differs from itself as a number."""
    return results.model_copy(update={"created": ""}).model_dump_json()


def _outcome(fit: FitResult, scores: steps.Scores) -> str:
    """How a fit came out, in a line."""
    cases = scores.evaluation.cases.values()
    worst = max(cases, key=lambda case: case.free_run.mse)
    unit = worst.free_run.unit
    return f"{fit.train_time_s:.1f} s, free run at worst {worst.free_run.mse:.3g} {unit}² ({worst.case})"


@dataclass(frozen=True, kw_only=True, eq=False)
class _Progress:
    """Turns the iterations of several starts, told from several threads, into one share of the whole."""

    step: str
    limit_s: float
    tell: events.Watcher
    shares: dict[int, float] = field(default_factory=dict)
    guard: threading.Lock = field(default_factory=threading.Lock)
    began: float = field(default_factory=time.perf_counter)

    def report(self, entry: FitProgress) -> None:
        """Told after every iteration of every start."""
        share = min(entry.iteration / entry.max_iterations, 1.0)
        spent = (time.perf_counter() - self.began) / self.limit_s
        with self.guard:
            # Starts are told about in any order, and some begin again: the share never falls.
            self.shares[entry.start] = max(share, self.shares.get(entry.start, 0.0))
            fraction = min(max(sum(self.shares.values()) / entry.starts, spent), 1.0)
            start = f"start {entry.start} of {entry.starts}, " if entry.starts > 1 else ""
            detail = f"{start}{entry.stage}, iteration {entry.iteration}, mse {entry.mse:.3g}"
            self.tell(events.StepProgress(step=self.step, fraction=fraction, detail=detail))
