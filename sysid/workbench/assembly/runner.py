"""A pipeline of kind ``assembly`` as steps, and what a run of one leaves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid.composite import train, with_fixed
from sysid.composite.rounds.times import stand_in
from sysid.errors import ConfigError
from sysid.export.exporters import wanted_formats
from sysid.field_checks import check
from sysid.models import Cascade, cascade_from_dict
from sysid.reporting.assembly.document import headline
from sysid.reporting.assembly.results import AssemblyResults
from sysid.reporting.published.tables import read_published
from sysid.workbench.assembly.beside import Beside
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.context import Context
from sysid.workbench.assembly.data import AssemblyData
from sysid.workbench.assembly.estimates import RoundEstimates
from sysid.workbench.assembly.evaluation import ASSEMBLY, Evaluating
from sysid.workbench.assembly.extending import read_joined
from sysid.workbench.assembly.interpolation import StoredInterpolation
from sysid.workbench.assembly.outline import outline
from sysid.workbench.assembly.swept import swept
from sysid.workbench.assembly.warm_start import read_whole
from sysid.workbench.judging.runner import closing
from sysid.workbench.runner.program import Program
from sysid.workbench.runner.run import Run
from sysid.workbench.runner.store import LINE, read_json

if TYPE_CHECKING:
    from sysid.workbench.kinds import RunRequest


def program(request: RunRequest) -> Program[AssemblyResults]:
    """What ``sysid run`` does of a pipeline of kind ``assembly``.

    Args:
        request: What was asked.

    Returns:
        The program.

    Raises:
        UserError: If the pipeline cannot be used.
    """
    joined = read_joined(request.path)
    config = check(AssemblyConfig, joined.data, where=joined.origins)
    estimates = RoundEstimates(config=config)

    def steps(run: Run) -> AssemblyResults:
        return _run(Context(config=config, joined=joined, beside=request.path.parent, run=run), estimates)

    return Program(
        name=config.name,
        keep=joined.keep,
        steps=steps,
        outline=lambda: outline(config, request.path.parent, estimates),
        closing=lambda results, folder: closing(headline(results), folder),
    )


def _run(context: Context, estimates: RoundEstimates) -> AssemblyResults:
    """Every step, in order."""
    config, notes = context.config, list[str]()
    if config.published_models is not None:
        read_published(config.published_models)  # a wrong name is said now, not when all is trained
    if config.export is not None:
        wanted_formats(config.export.formats)  # nor a format that cannot be written here
    beside = Beside.read(config.doubt, config.mean, config.wanted, context.beside, config.interpolation)
    cases = context.load(config.data)
    context.cases.append(cases)
    data, begin = AssemblyData.of(context), None
    estimates.data.append(data.data)
    if config.warm_start is not None:
        begin, begun = read_whole(context.beside / config.warm_start)
        notes.append(begun)
    if beside.doubting or beside.averaged:
        like = next(iter(with_fixed(config.composite.fixed, data.data.estimation[:1])))
        beside.check(stand_in(config.composite, like))  # not when all is trained
    given = {member.mapping.output: swept(context, member) for member in config.members}
    trained = train(config.composite, config.plan, data.data, begin=begin, given=given, keeper=context)
    notes += trained.notes
    for seed in config.mean.seeds if config.mean else ():
        other = config.seeded(seed)
        again = train(other.composite, other.plan, data.data, begin=begin, given=given, keeper=context.seeded(seed))
        notes += [f"Seed {seed}: {note}" for note in again.notes]
        beside = beside.and_trained(f"seed {seed}", again.model)
    notes += [one for one in [beside.sentence()] if one]
    finish = Evaluating(context=context, trained=trained, beside=beside, notes=tuple(notes))
    results = finish.results(cases, data)
    page = context.run.report(results)
    context.run.then(lambda: finish.track(results, page.value))
    return results


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


def read_interpolation(folder: Path) -> StoredInterpolation:
    """The line that a run left: every position between those that it modelled.

    Args:
        folder: Its run folder.

    Returns:
        The line, with its channels.

    Raises:
        ConfigError: If the run has not come so far, or its pipeline has no ``line``.
    """
    return StoredInterpolation.from_dict(_left(folder, LINE, "the run has no line"))


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
