"""Candidates out of a sweep: the best fits that it trained to the end, as they are."""

from __future__ import annotations

from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.estimation.estimators import estimator_of
from sysid.models import Mapping
from sysid.reporting.sweep_record import read_sweep
from sysid.workbench.assembly.context import Context
from sysid.workbench.assembly.member_config import MemberConfig
from sysid.workbench.sweep.store import TRIALS, TrialStore


def swept(context: Context, member: MemberConfig) -> list[FitResult]:
    """The best fits of a member's sweep.

    Args:
        context: The run.
        member: The member.

    Returns:
        The fits, the best first; none where it names no sweep.

    Raises:
        ConfigError: If the sweep is of another mapping, or has no network.
    """
    source = member.sweep
    if source is None:
        return []
    folder = (context.beside / source.run).resolve()
    record, trials = read_sweep(folder), TrialStore(path=folder / TRIALS)
    if Mapping.parse(record.mapping) != member.mapping:
        raise ConfigError(
            "the sweep is of another mapping than the member",
            where=folder,
            expected=str(member.mapping),
            got=record.mapping,
            remedy="name a sweep of the member's mapping",
        )
    found = list[FitResult]()
    for trial in sorted(record.tried_in_full, key=lambda one: (record.choice(one), one.number)):
        if len(found) == source.keep:
            break
        stored = trials.read(trial.key)
        fit = None if stored is None else FitResult.from_dict(stored["fit"])
        if fit is not None and estimator_of(fit.model.structure).joins:
            found.append(fit)
    if not found:
        raise ConfigError(
            "the sweep has no network to take",
            where=folder,
            expected=f"fits of {member.mapping} that were trained to the end, in {TRIALS}",
            got=f"{len(record.trials)} trials",
            remedy="run the sweep again: sysid sweep NAME",
        )
    return found
