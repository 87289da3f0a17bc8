"""Kinds of pipelines: what the ``kind`` at the top of a pipeline's YAML means, and which steps it has.

One row a kind, in :data:`KINDS`. A row names its configuration and its program as ``module:attribute``, so that nothing
is imported before it is used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from sysid.content import what_to_do_with_data
from sysid.errors import ConfigError, did_you_mean
from sysid.field_checks import Origins
from sysid.plugins import entry_points
from sysid.yaml_files import read_yaml

if TYPE_CHECKING:
    from pydantic import BaseModel

    from sysid.ingest.datasets.dataset import Unmade
    from sysid.traces import TraceSet
    from sysid.workbench.runner.program import Program

DEFAULT = "fits"
"""The kind of a pipeline that names none."""


@dataclass(frozen=True, kw_only=True)
class RunRequest:
    """What a person asked of ``sysid run``.

    Args:
        path: The pipeline's file.
        typed: The pipeline as it was typed, for the command that makes the run again.
        options: What was typed behind it that belongs to that command.
        fresh: Do everything again.
        out: The run folder; ``None`` for ``runs/<name>``.
        tracking: Whether the run is tracked in MLflow.
        workers: Processes that train, where a sweep's YAML is not to say.
    """

    path: Path
    typed: str
    options: tuple[str, ...] = ()
    fresh: bool = False
    out: Path | None = None
    tracking: bool = True
    workers: int | None = None


@dataclass(frozen=True, kw_only=True)
class Kind:
    """One kind of pipeline.

    Args:
        config: Its pydantic model, as ``module:attribute``.
        program: A function of a :class:`RunRequest` that gives its :class:`~sysid.workbench.runner.program.Program`, as
            ``module:attribute``.
        data: Of a kind that gives data, what stands for a data set, made of the pipeline's path by its ``at``.
    """

    config: str
    program: str
    data: str | None = None

    def load_config(self) -> type[BaseModel]:
        """The pydantic model."""
        loaded: type[BaseModel] = _load(self.config)
        return loaded

    def load_program(self) -> Callable[[RunRequest], Program[Any]]:
        """What turns a request into steps."""
        loaded: Callable[[RunRequest], Program[Any]] = _load(self.program)
        return loaded


class DataSource(Protocol):
    """Data that a pipeline gives."""

    @classmethod
    def at(cls, path: Path) -> DataSource:
        """Those of the pipeline in a file."""

    def load(self, progress: Callable[[str, int, int], None] | None = None) -> TraceSet:
        """The traces with their roles; made where they are not there, of which ``progress`` is told."""

    def unmade(self) -> Unmade | None:
        """What has yet to be made of them; ``None`` if nothing."""


FOUND: dict[str, Kind] = {
    "sysid.judges": Kind(
        config="sysid.workbench.judging.config:JudgementConfig",
        program="sysid.workbench.judging.runner:program",
    ),
    "sysid.makers": Kind(
        config="sysid.workbench.making.config:MakingConfig", program="sysid.workbench.making.runner:program"
    ),
}
"""Entry-point groups whose names are kinds too: packages bring them, and what they are about is not known here."""

KINDS: dict[str, Kind] = {
    DEFAULT: Kind(config="sysid.workbench.fits.config:PipelineConfig", program="sysid.workbench.fits.run:program"),
    "assembly": Kind(
        config="sysid.workbench.assembly.config:AssemblyConfig",
        program="sysid.workbench.assembly.runner:program",
    ),
    "auto": Kind(config="sysid.workbench.auto.config:AutoConfig", program="sysid.workbench.auto.run:program"),
    "experiment": Kind(
        config="sysid.workbench.experiments.config:ExperimentConfig",
        program="sysid.workbench.experiments.run:program",
        data="sysid.workbench.experiments.data:ExperimentData",
    ),
    "response": Kind(
        config="sysid.workbench.responses.config:ResponseConfig", program="sysid.workbench.responses.run:program"
    ),
    "sweep": Kind(config="sysid.workbench.sweep.config:SweepConfig", program="sysid.workbench.sweep.run:program"),
}
"""The kinds by name."""


def kinds() -> dict[str, Kind]:
    """All kinds by name: those of :data:`KINDS`, and those that installed packages bring."""
    found = {entry.name: kind for group, kind in FOUND.items() for entry in entry_points(group)}
    return {**found, **KINDS}


def kind_of(path: Path) -> str:
    """The kind of a pipeline, read from its file.

    Args:
        path: The YAML file.

    Returns:
        A key of :func:`kinds`.

    Raises:
        ConfigError: If the file cannot be read, or there is no such kind.
    """
    data = read_yaml(path)
    if "channels" in data and "cases" in data:
        raise ConfigError(
            "a data set is no pipeline",
            where=path,
            expected="a YAML file with data, mapping and fits",
            got="one with channels and cases, which describes records",
            remedy=what_to_do_with_data(path.parent.name if path.stem == "dataset" else str(path)),
        )
    if "extends" in data and "kind" not in data:
        raise ConfigError(
            "a pipeline that extends another does not say of which kind it is",
            where=Origins(file=path).place(("extends",)),
            expected="kind: assembly, whose pipelines extend one another",
            got=f"no kind, which is a pipeline of {DEFAULT}",
            remedy="add kind: assembly",
        )
    name = data.get("kind", DEFAULT)
    known = kinds()
    if not isinstance(name, str) or name not in known:
        raise ConfigError(
            "unknown kind of pipeline",
            where=f"{path}, kind",
            expected=f"one of {', '.join(known)}",
            got=repr(name),
            remedy=did_you_mean(name, known, f"leave kind out for a pipeline of {DEFAULT}"),
        )
    return name


def data_of_pipeline(path: Path) -> DataSource | None:
    """The data that a pipeline gives.

    Args:
        path: What may be one.

    Returns:
        They; ``None`` where it is no file of a pipeline.

    Raises:
        ConfigError: If it is a pipeline of a kind that gives none, or one that cannot be used.
    """
    if path.suffix.lower() not in {".yaml", ".yml"} or not path.is_file() or "kind" not in read_yaml(path):
        return None
    known, name = kinds(), kind_of(path)
    address = known[name].data
    if address is None:
        raise ConfigError(
            "a pipeline is named where data are asked for", where=path,
            expected=f"a data set, or a pipeline of kind {', '.join(key for key, row in known.items() if row.data)}",
            got=f"kind: {name}", remedy="name the data set",
        )  # fmt: skip
    source: type[DataSource] = _load(address)
    return source.at(path)


def _load(address: str) -> Any:
    module, _, attribute = address.partition(":")
    return getattr(import_module(module), attribute)
