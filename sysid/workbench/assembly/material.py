"""What an assembly is trained on: traces to fit and traces that choose, with what the known members say of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain

from sysid.errors import ConfigError
from sysid.traces import Role, Trace, TraceSet
from sysid.workbench.assembly.context import Context
from sysid.workbench.assembly.known import with_known
from sysid.workbench.assembly.limit_check import LimitCheck, check_limits
from sysid.workbench.assembly.members import dealt
from sysid.workbench.assembly.rehearsal import rehearse


@dataclass(frozen=True, kw_only=True, eq=False)
class Material:
    """The traces of a run, the same for all of its starts.

    Args:
        estimation: Traces to fit.
        selection: Traces that choose.
        also: Of each data set that some rounds have beside the others, its traces to fit and those that choose.
        limits: What is declared of limits, beside all that is fitted.
    """

    estimation: tuple[Trace, ...]
    selection: tuple[Trace, ...]
    also: Mapping[str, tuple[list[Trace], list[Trace]]]
    limits: LimitCheck

    @classmethod
    def of(cls, context: Context) -> Material:
        """Load what a pipeline names, and wire the whole once.

        Args:
            context: The run.

        Returns:
            The traces.

        Raises:
            ConfigError: If the data lack a role, or the whole cannot be wired.
        """
        config = context.config
        names = (config.training,) if isinstance(config.training, str) else config.training
        training = [context.load(name) for name in names]
        estimation = dealt([one.with_role(Role.ESTIMATION) for one in training])
        selection = [trace for one in training for trace in one.with_role(Role.SELECTION)]
        if config.selection is not None:
            selection += context.load(config.selection).with_role(Role.SELECTION)
        if not estimation or not selection:
            raise lacks_a_role("the training data lack a role", *training)
        estimation, selection = with_known(config.known, estimation), with_known(config.known, selection)
        also = {name: _beside(context, name) for name in (config.together.data if config.together else ())}
        rehearse(config, estimation[0])
        limits = check_limits(config, [*estimation, *chain.from_iterable(one for one, _ in also.values())])
        return cls(estimation=tuple(estimation), selection=tuple(selection), also=also, limits=limits)

    @property
    def choosing(self) -> tuple[Trace, ...]:
        """All traces that choose between wholes."""
        return (*self.selection, *chain.from_iterable(chosen_by for _, chosen_by in self.also.values()))


def _beside(context: Context, name: str) -> tuple[list[Trace], list[Trace]]:
    """A data set that some rounds have beside the others: to fit, and to choose by if it has such."""
    found = context.load(name)
    if not (traces := found.with_role(Role.ESTIMATION)):
        raise lacks_a_role("the data of a round lack a role", found)
    known = context.config.known
    return with_known(known, traces), with_known(known, found.with_role(Role.SELECTION))


def lacks_a_role(what: str, *found: TraceSet) -> ConfigError:
    """What is said of data without traces to fit, or without any that choose.

    Args:
        what: What is wrong.
        found: The data sets.

    Returns:
        The error.
    """
    return ConfigError(
        what,
        where=f"data set {', '.join(one.name for one in found)}",
        expected="cases with role: estimation, and cases with role: selection",
        got=", ".join(f"{name}: {role.value}" for one in found for name, role in one.roles.items()),
        remedy="give some cases that role in the data set's dataset.yaml",
    )
