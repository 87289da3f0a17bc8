"""A run of a pipeline whose product is a data set: steps done or found again, ``dataset.yaml`` written and loaded."""

from __future__ import annotations

from pathlib import Path

import yaml

from sysid.ingest import load_dataset
from sysid.traces import TraceSet
from sysid.workbench.kinds import RunRequest
from sysid.workbench.making.config import MakingConfig
from sysid.workbench.making.maker import find_maker
from sysid.workbench.runner.environment import environment
from sysid.workbench.runner.events import StepDone, StepProgress, StepStarted, Watcher
from sysid.workbench.runner.kept_steps import do_steps
from sysid.workbench.runner.store import RunFolder, write_bytes, write_json
from sysid.yaml_files import check, read_yaml

FILE = "dataset.yaml"


def run_making(request: RunRequest) -> int:
    """Make a data set.

    Args:
        request: What was asked.

    Returns:
        Exit code 0.

    Raises:
        UserError: If the pipeline or an option cannot be used.
    """
    from sysid.workbench.runner.listeners import Audience, typed_command

    config = check(MakingConfig, read_yaml(request.path), where=request.path)
    store = RunFolder(path=(request.out or Path("runs") / config.name).resolve())
    command, audience = typed_command("run", request.typed, request.out), Audience.of(tracking=False)
    audience.log.write_to(store.path, command)
    try:
        with store.locked():
            write_bytes(store.path / "pipeline.yaml", request.path.read_bytes())
            write_json(store.path / "environment.json", environment())
            file = _make(config, request, store=store, tell=audience.tell, command=command)
            traces = _load(file, audience.tell)
    finally:
        audience.screen.close()
    roles = ", ".join(f"{trace.name} ({traces.roles[trace.name].value})" for trace in traces)
    audience.target.print(f"\n{len(traces)} traces: {roles}", soft_wrap=True)
    audience.target.print(f"Data set: {file}\nLook at it with: sysid ingest {file}", soft_wrap=True)
    audience.target.print(f"Fit or choose on it with data: {file}, or selection: {file}, in a pipeline", soft_wrap=True)
    return 0


def _make(config: MakingConfig, request: RunRequest, *, store: RunFolder, tell: Watcher, command: str) -> Path:
    maker = find_maker(config.kind, where=request.path)
    options = check(maker.options, config.options, where=f"{request.path}, options")
    results = do_steps(
        maker.steps(options), title="Playing", version=maker.version, store=store, fresh=request.fresh, tell=tell
    )
    fields = {"name": config.name, "description": config.description, **maker.dataset(options, results)}
    text = yaml.safe_dump(fields, sort_keys=False, allow_unicode=True, width=116, default_flow_style=None)
    file = store.path / FILE
    write_bytes(file, f"# Made by: {command}\n\n{text}".encode())
    return file


def _load(file: Path, tell: Watcher) -> TraceSet:
    """The traces, which shows that the data set can be used."""
    step = "Loading the traces"
    tell(StepStarted(step=step))
    traces = load_dataset(
        file,
        progress=lambda case, index, count: tell(
            StepProgress(step=step, fraction=index / count, detail=f"{case} ({index + 1} of {count})")
        ),
    )
    tell(StepDone(step=step, stored=False, detail=f"{len(traces)} cases of {traces.name}"))
    return traces
