"""What an assembly is trained on: traces to fit and traces that choose, with what the known members say of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

from sysid.composite.fixed_members import with_known
from sysid.composite.limit_check import LimitCheck, check_limits
from sysid.composite.members import dealt
from sysid.errors import ConfigError
from sysid.traces import Role, Trace, TraceSet
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.context import Context
from sysid.workbench.assembly.rehearsal import rehearse


@dataclass(frozen=True, kw_only=True, eq=False)
class Material:
    """The traces of a run, the same for all of its starts.

    Args:
        estimation: Traces to fit.
        selection: Traces that choose.
        also: Of each data set that some rounds have beside the others, its traces to fit and those that choose.
        pool: Sequences to grow by and sequences that say what a round has brought, if that was asked for.
        limits: What is declared of limits, beside all that is fitted.
        fitted: Names of the data sets that have traces to fit among these.
        chosen: Names of those that have traces which choose.
    """

    estimation: tuple[Trace, ...]
    selection: tuple[Trace, ...]
    also: Mapping[str, tuple[list[Trace], list[Trace]]]
    pool: tuple[list[Trace], list[Trace]] | None
    limits: LimitCheck
    fitted: tuple[str, ...]
    chosen: tuple[str, ...]

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
        choosing = training if config.selection is None else [*training, context.load(config.selection)]
        estimation = dealt([one.with_role(Role.ESTIMATION) for one in training])
        selection = [trace for one in choosing for trace in one.with_role(Role.SELECTION)]
        if not estimation or not selection:
            raise _lacks_a_role("the training data lack a role", *training)
        estimation, selection = with_known(config.known, estimation), with_known(config.known, selection)
        beside = {name: context.load(name) for name in (config.together.data if config.together else ())}
        pool = None if config.grow is None else context.load(config.grow.data)
        also = {name: _beside(config, one) for name, one in beside.items()}
        rehearse(config, estimation[0])
        limits = check_limits(config, [*estimation, *chain.from_iterable(one for one, _ in also.values())])
        more = [*beside.values(), *([] if pool is None else [pool])]
        return cls(
            estimation=tuple(estimation),
            selection=tuple(selection),
            also=also,
            pool=None if pool is None else _pool(config, pool),
            limits=limits,
            fitted=_having(Role.ESTIMATION, [*training, *more]),
            chosen=_having(Role.SELECTION, [*choosing, *more]),
        )

    @property
    def choosing(self) -> tuple[Trace, ...]:
        """All traces that choose between wholes, the pool's that train nothing among them."""
        held_out = () if self.pool is None else self.pool[1]
        return (*self.selection, *chain.from_iterable(chosen_by for _, chosen_by in self.also.values()), *held_out)


def _beside(config: AssemblyConfig, found: TraceSet) -> tuple[list[Trace], list[Trace]]:
    """A data set that some rounds have beside the others: to fit, and to choose by if it has such."""
    if not (traces := found.with_role(Role.ESTIMATION)):
        raise _lacks_a_role("the data of a round lack a role", found)
    return with_known(config.known, traces), with_known(config.known, found.with_role(Role.SELECTION))


def _pool(config: AssemblyConfig, found: TraceSet) -> tuple[list[Trace], list[Trace]]:
    """A data set to grow by: sequences to add, and sequences that train nothing."""
    sources, held_out = found.with_role(Role.ESTIMATION), found.with_role(Role.SELECTION)
    if not sources or not held_out:
        raise _lacks_a_role("the pool lacks a role", found)
    return with_known(config.known, sources), with_known(config.known, held_out)


def _having(role: Role, found: Sequence[TraceSet]) -> tuple[str, ...]:
    """Names of the data sets that have traces in a role, each once."""
    return tuple(dict.fromkeys(one.name for one in found if one.with_role(role)))


def _lacks_a_role(what: str, *found: TraceSet) -> ConfigError:
    """What is said of data without traces to fit, or without any that choose."""
    return ConfigError(
        what,
        where=f"data set {', '.join(one.name for one in found)}",
        expected="cases with role: estimation, and cases with role: selection",
        got=", ".join(f"{name}: {role.value}" for one in found for name, role in one.roles.items()),
        remedy="give some cases that role in the data set's dataset.yaml",
    )
