"""A pipeline whose product is a data set, as steps: each kept by its content, then ``dataset.yaml``, loaded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid.atomic import write_bytes
from sysid.field_checks import check
from sysid.ingest import load_dataset
from sysid.plugins import find_plugin
from sysid.traces import TraceSet
from sysid.workbench.making.config import MakingConfig
from sysid.workbench.making.maker import GROUP, Maker
from sysid.workbench.runner.kept_steps import kept_steps
from sysid.workbench.runner.naming import cases_of
from sysid.workbench.runner.program import Closing, Program
from sysid.workbench.runner.run import Run
from sysid.workbench.runner.steps import Outlined, Step, Work
from sysid.workbench.written import Written
from sysid.yaml_files import yaml_text

if TYPE_CHECKING:
    from sysid.workbench.kinds import RunRequest

FILE = "dataset.yaml"
TITLE = "Playing"
LOADING = Outlined(name="data", title="Loading the traces")


def program(request: RunRequest) -> Program[TraceSet]:
    """What ``sysid run`` does of a pipeline that makes a data set.

    Args:
        request: What was asked.

    Returns:
        The program.

    Raises:
        UserError: If the pipeline or an option cannot be used.
    """
    written = Written.read(MakingConfig, request.path)
    config = written.config
    maker: Maker = find_plugin(GROUP, config.kind, what="maker", where=request.path)
    options = check(maker.options, config.options, where=f"{request.path}, options")
    work = _Making(config=config, maker=maker, options=options)
    return Program(
        name=config.name,
        keep=written.keep,
        steps=work.run,
        outline=lambda: [Outlined(name=TITLE, title=TITLE), LOADING],
        closing=closing,
        tracked=False,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Making:
    """The steps of one pipeline."""

    config: MakingConfig
    maker: Maker
    options: Any

    def run(self, run: Run) -> TraceSet:
        asked = self.maker.steps(self.options)
        done = run.do_all(TITLE, kept_steps(asked, title=TITLE, version=self.maker.version, store=run.store))
        results = {step.name: one.value for step, one in zip(asked, done, strict=True)}
        return run.do(self._loading(run, results)).value

    def _loading(self, run: Run, results: Mapping[str, Any]) -> Step[TraceSet]:
        """Write the data set and load its traces, which shows that it can be used."""

        def make(work: Work) -> TraceSet:
            return load_dataset(
                self._written(run, results),
                progress=lambda case, index, count: work.say(f"{case} ({index + 1} of {count})", index / count),
            )

        return Step(
            name=LOADING.name,
            title=LOADING.title,
            make=make,
            outcome=cases_of,
        )

    def _written(self, run: Run, results: Mapping[str, Any]) -> Path:
        fields = {
            "name": self.config.name,
            "description": self.config.description,
            **self.maker.dataset(self.options, results),
        }
        file = run.store.path / FILE
        write_bytes(file, f"# Made by: {run.command}\n\n{yaml_text(fields)}".encode())
        return file


def closing(traces: TraceSet, folder: Path) -> Closing:
    """What is said at the end: the traces, and how they are used.

    Args:
        traces: The data set.
        folder: The run folder.

    Returns:
        The lines.
    """
    file = folder.resolve() / FILE
    roles = ", ".join(f"{trace.name} ({traces.roles[trace.name].value})" for trace in traces)
    return Closing(
        lines=[
            f"{len(traces)} traces: {roles}",
            f"Data set: {file}",
            f"Look at it with: sysid ingest {file}",
            f"Fit or choose on it with data: {file}, or selection: {file}, in a pipeline",
        ]
    )
