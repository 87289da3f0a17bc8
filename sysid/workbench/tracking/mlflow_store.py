"""MLflow itself, and the only file that imports it: its stores, its experiments, its data sets and its models.

No other room knows that it exists. What is tracked, and when, :mod:`sysid.workbench.tracking.listener` says.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import shutil
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from sysid.bounded_text import read_json
from sysid.errors import ConfigError
from sysid.export.card import in_short
from sysid.export.flags import MEANING
from sysid.export.manifest import MANIFEST
from sysid.extras import need
from sysid.names import markdown_inline, read_sides, slug, told_apart, tracking_text
from sysid.traces import TraceSet
from sysid.workbench.tracking import mlflow_views as views
from sysid.workbench.tracking.fit_run import Entities
from sysid.workbench.tracking.landing import VARIABLE, App, leading_to
from sysid.workbench.tracking.moved_store import ARTIFACTS, follow
from sysid.workbench.tracking.registry import parsed, register
from sysid.workbench.tracking.served_table import SEQUENCE_FILE, STATE, flags_column, label, rests
from sysid.workbench.tracking.server import check_server
from sysid.workbench.tracking.sqlite_store import SQLITE, held, unhurried_disk
from sysid.workbench.tracking.sweep_run import TRIALS_TAG

QUIET = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR": "false",
    "MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT": "true",
    "GIT_PYTHON_REFRESH": "quiet",
    # Seven times, as MLflow has it, take four minutes, for each thing that is told a server that has gone.
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "3",
}
"""Settings that MLflow reads when it is imported; what the user has set stays."""


LONGEST_NAME = 250
"""Letters of an experiment's name: MLflow takes 500 bytes."""
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

    Raises:
        MissingExtraError: If MLflow is not installed.
        ConfigError: If a server does not answer, or a file is no store.
    """
    for name, value in QUIET.items():
        os.environ.setdefault(name, value)
    need("mlflow", "tracking, and what is done with tracked models,")
    with no_deprecations():
        from mlflow import MlflowClient

        for name in ("mlflow", "alembic"):
            logging.getLogger(name).setLevel(logging.WARNING)
        if uri.startswith(("http://", "https://")):
            check_server(uri)
        if not uri.startswith(SQLITE):
            return MlflowClient(uri)
        database = Path(uri.removeprefix(SQLITE))
        with held(database, _make_store):
            follow(database)
            return MlflowClient(uri)


def page_app() -> App:
    """MLflow's server with a bare address that leads to the fits; what ``mlflow server --app-name sysid`` runs.

    Returns:
        The application.
    """
    from mlflow.server.fastapi_app import app

    return leading_to(app, os.environ.get(VARIABLE, ""))


def _make_store(database: Path) -> None:
    from mlflow.store.tracking.sqlalchemy_store import SqlAlchemyStore

    with unhurried_disk():
        store = SqlAlchemyStore(f"{SQLITE}{database.as_posix()}", ARTIFACTS)
        store.engine.dispose()


@contextmanager
def no_deprecations() -> Iterator[None]:
    """What MLflow and its web framework deprecate in each other is not the user's business, nor ours to fix.

    Yields:
        Nothing.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def entities() -> Entities:
    """The classes that those who may not import MLflow need of it.

    Returns:
        The classes.
    """
    from mlflow.entities import Metric, Param

    return Entities(metric=Metric, param=Param)


def experiment_of(client: Any, name: str, artifacts: Path | None, *, about: str) -> str:
    """The experiment of a mapping, a pipeline or a sweep, made or brought back if need be.

    Args:
        client: An ``MlflowClient``.
        name: Its name.
        artifacts: Where a new one keeps its files; ``None`` leaves it to a server.
        about: What is in it, as the list of experiments says it.

    Returns:
        Its identifier.
    """
    from mlflow.exceptions import MlflowException

    names = [one for side in read_sides(name) for one in side]
    name = tracking_text(name, LONGEST_NAME)
    found = client.get_experiment_by_name(name)
    if found is None:
        location = None
        if artifacts is not None:
            location = (artifacts / told_apart(slug(name), names)).resolve().as_uri()
        try:
            # Otherwise MLflow asks every visitor what kind of experiment it is.
            tags = {"mlflow.experimentKind": "custom_model_development", "mlflow.note.content": about}
            return str(client.create_experiment(name, artifact_location=location, tags=tags))
        except MlflowException:
            # Another process has just made it.
            found = client.get_experiment_by_name(name)
            if found is None:
                raise
    if found.lifecycle_stage == "deleted":
        client.restore_experiment(found.experiment_id)
    return str(found.experiment_id)


def latest_experiment(uri: str) -> str | None:
    """The experiment with the newest fit, the one to open first; that of a search's trials where there are no fits.

    Args:
        uri: The tracking URI.

    Returns:
        Its identifier; ``None`` where nothing is tracked yet.
    """
    with no_deprecations():
        client = connect(uri)
        every = client.search_experiments()
        fits = [one for one in every if TRIALS_TAG not in one.tags]
        for some in (fits, every):
            experiments = [experiment.experiment_id for experiment in some]
            newest = client.search_runs(experiments, order_by=["attributes.start_time DESC"], max_results=1)
            if newest:
                break
        else:
            return None
        # The page that is opened names the view, which an experiment made by other means has not got yet.
        views.show(client, newest[0].info.experiment_id, [])
        return str(newest[0].info.experiment_id)


def log_data(client: Any, run_id: str, traces: TraceSet) -> None:
    """Log the data that a fit was made of.

    Args:
        client: An ``MlflowClient``.
        run_id: The fit's run.
        traces: The data.
    """
    from mlflow.data.code_dataset_source import CodeDatasetSource
    from mlflow.data.meta_dataset import MetaDataset
    from mlflow.entities import DatasetInput, InputTag
    from mlflow.types import ColSpec, Schema

    cases = {trace.name: f"{traces.roles[trace.name].value}, {len(trace)} samples" for trace in traces}
    dataset = MetaDataset(
        CodeDatasetSource(tags={"source": traces.source[:2000], "digest": traces.digest, "cases": cases}),
        name=traces.name,
        # MLflow keeps at most 36 characters; the whole digest stands in the source and in the run's tags.
        digest=traces.digest[:32],
        schema=Schema([ColSpec("double", channel.label) for channel in traces.channels]),
    )
    context = InputTag("mlflow.data.context", "estimation and validation")
    client.log_inputs(run_id, [DatasetInput(dataset._to_mlflow_entity(), [context])])


def log_model(
    client: Any,
    bundle: Path,
    mapping: str,
    *,
    name: str,
    fit: str,
    uri: str,
    run_id: str,
    traces: TraceSet | None = None,
) -> None:
    """Log the exported surrogate as a model that MLflow can load and serve, and as the newest in the registry.

    Args:
        client: An ``MlflowClient``.
        bundle: The folder that holds its ``sequence.onnx``.
        mapping: What it maps.
        name: Of the logged model.
        fit: Name of the fit that was exported.
        uri: The tracking URI.
        run_id: The fit's run.
        traces: The data, of which an example of inputs is taken; without any they stand still.
    """
    import mlflow
    from mlflow.models import Model

    before, variable = mlflow.get_tracking_uri(), os.environ.get(TRACKING_VARIABLE)
    mlflow.set_tracking_uri(uri)
    try:
        with mlflow.start_run(run_id=run_id):
            logged = Model.log(None, name=name, flavor=_Flavor, bundle=bundle, traces=traces)
        register(
            client,
            mapping,
            source=logged.model_uri,
            run_id=run_id,
            model_id=logged.model_id,
            fit=fit,
            description=markdown_inline(in_short(read_json(bundle / MANIFEST))),
        )
    finally:
        mlflow.set_tracking_uri(before)
        # MLflow writes what it is told into the environment too, where it would name the store of the next run.
        os.environ.pop(TRACKING_VARIABLE, None)
        if variable is not None:
            os.environ[TRACKING_VARIABLE] = variable


class _Flavor:
    """How MLflow is to save a surrogate: tables in and out for ``mlflow.pyfunc``, the graph for ``mlflow.onnx``."""

    @staticmethod
    def save_model(path: str, mlflow_model: Any, *, bundle: Path, traces: TraceSet | None) -> None:
        """What :meth:`Model.log` calls.

        Args:
            path: The folder to make.
            mlflow_model: What describes it.
            bundle: The surrogate.
            traces: What it was fitted to.
        """
        import mlflow
        import onnx

        source = resources.files("sysid.workbench.tracking") / "served_table.py"
        about = json.loads((bundle / MANIFEST).read_text(encoding="utf-8"))
        with tempfile.TemporaryDirectory() as scratch:
            data = Path(scratch) / "surrogate"
            data.mkdir()
            for name in (SEQUENCE_FILE, MANIFEST):
                shutil.copyfile(bundle / name, data / name)
            # Two models in one process may have been logged by two versions of the workbench: each finds its own code.
            text = source.read_text(encoding="utf-8")
            module = f"sysid_table_{hashlib.sha256(text.encode()).hexdigest()[:12]}"
            code = Path(scratch) / f"{module}.py"
            code.write_text(text, encoding="utf-8")
            mlflow.pyfunc.save_model(
                path,
                loader_module=module,
                data_path=str(data),
                code_paths=[str(code)],
                mlflow_model=mlflow_model,
                signature=_signature(about),
                input_example=_example(about, traces),
                pip_requirements=["numpy", "onnx", "onnxruntime", "pandas"],
                metadata={
                    "mapping": about["mapping"],
                    "sample_time_s": about["sample_time_s"],
                    "flags": {str(flag.value): text for flag, text in MEANING.items()},
                },
            )
        mlflow_model.add_flavor(
            "onnx",
            onnx_version=onnx.__version__,
            data=f"data/surrogate/{SEQUENCE_FILE}",
            # Without it MLflow asks for CUDA at load.
            providers=["CPUExecutionProvider"],
            onnx_session_options=None,
            code=None,
        )
        mlflow_model.save(str(Path(path) / "MLmodel"))


def _example(about: dict[str, Any], traces: TraceSet | None) -> Any:
    """A few samples of the first trace; an input that it lacks stands still."""
    import pandas as pd

    trace, values = None if traces is None else traces.traces[0], about["initialisation"]["values"]
    columns = {}
    for channel in about["inputs"]:
        name = channel["name"]
        there = trace is not None and name in trace.channel_names
        columns[label(channel)] = trace[name][:8] if trace is not None and there else np.full(8, float(values[name]))
    return pd.DataFrame(columns)


def _signature(about: dict[str, Any]) -> Any:
    """Columns with their units, and where a run may begin."""
    from mlflow.models import ModelSignature
    from mlflow.types import ColSpec, ParamSchema, ParamSpec, Schema

    outputs = [label(channel) for channel in about["outputs"]]
    begin = [ParamSpec(name, "double", level) for name, (_, level) in rests(about).items()]
    return ModelSignature(
        inputs=Schema([ColSpec("double", label(channel)) for channel in about["inputs"]]),
        outputs=Schema([*(ColSpec("double", name) for name in outputs), ColSpec("integer", flags_column(outputs))]),
        params=ParamSchema([ParamSpec(STATE, "double", [], shape=(-1,)), *begin]),
    )


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
    with no_deprecations():
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
