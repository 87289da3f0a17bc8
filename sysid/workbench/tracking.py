"""Every fit into MLflow. The only file that imports it; no other room knows that it exists.

Results are on disk before the tracker hears of them, and whatever fails here is told and gone past: tracking
never costs a fit. Runs are flat, one per fit, because the charts show only the visible rows of a nested tree;
what belongs together carries the same tag. A fit that is already tracked is found by its key and not logged
again, so that running a pipeline once more logs what is missing and nothing else.
"""

from __future__ import annotations

import logging
import os
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.export import zip_bundle
from sysid.workbench import tracked, tracked_fit, views
from sysid.workbench.events import (
    BundleReady,
    DataLoaded,
    Event,
    FitReady,
    JudgementReady,
    ReportReady,
    RunStarted,
    SweepReady,
)
from sysid.workbench.judgement.logged import log_judgement
from sysid.workbench.naming import slug
from sysid.workbench.registry import parsed, register
from sysid.workbench.sqlite_store import SQLITE, held
from sysid.workbench.tracked_fit import Entities
from sysid.workbench.tracked_sweep import experiment_name, log_sweep

KEY_TAG = "sysid.key"
"""Tag that holds the digest of everything a fit and its figures depend on."""

SEQUENCE_FILE = "sequence.onnx"
"""The exported file that runs a whole record, which is what a caller of a tracked model wants."""

QUIET = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR": "false",
    "MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT": "true",
    "GIT_PYTHON_REFRESH": "quiet",
}
"""Settings that MLflow reads when it is imported; what the user has set stays."""


TRACKING_VARIABLE = "MLFLOW_TRACKING_URI"
"""MLflow's own environment variable for the store."""


def store_uri(workspace: Path) -> str:
    """Where runs are tracked: ``MLFLOW_TRACKING_URI``, or SQLite in the workspace.

    Args:
        workspace: The user's workspace.

    Returns:
        A tracking URI.
    """
    return os.environ.get(TRACKING_VARIABLE) or f"{SQLITE}{(workspace / 'mlflow.db').resolve().as_posix()}"


def connect(uri: str) -> Any:
    """A client of a store that is ready for use by several processes.

    Args:
        uri: The tracking URI.

    Returns:
        An ``MlflowClient``.
    """
    for name, value in QUIET.items():
        os.environ.setdefault(name, value)
    with _no_deprecations():
        from mlflow import MlflowClient

        for name in ("mlflow", "alembic"):
            logging.getLogger(name).setLevel(logging.WARNING)
        if not uri.startswith(SQLITE):
            return MlflowClient(uri)
        with held(Path(uri.removeprefix(SQLITE)), _make_store):
            return MlflowClient(uri)


def _make_store(database: Path) -> None:
    from mlflow.store.tracking.sqlalchemy_store import SqlAlchemyStore

    store = SqlAlchemyStore(f"{SQLITE}{database.as_posix()}", "mlartifacts")
    store.engine.dispose()


@contextmanager
def _no_deprecations() -> Iterator[None]:
    """What MLflow and its web framework deprecate in each other is not the user's business, nor ours to fix."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


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
        uri = store_uri(workspace)
        return cls(uri=uri, artifacts=workspace / "mlartifacts" if uri.startswith(SQLITE) else None, warn=warn)

    def __call__(self, event: Event) -> None:
        """Log an event; never raises."""
        try:
            with _no_deprecations():
                self._log(event)
        except Exception as error:  # noqa: BLE001 - a store can fail in any way, and no fit may be lost by it
            text = f"{type(event).__name__}: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
            self.failures.append(text)
            self.warn(f"not tracked in MLflow ({text})")

    def _log(self, event: Event) -> None:
        match event:
            case RunStarted():
                self.run = event
                self.client = connect(self.uri)
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
            case SweepReady():
                self._log_sweep(event)
            case _:
                pass

    def _log_fit(self, ready: FitReady) -> None:
        if self.client is None or self.run is None or self.data is None:
            return
        experiment = self._experiment(str(ready.fit.model.mapping))
        known = tracked_fit.known_run(self.client, experiment, ready, key_tag=KEY_TAG)
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
            tracked_fit.log_values(self.client, run_id, ready, self.run, _entities())
            self._log_data(run_id)
            tracked_fit.log_pictures(self.client, run_id, ready)
            views.show(self.client, experiment, [tracked.key(name) for name in ready.evaluation.cases])
            status = "FINISHED"
        finally:
            self.client.set_terminated(run_id, status=status)

    def _describe(self, experiment: str, run_id: str, ready: FitReady, *, exported: bool = False) -> None:
        if self.run is not None:
            parent = self.run_ids.get(ready.config.initial or "")
            tracked_fit.describe(
                self.client, experiment, run_id, ready, self.run, initial_run=parent, exported=exported
            )

    def _experiment(self, name: str) -> str:
        """The experiment of a mapping, made or brought back if need be."""
        from mlflow.exceptions import MlflowException

        found = self.client.get_experiment_by_name(name)
        if found is None:
            location = None
            if self.artifacts is not None:
                location = (self.artifacts / slug(name)).resolve().as_uri()
            try:
                # Otherwise MLflow asks every visitor what kind of experiment it is.
                tags = {"mlflow.experimentKind": "custom_model_development"}
                return str(self.client.create_experiment(name, artifact_location=location, tags=tags))
            except MlflowException:
                # Another process has just made it.
                found = self.client.get_experiment_by_name(name)
                if found is None:
                    raise
        if found.lifecycle_stage == "deleted":
            self.client.restore_experiment(found.experiment_id)
        return str(found.experiment_id)

    def _log_data(self, run_id: str) -> None:
        from mlflow.data.code_dataset_source import CodeDatasetSource
        from mlflow.data.meta_dataset import MetaDataset
        from mlflow.entities import DatasetInput, InputTag
        from mlflow.types import ColSpec, Schema

        if self.data is None:
            return
        traces = self.data.traces
        cases = {trace.name: f"{traces.roles[trace.name].value}, {len(trace)} samples" for trace in traces}
        dataset = MetaDataset(
            CodeDatasetSource(tags={"source": traces.source[:2000], "digest": traces.digest, "cases": cases}),
            name=traces.name,
            # MLflow keeps at most 36 characters; the whole digest stands in the source and in the run's tags.
            digest=traces.digest[:32],
            schema=Schema([ColSpec("double", channel.label) for channel in traces.channels]),
        )
        context = InputTag("mlflow.data.context", "estimation and validation")
        self.client.log_inputs(run_id, [DatasetInput(dataset._to_mlflow_entity(), [context])])

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
        if sequence is not None:
            self._log_model(run_id, ready.folder.parent / sequence["file"], ready)
        self._describe(self.client.get_run(run_id).info.experiment_id, run_id, ready.of, exported=True)
        self.client.set_tag(run_id, "exported", "yes")

    def _log_model(self, run_id: str, file: Path, ready: BundleReady) -> None:
        """The exported network as a model that MLflow can load and serve, and as the newest in the registry."""
        import mlflow
        import onnx

        network = onnx.load(str(file))
        before, variable = mlflow.get_tracking_uri(), os.environ.get(TRACKING_VARIABLE)
        mlflow.set_tracking_uri(self.uri)
        try:
            with mlflow.start_run(run_id=run_id):
                logged = mlflow.onnx.log_model(
                    network,
                    name=slug(tracked.run_name(ready.of)),
                    signature=_signature(network),
                    input_example=self._example(network, ready.of),
                    # Without these MLflow asks for CUDA at load and for whatever it finds installed.
                    onnx_execution_providers=["CPUExecutionProvider"],
                    pip_requirements=["onnx", "onnxruntime", "numpy"],
                    save_as_external_data=False,
                )
            register(
                self.client,
                str(ready.of.fit.model.mapping),
                source=logged.model_uri,
                run_id=run_id,
                model_id=logged.model_id,
                fit=ready.of.config.name,
            )
        finally:
            mlflow.set_tracking_uri(before)
            # MLflow writes what it is told into the environment too, where it would name the store of the next run.
            os.environ.pop(TRACKING_VARIABLE, None)
            if variable is not None:
                os.environ[TRACKING_VARIABLE] = variable

    def _example(self, network: Any, ready: FitReady) -> dict[str, NDArray[np.float64]]:
        """A few samples of the first trace for one car, from the middle of every channel's range."""
        if self.data is None:
            return {}
        trace = self.data.traces.traces[0]
        columns = trace.columns(ready.fit.model.mapping.inputs)[:8]
        _, state = network.graph.input
        return {"u": columns[:, None, :], "state": np.zeros((1, state.type.tensor_type.shape.dim[1].dim_value))}

    def _log_judgement(self, ready: JudgementReady) -> None:
        if self.client is None:
            self.client = connect(self.uri)
        experiment, metric = self._experiment(ready.pipeline), _entities().metric
        log_judgement(self.client, ready, key_tag=KEY_TAG, experiment=experiment, metric=metric)

    def _log_sweep(self, ready: SweepReady) -> None:
        if self.client is None:
            self.client = connect(self.uri)
        experiment = self._experiment(experiment_name(ready.record))
        log_sweep(self.client, ready, key_tag=KEY_TAG, experiment=experiment, entities=_entities())

    def _log_report(self, ready: ReportReady) -> None:
        run_id = self.run_ids.get(ready.of.config.name)
        if self.client is None or run_id is None:
            return
        self.client.log_artifact(run_id, str(ready.page), "report")
        self.client.log_artifact(run_id, str(ready.results), "report")


def fetch_bundle(uri: str, address: str, folder: Path) -> tuple[Path, str]:
    """The bundle of a registered model.

    Args:
        uri: The tracking URI.
        address: ``models:/<name>@<alias>`` or ``models:/<name>/<version>``.
        folder: Where it is put.

    Returns:
        The bundle's folder, and the run that tracks it.

    Raises:
        ConfigError: If there is no such model, or its run holds no bundle.
    """
    client = connect(uri)
    name, alias, version = parsed(address)
    with _no_deprecations():
        from mlflow.exceptions import MlflowException

        try:
            found = client.get_model_version_by_alias(name, alias) if alias else client.get_model_version(name, version)
            target = folder / f"{slug(name)}-{found.version}"
            target.mkdir(parents=True, exist_ok=True)
            return Path(client.download_artifacts(found.run_id, "bundle", str(target))), str(found.run_id)
        except (MlflowException, OSError) as error:
            raise ConfigError(
                "the registered model cannot be had",
                where=address,
                expected="a model that sysid run has exported and tracked",
                got=str(error).splitlines()[0],
                remedy="look for its name and version under Models in sysid ui",
            ) from error


def _signature(network: Any) -> Any:
    """Names, types and shapes of a graph's inputs and outputs; -1 stands for any length."""
    from mlflow.models import ModelSignature
    from mlflow.types import Schema, TensorSpec
    from onnx.helper import tensor_dtype_to_np_dtype

    def schema(values: Any) -> Any:
        tensors = [(value.name, value.type.tensor_type) for value in values]
        return Schema(
            [
                TensorSpec(
                    np.dtype(tensor_dtype_to_np_dtype(tensor.elem_type)),
                    tuple(dim.dim_value or -1 for dim in tensor.shape.dim),
                    name,
                )
                for name, tensor in tensors
            ]
        )

    return ModelSignature(inputs=schema(network.graph.input), outputs=schema(network.graph.output))


def _entities() -> Entities:
    """The classes that those who may not import MLflow need of it."""
    from mlflow.entities import Metric, Param

    return Entities(metric=Metric, param=Param)


def latest_experiment(uri: str) -> str | None:
    """The experiment with the newest run, the one to open first.

    Args:
        uri: The tracking URI.

    Returns:
        Its identifier; ``None`` where nothing is tracked yet.
    """
    with _no_deprecations():
        client = connect(uri)
        experiments = [experiment.experiment_id for experiment in client.search_experiments()]
        newest = client.search_runs(experiments, order_by=["attributes.start_time DESC"], max_results=1)
        if not newest:
            return None
        # The page that is opened names the view, which an experiment made by other means has not got yet.
        views.show(client, newest[0].info.experiment_id, [])
        return str(newest[0].info.experiment_id)
