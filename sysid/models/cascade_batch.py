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
from sysid.models.cascade_run import CascadeRun, Level
from sysid.models.cascade_stages import CompiledStage, ModelStage
from sysid.models.wiring import Wiring

MAX_LANES = 32
"""Records in lockstep at most: their past must stay in the second-level cache."""

MIN_LANES = 20
"""Records from which lockstep pays (measured: 8 records take 14 ms each, 20 records 7.2, 24 records 5.9; alone 7.1)."""

MOST_NEURONS = 12
"""Neurons of a member up to which lockstep pays: with more the sums of all lanes no longer stay in registers (measured,
three members of as many neurons, 50 records of 4,000 samples: with 4 neurons 0.42 ms a record, one by one 0.52; with 12
as long; with 16 0.68 and 0.57, with 40 1.15 and 0.79; with none, 0.34 and 0.21)."""


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

    Many records of small networks run in lockstep, whose sums are taken in another order: results agree with those of
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
    n, workers = len(inputs), max(1, workers)
    stage = cascade.stages[0]
    if len(cascade.stages) > 1 or not isinstance(stage, CompiledStage) or n < MIN_LANES * workers:
        return simulate_family([cascade] * n, inputs, rest=rest, workers=workers)
    if not 0 < stage.program.neurons.max(initial=0) <= MOST_NEURONS:
        return simulate_family([cascade] * n, inputs, rest=rest, workers=workers)
    values, held = cascade.empty(*inputs.shape[:2])
    values[..., : len(cascade.inputs)] = inputs
    levels = np.stack([cascade.levels(record[0], rest) for record in inputs])
    # As many groups as a multiple of the workers, so that all end together.
    groups = workers * -(-n // (workers * MAX_LANES))
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
