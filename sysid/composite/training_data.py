"""The traces of a composite's training: what is fitted, what chooses, and what active learning adds from."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain

from sysid.composite.active_learning import Make
from sysid.composite.composite import Composite
from sysid.composite.fixed_members import with_fixed
from sysid.errors import ConfigError
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainingData:
    """The traces of a training.

    Args:
        estimation: Traces to fit.
        selection: Traces that choose.
        also: Further sets by their names, which rounds may have beside these: traces to fit and traces that choose.
        pool: Sequences that active learning adds from, or what makes those of a round; ``None`` without it.
        held_out: Sequences that say what a round of active learning has brought, and train nothing.

    Raises:
        ConfigError: If there are no traces to fit, or none that choose.
    """

    estimation: Sequence[Trace]
    selection: Sequence[Trace]
    also: Dict[str, tuple[Sequence[Trace], Sequence[Trace]]] = field(default_factory=dict)
    pool: Sequence[Trace] | Make | None = None
    held_out: Sequence[Trace] = ()

    def __post_init__(self) -> None:
        if not self.estimation or not self.selection:
            raise ConfigError(
                "a composite is trained on traces to fit, and chosen by others",
                where="estimation, selection",
                expected="at least one trace of each",
                got=f"{len(self.estimation)} and {len(self.selection)}",
                remedy="hold some traces back for the selection",
            )
        if self.pool is not None and not self.held_out:
            raise ConfigError(
                "nothing says what a round of active learning has brought",
                where="held_out",
                expected="at least one sequence like those of the pool, which is never added",
                got="none",
                remedy="hold some sequences of the pool back",
            )

    @property
    def fitted(self) -> list[Trace]:
        """All traces that are fitted."""
        return [*self.estimation, *chain.from_iterable(one for one, _ in self.also.values())]

    @property
    def choosing(self) -> tuple[Trace, ...]:
        """All traces that choose between wholes."""
        return (*self.selection, *chain.from_iterable(chosen_by for _, chosen_by in self.also.values()), *self.held_out)

    def with_fixed(self, composite: Composite) -> TrainingData:
        """The same traces with what the fixed submodels say of the measured channels.

        Args:
            composite: What is declared.

        Returns:
            The traces; what makes sequences gives them likewise.

        Raises:
            ConfigError: If the fixed submodels cannot be wired.
            ChannelError: If a trace lacks an input of one.
        """
        seen, pool = partial(with_fixed, composite.fixed), self.pool
        made: Sequence[Trace] | Make | None = None
        if pool is not None:
            made = partial(_made, composite, pool) if callable(pool) else seen(pool)
        return TrainingData(
            estimation=seen(self.estimation),
            selection=seen(self.selection),
            also={name: (seen(fitted), seen(chosen_by)) for name, (fitted, chosen_by) in self.also.items()},
            pool=made,
            held_out=seen(self.held_out),
        )


def _made(composite: Composite, make: Make, number: int) -> Sequence[Trace]:
    return with_fixed(composite.fixed, make(number))
