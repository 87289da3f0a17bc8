"""Many records at once: the cars of a train, the sequences of a stress test."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.kernels import cascade as one_record
from sysid.kernels import cascade_lanes as kernel
from sysid.kernels.cascade_layout import Program
from sysid.models.cascades.cascade_run import CascadeRun, Level
from sysid.models.cascades.cascade_stages import CompiledStage, ModelStage
from sysid.models.cascades.wiring import Wiring

MAX_LANES = 32
"""Records in lockstep at most: their past must stay in the second-level cache."""


class Batched(Protocol):
    """What of a cascade a run over many records needs."""

    @property
    def wiring(self) -> Wiring:
        """What reads what."""

    @property
    def sample_time(self) -> float:
        """Seconds."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """Channels that no member writes."""

    @property
    def stages(self) -> tuple[CompiledStage | ModelStage, ...]:
        """What runs, in order."""

    def levels(self, first: NDArray[np.float64], rest: Dict[str, Level] | None = None) -> NDArray[np.float64]:
        """Every channel before the first sample."""

    def checked(self, inputs: NDArray[np.float64], axes: int) -> NDArray[np.float64]:
        """Inputs of the right shape, or an error."""

    def empty(self, *shape: int) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
        """Room for a run."""

    def wrapped(self, values: NDArray[np.float64], held: NDArray[np.int8]) -> CascadeRun:
        """Arrays that are filled as a run."""

    def run(
        self,
        inputs: NDArray[np.float64],
        rest: Dict[str, Level] | None,
        values: NDArray[np.float64],
        held: NDArray[np.int8],
    ) -> None:
        """Fill them with one record's run."""


def simulate_records(
    cascade: Batched, inputs: NDArray[np.float64], *, rest: Dict[str, Level] | None = None, workers: int = 2
) -> CascadeRun:
    """Free runs of one cascade over independent records of equal length.

    Where that takes less time they run in lockstep, whose sums are taken in another order: results agree with those of
    single runs to rounding, not to the last digit.

    Args:
        cascade: The cascade.
        inputs: Shape ``(n_records, n_samples, n_inputs)``.
        rest: As in :meth:`Cascade.simulate`.
        workers: Threads.

    Returns:
        One run whose arrays have a first axis of records.

    Raises:
        TraceError: If the number of inputs is not the cascade's.
        ChannelError: If a level names a channel that it cannot.
    """
    inputs = cascade.checked(inputs, 3)
    n, workers, stage = len(inputs), max(1, workers), cascade.stages[0]
    if (
        len(cascade.stages) > 1
        or not isinstance(stage, CompiledStage)
        or not lockstep_pays(stage.program, n / _groups(n, workers))
    ):
        return simulate_family([cascade] * n, inputs, rest=rest, workers=workers)
    return run_in_lockstep(cascade, stage, inputs, rest, workers)


def lockstep_pays(program: Program, records: float) -> bool:
    """Whether records in lockstep take less time than one by one, by what either was measured to take.

    In lockstep no record waits for itself, and every member's sums are taken for all lanes, whether they have a record
    or not; one by one, members without neurons are next to nothing, and those that do not read each other run as one.
    What it chooses is 1 % off the better way on average, and 11 % at most (``python -m tests.benchmarks lockstep``).

    Args:
        program: The members.
        records: How many run side by side.

    Returns:
        Whether they do; never without networks.
    """
    x, y, n = np.diff(program.regressor_first), np.diff(program.output_first), program.neurons
    gated = np.diff(program.theta_first) > n * (x + 1 + y) + y * (x + 1)
    networks, members, read = int(np.count_nonzero(n)), len(n), int(x.sum())
    # Times a sample, to a common factor.
    alone = 60 + 20 * members + 1.7 * read + 85 + 38 * networks + 3.2 * int(x[n > 0].sum()) + 0.7 * int(n.sum())
    together = 11 + 80 * members + 2.3 * read + 6.7 * int((n * (1 + gated)).sum())
    return networks > 0 and together * MAX_LANES < alone * records


def _groups(n: int, workers: int) -> int:
    """As many groups of records as a multiple of the workers, so that all end together."""
    return workers * -(-n // (workers * MAX_LANES))


def run_in_lockstep(
    cascade: Batched,
    stage: CompiledStage,
    inputs: NDArray[np.float64],
    rest: Dict[str, Level] | None,
    workers: int,
) -> CascadeRun:
    """Free runs over independent records, many at a time in the lanes of the vector registers.

    Args:
        cascade: The cascade.
        stage: All of its members.
        inputs: As for :func:`simulate_records`, checked.
        rest: As there.
        workers: Threads.

    Returns:
        As there.
    """
    n, groups = len(inputs), _groups(len(inputs), workers)
    values, held = cascade.empty(*inputs.shape[:2])
    values[..., : len(cascade.inputs)] = inputs
    levels = np.stack([cascade.levels(record[0], rest) for record in inputs])
    ends = [round(n * i / groups) for i in range(groups + 1)]
    acting = one_record.acting(*stage.planned), stage.program.bounds_in_units

    def work(group: int) -> None:
        own = slice(ends[group], ends[group + 1])
        lanes = -(-(own.stop - own.start) // 4) * 4
        kernel.run(stage.program, *acting, stage.depth, levels[own], lanes, values[own], held[own])

    with ThreadPoolExecutor(workers) as pool:
        for future in [pool.submit(work, group) for group in range(groups)]:
            future.result()
    return cascade.wrapped(values, held)


def simulate_family(
    cascades: Sequence[Batched],
    inputs: NDArray[np.float64],
    *,
    rest: Dict[str, Level] | None = None,
    workers: int = 2,
) -> CascadeRun:
    """Free runs of several cascades with the same channels, each over its own record: a model for each car.

    Args:
        cascades: One for each record.
        inputs: Shape ``(n_records, n_samples, n_inputs)``.
        rest: As in :meth:`Cascade.simulate`.
        workers: Threads.

    Returns:
        One run whose arrays have a first axis of records.

    Raises:
        ConfigError: If the cascades have different channels, or their number is not that of the records.
        TraceError: If the number of inputs is not the cascades'.
        ChannelError: If a level names a channel that it cannot.
    """
    kinds = {(one.wiring.channels, one.sample_time) for one in cascades}
    if len(cascades) != len(inputs) or len(kinds) != 1:
        raise ConfigError(
            "the cascades do not fit the records",
            expected=f"{len(inputs)} cascades with the same channels in the same order, and at least one",
            got=f"{len(cascades)} cascades of {len(kinds)} kinds",
        )
    first = cascades[0]
    inputs = first.checked(inputs, 3)
    values, held = first.empty(*inputs.shape[:2])

    def work(i: int) -> None:
        cascades[i].run(inputs[i], rest, values[i], held[i])

    with ThreadPoolExecutor(max(1, workers)) as pool:
        for future in [pool.submit(work, i) for i in range(len(inputs))]:
            future.result()
    return first.wrapped(values, held)
