"""What an assembly is trained on: traces to fit and traces that choose, out of the data sets it names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from sysid.composite import TrainingData, dealt
from sysid.composite.active_learning import Make
from sysid.errors import ConfigError
from sysid.traces import Role, Trace, TraceSet
from sysid.workbench.assembly.context import Context


@dataclass(frozen=True, kw_only=True, eq=False)
class AssemblyData:
    """The traces of a run.

    Args:
        data: What is fitted and what chooses.
        fitted: Names of the data sets that have traces to fit among these.
        chosen: Names of those that have traces which choose.
    """

    data: TrainingData
    fitted: tuple[str, ...]
    chosen: tuple[str, ...]

    @classmethod
    def of(cls, context: Context) -> AssemblyData:
        """Load what a pipeline names.

        Args:
            context: The run.

        Returns:
            The traces.

        Raises:
            ConfigError: If the data lack a role.
        """
        config = context.config
        names = (config.training,) if isinstance(config.training, str) else config.training
        training = [context.load(name) for name in names]
        choosing = training if config.selection is None else [*training, context.load(config.selection)]
        estimation = dealt([one.with_role(Role.ESTIMATION) for one in training])
        selection = [trace for one in choosing for trace in one.with_role(Role.SELECTION)]
        if not estimation or not selection:
            raise _lacks_a_role("the training data lack a role", *training)
        beside = {name: context.load(name) for name in (config.together.data if config.together else ())}
        learning, pool = config.active_learning, None
        sources: Sequence[Trace] | Make | None = None
        held_out: Sequence[Trace] = ()
        if learning is not None and learning.candidates is not None:
            held_out, sources = context.new_runs(learning, 0), partial(context.new_runs, learning)
        elif learning is not None:
            pool = context.load(learning.data)
            sources, held_out = _pool(pool)
        more = [*beside.values(), *([] if pool is None else [pool])]
        return cls(
            data=TrainingData(
                estimation=estimation,
                selection=selection,
                also={name: _beside(one) for name, one in beside.items()},
                pool=sources,
                held_out=held_out,
            ),
            fitted=_having(Role.ESTIMATION, [*training, *more]),
            chosen=_having(Role.SELECTION, [*choosing, *more]),
        )


def _beside(found: TraceSet) -> tuple[list[Trace], list[Trace]]:
    """A data set that some rounds have beside the others: to fit, and to choose by if it has such."""
    if not (traces := found.with_role(Role.ESTIMATION)):
        raise _lacks_a_role("the data of a round lack a role", found)
    return list(traces), list(found.with_role(Role.SELECTION))


def _pool(found: TraceSet) -> tuple[list[Trace], list[Trace]]:
    """A data set for active learning: sequences to add, and sequences that train nothing."""
    sources, held_out = found.with_role(Role.ESTIMATION), found.with_role(Role.SELECTION)
    if not sources or not held_out:
        raise _lacks_a_role("the pool lacks a role", found)
    return list(sources), list(held_out)


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
