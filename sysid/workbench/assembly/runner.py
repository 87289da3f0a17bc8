"""A run of an assembly: every fit and every stage on disk before it is announced, and found again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sysid.composite import train
from sysid.errors import ConfigError
from sysid.models import Cascade, cascade_from_dict
from sysid.reporting.assembly.document import headline
from sysid.reporting.assembly.results import AssemblyResults
from sysid.reporting.comparing.published import read_published
from sysid.workbench.assembly.begun import read_whole
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.context import Context
from sysid.workbench.assembly.extending import read_joined
from sysid.workbench.assembly.finish import ASSEMBLY, LINE, Finish
from sysid.workbench.assembly.line import StoredLine
from sysid.workbench.assembly.material import Material
from sysid.workbench.assembly.swept import swept
from sysid.workbench.kinds import RunRequest
from sysid.workbench.runner.environment import environment
from sysid.workbench.runner.naming import nearby
from sysid.workbench.runner.store import RunFolder, read_json, write_json
from sysid.yaml_files import check


def run_assembly(request: RunRequest) -> int:
    """Run a pipeline of kind ``assembly``.

    Args:
        request: What was asked.

    Returns:
        Exit code: 0, or 1 if everything is done and stored but something could not be tracked.

    Raises:
        UserError: If the pipeline or its data cannot be used.
    """
    from sysid.workbench.runner.listeners import Audience, typed_command

    joined = read_joined(request.path)
    config = check(AssemblyConfig, joined.data, where=joined.origins)
    folder = (request.out or Path("runs") / config.name).resolve()
    command, audience = typed_command("run", request.typed, request.out), Audience.of(tracking=request.tracking)
    audience.log.write_to(folder, command)
    context = Context(
        config=config,
        joined=joined,
        beside=request.path.parent,
        store=RunFolder(path=folder),
        command=command,
        fresh=request.fresh,
        watchers=audience.watchers,
    )
    try:
        with context.store.locked():
            results, page = _run(context)
    finally:
        audience.screen.close()
    audience.target.print()
    audience.target.print(headline(results), soft_wrap=True)
    return audience.end({"Report": nearby(page), "Results": nearby(context.store.results)})


def _run(context: Context) -> tuple[AssemblyResults, Path]:
    """Every step, in order; the results and the page."""
    context.joined.keep(context.store.path)
    write_json(context.store.path / "environment.json", environment())
    if context.config.published_models is not None:
        read_published(context.config.published_models)  # a wrong name is said now, not when all is trained
    config, notes = context.config, list[str]()
    cases, material, begin = context.load(config.data), Material.of(context), None
    if config.begin is not None:
        begin, said = read_whole(context.beside / config.begin)
        notes.append(said)
    given = {member.mapping.output: swept(context, member) for member in config.members}
    trained = train(config.composite, config.plan, material.data, begin=begin, given=given, keeper=context)
    finish = Finish(context=context, trained=trained, notes=(*notes, *trained.notes))
    results = finish.results(cases, material)
    page = finish.report()
    finish.track(results, page)
    return results, page


def read_assembly(folder: Path) -> Cascade:
    """The assembly that a run chose.

    Args:
        folder: Its run folder.

    Returns:
        The cascade.

    Raises:
        ConfigError: If the run has not come so far.
    """
    return cascade_from_dict(_left(folder, ASSEMBLY, "the run has no assembly"))


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
