"""Dead times of state spaces: inputs that come later, by as much as the structure says or as the records show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sysid.errors import FitDivergedError, TraceError, UserError
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear.begun_at_rest import left_out
from sysid.estimation.linear.delay_search import check_max_delay, searched_delays
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.search import quick_size
from sysid.estimation.linear.state_space.training import StateSpaceTraining
from sysid.estimation.linear.subspace.starts import ENOUGH
from sysid.estimation.nonparametric.dead_time import likely, longest_dead_time
from sysid.estimation.records.experiment import Experiment
from sysid.models import History, LinearStateSpace
from sysid.models.linear.linear_state_space import AUTO


def behind_dead_times(
    segments: Sequence[Segment], orders: LinearStateSpace, training: StateSpaceTraining
) -> tuple[LinearStateSpace, tuple[Segment, ...], tuple[str, ...]]:
    """Records as the states behind the dead times see them.

    Args:
        segments: The records, in scaled numbers.
        orders: The structure; dead times that it leaves open are searched.
        training: How far to search.

    Returns:
        The structure with its dead times, the records with inputs that are as late, and what is to be said of it.

    Raises:
        ConfigError: If a largest dead time is asked for and none is searched.
        TraceError: If no record is longer than the dead times.
    """
    check_max_delay(training.max_delay, searched=orders.nk == AUTO, field="nk")
    if orders.nk != AUTO:
        return orders, late(segments, orders), ()
    m = segments[0].inputs.shape[1]
    if not m:
        return replace(orders, nk=()), tuple(segments), ()
    looked = [segment.first(ENOUGH) for segment in segments]
    most = longest_dead_time([len(one) for one in looked]) if training.max_delay is None else training.max_delay
    least, most = orders.shortest, max(orders.shortest, most)
    with one_blas_thread():

        def loss(delays: tuple[int, ...], unknown: int) -> float:
            tried = replace(orders, nk=delays)
            try:
                return quick_size(late(looked, tried, unknown=unknown - orders.shortest), tried, training)
            except (
                UserError,
                FitDivergedError,
                np.linalg.LinAlgError,
                ValueError,
            ):  # nothing that can be fitted, or run
                return np.inf

        delays, told = searched_delays(_places(looked, orders.states, most, least), least, most, loss)
    found = replace(orders, nk=delays)
    return found, late(segments, found), (f"Dead times in samples: {', '.join(map(str, delays))}.", *told)


def late(segments: Sequence[Segment], orders: LinearStateSpace, *, unknown: int | None = None) -> tuple[Segment, ...]:
    """Records with inputs that come later by the dead times of a structure.

    Args:
        segments: The records, in scaled numbers.
        orders: The structure.
        unknown: First samples that are left out where nothing is known of what came before; by default those whose
            inputs stood there. Dead times are compared on the same samples.

    Returns:
        Those that are long enough.

    Raises:
        TraceError: If none is.
    """
    shifts = orders.shifts(segments[0].inputs.shape[1])
    lost, dead = (max(shifts, default=0), min(shifts, default=0)) if unknown is None else (unknown, 0)
    beginnings = [(one.inputs, one.outputs, None if one.whole else one.root_weights > 0.0) for one in segments]
    rows = left_out(beginnings, lost, dead + orders.shortest) if lost else [0] * len(segments)
    found = [one.delayed(shifts, unknown=n, masked=orders.noise) for one, n in zip(segments, rows, strict=True)]
    longest = max(map(len, found))
    if longest <= orders.states:
        raise TraceError(
            "no record is longer than the dead time and the states",
            expected=f"more than {lost + orders.states} samples",
            got=f"{max(map(len, segments))} samples",
            remedy="shorten the dead times, or use longer records",
        )
    return tuple(one for one in found if len(one))


def _places(segments: Sequence[Segment], states: int, most: int, least: int) -> list[list[int]]:
    """For each input the dead times about which to look, by correlation with each output."""
    m, p = segments[0].inputs.shape[1], segments[0].outputs.shape[1]
    found: list[list[int]] = [[] for _ in range(m)]
    for o in range(p):
        records = [
            Experiment(
                inputs=one.inputs,
                output=one.outputs[:, o],
                history=History(inputs=one.inputs[:1], output=one.outputs[:1, o]),
                weights=None if one.whole else one.root_weights**2,
            )
            for one in segments
        ]
        for j, places in enumerate(likely(records, (states,) * m, most, least)):
            found[j] += places
    return [list(dict.fromkeys(of)) for of in found]
