"""Every fit into MLflow: a listener to a pipeline, which tells the store what it hears.

Results are on disk before the tracker hears of them, and whatever fails here is told and gone past: tracking
never costs a fit. Runs are flat, one per fit, because the charts show only the visible rows of a nested tree;
what belongs together carries the same tag. A fit that is already tracked is found by its key and not logged
again, so that running a pipeline once more logs what is missing and nothing else.

MLflow is not imported here: what needs it is asked of :mod:`sysid.workbench.tracking.mlflow_store`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sysid.export import zip_bundle
from sysid.names import distinct, slug, tracking_key
from sysid.workbench.runner.events import (
    BundleReady,
    DataLoaded,
    Event,
    FitReady,
    JudgementReady,
    ReportReady,
    ResponseReady,
    RunStarted,
    SweepReady,
)
from sysid.workbench.runner.faults import refusal
from sysid.workbench.tracking import fit_run as tracked_fit
from sysid.workbench.tracking import fit_values as tracked
from sysid.workbench.tracking import mlflow_store as tracking
from sysid.workbench.tracking import mlflow_views as views
from sysid.workbench.tracking.judgement_run import log_judgement
from sysid.workbench.tracking.moved_store import ARTIFACTS
from sysid.workbench.tracking.response_run import log_files, new_run, run_name
from sysid.workbench.tracking.served_table import SEQUENCE_FILE
from sysid.workbench.tracking.sqlite_store import SQLITE
from sysid.workbench.tracking.sweep_run import experiment_name, log_sweep

KEY_TAG = "sysid.key"
"""Tag that holds the digest of everything a fit and its figures depend on."""
ABOUT_FITS = "Fits of one output, by every pipeline and search of this mapping: a run each."
ABOUT_TRIALS = "What a sweep or a search tried: a run each, and one of the whole."
ABOUT_JUDGEMENTS = "Judgements of finished models by the consequences of their errors: a run each."
"""What the list of experiments says of them."""


def _in_words(error: Exception) -> str:
    """What went wrong in one line: in the house's words where it is known, such as a full disk."""
    known = refusal(error)
    if known is None:
        return f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
    return f"{known.what}: {known.got}; {known.remedy}"


def registered_as(ready: FitReady, whole: str) -> tuple[str, str]:
    """Under which mapping a model is registered, and as which fit.

    Args:
        ready: The fit that was exported.
        whole: What its files map, where that is more than the fit's own output; else empty.

    Returns:
        Both.
    """
    return whole or str(ready.pipeline.mapping), (ready.system if whole else None) or ready.config.name


@dataclass(kw_only=True, eq=False)
class Tracker:
    """Listens to a pipeline and logs what it hears.

    Args:
        uri: The tracking URI.
        artifacts: Where a new experiment keeps its files; ``None`` leaves it to a server.
        warn: Told what could not be tracked.
    """

    uri: str
    artifacts: Path | None
    warn: Callable[[str], None]

    # What is known of the run so far.
    failures: list[str] = field(default_factory=list)
    client: Any = None
    run: RunStarted | None = None
    data: DataLoaded | None = None
    run_ids: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of_workspace(cls, workspace: Path, warn: Callable[[str], None]) -> Tracker:
        """The tracker of a workspace.

        Args:
            workspace: The folder that holds ``mlflow.db`` and ``mlartifacts``.
            warn: Told what could not be tracked.

        Returns:
            The tracker; nothing is opened yet.
        """
        uri = tracking.store_uri(workspace)
        return cls(uri=uri, artifacts=workspace / ARTIFACTS if uri.startswith(SQLITE) else None, warn=warn)

    def __call__(self, event: Event) -> None:
        """Log an event; never raises."""
        try:
            with tracking.no_deprecations():
                self._log(event)
        except Exception as error:  # noqa: BLE001 - a store can fail in any way, and no fit may be lost by it
            text = f"{type(event).__name__}: {_in_words(error)}"
            self.failures.append(text)
            self.warn(f"not tracked in MLflow ({text})")

    def _log(self, event: Event) -> None:
        match event:
            case RunStarted():
                self.run = event
                self.client = tracking.connect(self.uri)
            case DataLoaded():
                self.data = event
            case FitReady():
                self._log_fit(event)
            case BundleReady():
                self._log_bundle(event)
            case ReportReady():
                self._log_report(event)
            case JudgementReady():
                self._log_judgement(event)
            case ResponseReady():
                self._log_response(event)
            case SweepReady():
                self._log_sweep(event)
            case _:
                pass

    def _log_fit(self, ready: FitReady) -> None:
        if self.client is None or self.run is None or self.data is None:
            return
        experiment = tracking.experiment_of(self.client, str(ready.pipeline.mapping), self.artifacts, about=ABOUT_FITS)
        known = tracked_fit.known_run(self.client, experiment, ready.key, key_tag=KEY_TAG)
        if known is not None and ready.stored:
            self.run_ids[ready.config.name] = known
            return
        words = tracked.tags(ready, self.run, self.data) | {
            KEY_TAG: ready.key,
            tracked.COLOUR_TAG: tracked.colour(len(self.run_ids)),
            "mlflow.source.name": self.run.command,
            "mlflow.source.type": "LOCAL",
        }
        run = self.client.create_run(experiment, run_name=tracked.run_name(ready), tags=words)
        run_id = run.info.run_id
        self.run_ids[ready.config.name] = run_id
        status = "FAILED"
        try:
            self._describe(experiment, run_id, ready)
            tracked_fit.log_values(self.client, run_id, ready, tracking.entities())
            tracking.log_data(self.client, run_id, self.data.traces)
            tracked_fit.log_pictures(self.client, run_id, ready)
            keys = distinct(ready.evaluation.cases, tracking_key)
            views.show(self.client, experiment, [keys[name] for name in tracked.drawn(ready)])
            status = "FINISHED"
        finally:
            self.client.set_terminated(run_id, status=status)

    def _describe(self, experiment: str, run_id: str, ready: FitReady, *, exported: bool = False) -> None:
        if self.run is not None:
            parent = self.run_ids.get(ready.config.initial or "")
            tracked_fit.describe(
                self.client, experiment, run_id, ready, self.run, initial_run=parent, exported=exported
            )

    def _log_bundle(self, ready: BundleReady) -> None:
        run_id = self.run_ids.get(ready.of.config.name)
        if self.client is None or run_id is None:
            return
        if ready.stored and self.client.get_run(run_id).data.tags.get("exported") == "yes":
            return
        self.client.log_artifacts(run_id, str(ready.folder), "bundle")
        with tempfile.TemporaryDirectory() as scratch:
            # The page downloads files, not folders.
            packed = zip_bundle(ready.folder, Path(scratch) / f"{slug(tracked.run_name(ready.of))}.zip")
            self.client.log_artifact(run_id, str(packed))
        sequence = next((entry for entry in ready.exports if Path(entry["file"]).name == SEQUENCE_FILE), None)
        if sequence is not None and self.data is not None and not ready.told:
            mapping, fit = registered_as(ready.of, ready.mapping)
            name = slug(tracked.run_name(ready.of))
            tracking.log_model(
                self.client, ready.folder, mapping, name=name, fit=fit, uri=self.uri, run_id=run_id,
                traces=self.data.traces,
            )  # fmt: skip
        self._describe(self.client.get_run(run_id).info.experiment_id, run_id, ready.of, exported=True)
        self.client.set_tag(run_id, "exported", "yes")

    def _log_judgement(self, ready: JudgementReady) -> None:
        if self.client is None:
            self.client = tracking.connect(self.uri)
        experiment = tracking.experiment_of(self.client, ready.pipeline, self.artifacts, about=ABOUT_JUDGEMENTS)
        metric = tracking.entities().metric
        log_judgement(self.client, ready, key_tag=KEY_TAG, experiment=experiment, metric=metric)

    def _log_response(self, ready: ResponseReady) -> None:
        if self.client is None or self.run is None:
            return
        fit = ready.results.fits[0]
        experiment = tracking.experiment_of(self.client, fit.mapping, self.artifacts, about=ABOUT_FITS)
        run_id = tracked_fit.known_run(self.client, experiment, ready.key, key_tag=KEY_TAG)
        if run_id is None or not ready.stored:
            run_id = new_run(self.client, experiment, ready, self.run, tracking.entities(), key_tag=KEY_TAG)
        new = log_files(self.client, run_id, ready)
        views.show(self.client, experiment, [])
        if new and ready.bundle is not None and (ready.bundle / SEQUENCE_FILE).is_file():
            tracking.log_model(
                self.client, ready.bundle, fit.mapping, name=slug(run_name(fit)), fit=self.run.pipeline, uri=self.uri,
                run_id=run_id,
            )  # fmt: skip

    def _log_sweep(self, ready: SweepReady) -> None:
        if self.client is None:
            self.client = tracking.connect(self.uri)
        experiment = tracking.experiment_of(
            self.client, experiment_name(ready.record), self.artifacts, about=ABOUT_TRIALS
        )
        log_sweep(self.client, ready, key_tag=KEY_TAG, experiment=experiment, entities=tracking.entities())

    def _log_report(self, ready: ReportReady) -> None:
        run_id = self.run_ids.get(ready.of.config.name)
        if self.client is None or run_id is None:
            return
        self.client.log_artifact(run_id, str(ready.page), "report")
        self.client.log_artifact(run_id, str(ready.results), "report")
