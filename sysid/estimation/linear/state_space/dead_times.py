"""Dead times of state spaces: inputs that come later, by as much as the structure says or as the records show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sysid.errors import FitDivergedError, TraceError, UserError
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear.begun_at_rest import left_out
from sysid.estimation.linear.delay_search import CHANCE, FEW, check_max_delay, searched_delays
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.refinement import size_of
from sysid.estimation.linear.state_space.search import quick_size, search
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
        places = _places(looked, orders.states, most, least)
        delays, told = _searched(looked, orders, training, places, (least, most))
        if orders.noise:
            white = _searched(looked, replace(orders, noise=False), training, places, (least, most))
            if white[0] != delays and not _clearly_better(delays, white[0], looked, orders, training):
                delays, told = white
        short = (least,) * m
        if max(delays) > least + FEW and not _clearly_better(delays, short, looked, orders, training):
            delays, told = short, ()
    found = replace(orders, nk=delays)
    return found, late(segments, found), (f"Dead times in samples: {', '.join(map(str, delays))}.", *told)


def _searched(
    segments: Sequence[Segment],
    orders: LinearStateSpace,
    training: StateSpaceTraining,
    places: list[list[int]],
    ends: tuple[int, int],
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Dead times of least error after a few steps, between a shortest and a longest, and what is to be said of them."""

    def loss(delays: tuple[int, ...], unknown: int) -> float:
        tried = replace(orders, nk=delays)
        try:
            size = quick_size(late(segments, tried, unknown=unknown - orders.shortest), tried, training)
        except (UserError, FitDivergedError, np.linalg.LinAlgError, ValueError):  # nothing that can be fitted, or run
            return np.inf
        return float(np.exp(size))

    gain = -float(np.expm1(-CHANCE / max(sum(map(len, segments)), 1)))
    return searched_delays(places, *ends, loss, gain=gain)


def _clearly_better(
    delays: tuple[int, ...],
    than: tuple[int, ...],
    segments: Sequence[Segment],
    orders: LinearStateSpace,
    training: StateSpaceTraining,
) -> bool:
    """Whether a fit with some dead times is better than one with others by more than chance.

    One step ahead a model of the noise makes up for a wrong dead time of a slow plant: what a free run says of it goes,
    unless the errors speak against it, as under feedback.
    """
    unknown, sizes = max(*delays, *than) - orders.shortest, list[float]()
    for one in (delays, than):
        tried = replace(orders, nk=one)
        try:
            sizes.append(size_of(search(late(segments, tried, unknown=unknown), tried, training).covariance))
        except (UserError, FitDivergedError, np.linalg.LinAlgError, ValueError):  # nothing that can be fitted, or run
            sizes.append(np.inf)
    return sum(map(len, segments)) * (sizes[1] - sizes[0]) > CHANCE


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
