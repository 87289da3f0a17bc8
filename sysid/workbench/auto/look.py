"""What is in a record that a search goes by: orders, dead times, what is suggested, what is wrong with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from sysid.advice import Advice, Verdict, advise, looked_at
from sysid.advice.dynamics import INTEGRATES
from sysid.api.order_search import OrderSearch
from sysid.api.orders import search_orders
from sysid.errors import UserError
from sysid.estimation.linear.state_space.orders import StateOrders, state_orders
from sysid.estimation.records.output_ends import found_ends
from sysid.estimation.records.static_maps import is_static
from sysid.estimation.resets import derived_from, found_resets, grey_box_of, switches
from sysid.models import ARX, AbstractStructure, Mapping, Start, StartKind, VectorGreyBox
from sysid.reporting.advice.record import AdviceRecord
from sysid.reporting.advice.words import lines
from sysid.traces import Role, Trace, TraceSet
from sysid.workbench.auto.jumps import jumps_of
from sysid.workbench.auto.mechanisms import mechanism_of
from sysid.workbench.auto.parts import FEW, ends_held_out
from sysid.workbench.fits.data import Data

NOISE = 0.02
"""Share of its largest value by which a channel of one sign may be beyond nought."""
ARX_TRIED = 3
"""Of the shortlist of an order search."""
ORDER_SEARCH = 0.2
"""Of what a look at an output takes, what a search for its orders does."""
MOST_SHOWN = 12
"""States that are looked for in the canonical correlations."""
LOOKED_AT = 3_000
"""Samples of whole records without noise that tell as much of orders and dead times as all of them."""
HALF = 0.5
"""Share of the variance of what is to come that the past has to explain for a state to be a clear one."""
MOVED = 0.01
"""Share of an output's range by which it may move while the inputs have yet to, and still be said to begin at rest."""


@dataclass(frozen=True, kw_only=True)
class Looked:
    """What a search knows before its first trial.

    Args:
        n_inputs: Inputs of the mapping.
        n_outputs: Outputs of the mapping.
        orders: ARX structures that are worth a try, best first; the first says how many past samples matter.
        never_negative: Whether no output ever is, so that its sensor may not tell a sign.
        suggested: What ``sysid advise`` suggests.
        cautions: What it asks to be looked at, in words.
        ends: Whether an output stands at an end while inputs move on, as what integrates until it meets a stop: then
            what holds outputs there is tried first.
        all_end: Whether every one does, so that each may have a model of its own.
        integrators: Outputs that add up what inputs bring: neural state spaces then have as many integrators.
        in_motion: Whether outputs move before any input does though each run begins as if they had stood: then what
            remembers one sample, or learns where it begins, is tried first.
        states: Of the best linear state space, once linear models were tried; 0 before.
        shown: States that stand out of what the past says of the future; 0 where that cannot be told.
        clear: Of these the ones of whose future the past says more than half.
        exact: Whether who searches asks for a tolerance, as of a model's records, which have no noise: sizes of
            networks are then tried before weights that hold noise down.
        resets: Where outputs jump and are linear between, the equations of that: then it is tried before all else.
        mechanism: Where friction holds an output, or play an input, equations of that, the likeliest first: they are
            tried next.
        static: Whether outputs follow from inputs at the same time alone: then curves without memory are tried first.
        seen_from: Samples after which an input is seen to act first, in a response that takes no drift for its own.
    """

    n_inputs: int
    n_outputs: int
    orders: tuple[ARX, ...] = ()
    never_negative: bool = False
    suggested: tuple[AbstractStructure, ...] = ()
    cautions: tuple[str, ...] = ()
    in_motion: bool = False
    ends: bool = False
    all_end: bool = False
    integrators: int = 0
    states: int = 0
    shown: int = 0
    clear: int = 0
    exact: bool = False
    static: bool = False
    seen_from: int | None = None
    resets: VectorGreyBox | None = None
    mechanism: tuple[VectorGreyBox, ...] = ()

    @property
    def lags(self) -> int:
        """Past samples that a network of lags looks at first, from 2 to 6."""
        return min(max(self.orders[0].na, 2), 6) if self.orders else 2

    @property
    def needed(self) -> int:
        """States that the plant may have, by the best linear model of it.

        Where a curve bends what comes between two filters, errors of a free run hide all but the slowest few of their
        states, and those that the past shows count; but noise of many colours shows many too: twice as many at most.
        """
        return max(self.states, min(self.shown, 2 * self.states))

    @property
    def delay(self) -> int:
        """The least dead time, in samples; 1 where it is not known."""
        ordered = min(self.orders[0].nk, default=1) if self.orders else 1
        # The best free run of a record that drifts, or adds up, may have a dead time that is not there.
        return ordered if self.seen_from is None else min(ordered, self.seen_from)


def look(data: Data, mapping: Mapping, start: Start, *, exact: bool = False) -> Looked:
    """Look at what is fitted and what chooses; at nothing else.

    Args:
        data: The traces of the pipeline.
        mapping: Inputs and outputs.
        start: How each free run begins.
        exact: As for :class:`Looked`.

    Returns:
        What was found.
    """
    known = seen_of(data, exact=exact).traces
    few = known.with_role(Role.ESTIMATION)
    advice = [advise(known, one, suggest=is_suggested(mapping)) for one in looked_at(mapping)]
    integrators = sum(any(finding.code == INTEGRATES for finding in one.findings) for one in advice)
    # A line that adds up would not explain a stop: what stands at its least was left there.
    ends = {} if integrators else at_ends(data.estimation, mapping)
    at_rest, shown = start.kind is StartKind.REST, _shown(few, mapping)
    held = mechanism_of(data.estimation, mapping) if at_rest else None
    return Looked(
        n_inputs=len(mapping.inputs),
        n_outputs=len(mapping.outputs),
        orders=_orders(data, known, mapping, start),
        shown=0 if shown is None else shown.chosen,
        clear=0 if shown is None else int((shown.correlations[: shown.most] ** 2 > HALF).sum()),
        exact=exact,
        static=_is_static(data.estimation, mapping),
        never_negative=all(_never_negative(data.estimation, name) for name in mapping.outputs),
        suggested=tuple(suggestion.structure for one in advice for suggestion in one.suggestions),
        cautions=(*_cautions(advice), *_not_looked_at(mapping)),
        ends=any(ends.values()),
        all_end=bool(ends) and all(ends.values()),
        integrators=integrators,
        seen_from=min(
            (int(one.figures["best"]) for each in advice for one in each.findings if one.code == "dead_time"),
            default=None,
        ),
        in_motion=start.kind in {StartKind.REST, StartKind.FIRST_SAMPLE} and bool(in_motion(data.estimation, mapping)),
        resets=resets_of(data.estimation, mapping) if at_rest else None,
        mechanism=() if held is None else held.structures,
    )


def seen_of(data: Data, *, exact: bool) -> Data:
    """What has a look: what is fitted and what chooses, or some whole traces of what is fitted.

    Args:
        data: The traces of the pipeline.
        exact: As for :class:`Looked`: a few without noise tell as much as all, and all took longer than the search.

    Returns:
        The data, whose trace set is what has a look.
    """
    if not exact:
        return replace(data, traces=_set(data, data.estimation, data.selection))
    chooses = whole_traces(data.selection, LOOKED_AT // FEW) if data.selection else ()
    return replace(data, traces=_set(data, whole_traces(data.estimation, LOOKED_AT), chooses))


def resets_of(traces: Sequence[Trace], mapping: Mapping) -> VectorGreyBox | None:
    """Equations of what is linear between events and jumps at them, as a ball that bounces.

    Args:
        traces: Records that begin at one place.
        mapping: What moves, and what answers.

    Returns:
        The equations, with no parameter that is left to estimate; ``None`` where nothing jumps, or not so.
    """
    outputs = np.concatenate([trace.columns(mapping.outputs) for trace in traces])
    # A relay that answers an input alone jumps only where that moves.
    if not (jumps_of(traces, mapping) or switches(outputs)) or any(trace.usable is not None for trace in traces):
        return None
    others = derived_from(outputs)
    own = [name for k, name in enumerate(mapping.outputs) if k not in others]
    found = found_resets([(trace.columns(mapping.inputs), trace.columns(own)) for trace in traces])
    derived = {mapping.outputs[k]: row for k, row in others.items()}
    return None if found is None else grey_box_of(found, mapping, derived)


def is_suggested(mapping: Mapping) -> bool:
    """Whether a look suggests structures: what it suggests is for one output, and a search has no use for it else.

    Args:
        mapping: Inputs and outputs.

    Returns:
        Whether there is one output.
    """
    return len(mapping.outputs) == 1


def in_motion(traces: Sequence[Trace], mapping: Mapping) -> dict[str, float]:
    """Outputs that move before any input does, which those of a system at rest do not.

    Args:
        traces: The records.
        mapping: What moves, and what answers.

    Returns:
        By how much each moves, in its unit, where that is more than :data:`MOVED` of its range.
    """
    moved = dict.fromkeys(mapping.outputs, 0.0)
    for trace in traces:
        inputs = trace.columns(mapping.inputs)
        changed = np.flatnonzero((inputs != inputs[:1]).any(axis=1))
        still = slice(0, int(changed[0]) if len(changed) else len(inputs))
        moved = {name: max(most, float(np.ptp(trace[name][still]))) for name, most in moved.items()}
    return {name: by for name, by in moved.items() if by > MOVED * span_of(traces, name)}


def at_ends(traces: Sequence[Trace], mapping: Mapping) -> dict[str, bool]:
    """Of each output whether it stands at its least or greatest value while an input moves on.

    Args:
        traces: The records.
        mapping: What moves, and what answers.

    Returns:
        The verdicts, by name.
    """
    parts = _usable(traces, mapping)
    return {
        name: found_ends([(u, y[:, k]) for u, y in parts]) != (None, None) for k, name in enumerate(mapping.outputs)
    }


def _is_static(traces: Sequence[Trace], mapping: Mapping) -> bool:
    return bool(mapping.inputs) and is_static(_usable(traces, mapping))


def _usable(traces: Sequence[Trace], mapping: Mapping) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Inputs and outputs where all of them count."""
    some = [(trace, trace.usable_of(mapping.channels)) for trace in traces]
    return [(trace.columns(mapping.inputs)[usable], trace.columns(mapping.outputs)[usable]) for trace, usable in some]


def whole_traces(traces: Sequence[Trace], most: int) -> Sequence[Trace]:
    """Some of many records, evenly spaced, of so many samples together or a few more.

    Args:
        traces: The records.
        most: Samples.

    Returns:
        All of them where they have no more, and at least :data:`FEW` otherwise.
    """
    count = max(int(np.ceil(most * len(traces) / max(sum(map(len, traces)), 1))), FEW)
    if count >= len(traces):
        return traces
    return [traces[k] for k in np.linspace(0, len(traces) - 1, count).round().astype(int)]


def span_of(traces: Sequence[Trace], name: str) -> float:
    """How far a channel moves over all records, in its unit."""
    return float(max(one[name].max() for one in traces) - min(one[name].min() for one in traces))


def _never_negative(traces: Sequence[Trace], name: str) -> bool:
    """Whether a channel has one sign, but for what its noise may do about nought."""
    least, most = min(float(one[name].min()) for one in traces), max(float(one[name].max()) for one in traces)
    return most > 0.0 and least >= -NOISE * most


def _set(data: Data, estimation: Sequence[Trace], selection: Sequence[Trace]) -> TraceSet:
    roles = dict.fromkeys([one.name for one in estimation], Role.ESTIMATION)
    roles |= dict.fromkeys([one.name for one in selection], Role.SELECTION)
    return TraceSet(name=data.traces.name, traces=(*estimation, *selection), roles=roles)


def _orders(data: Data, known: TraceSet, mapping: Mapping, start: Start) -> tuple[ARX, ...]:
    """The best ARX structures in free run over what chooses; of several outputs, what each of them needs in one."""
    fitted, chooses = known.with_role(Role.ESTIMATION), known.with_role(Role.SELECTION)
    if not chooses:
        fitted, chooses = ends_held_out(fitted)
    traces = _set(data, fitted, chooses)
    looked = looked_at(mapping, ORDER_SEARCH)
    found = [some for one in looked if (some := _orders_of(traces, one, start))]
    if len(looked) < len(mapping.outputs):  # of the others nobody knows what acts at once
        m = len(mapping.inputs)
        found.append((ARX(na=1, nb=(2,) * m, nk=(0,) * m),))
    most = max(map(len, found), default=0)
    together = [_together([some[min(k, len(some) - 1)] for some in found]) for k in range(most)]
    return tuple(dict.fromkeys(together))


def _shown(traces: Sequence[Trace], mapping: Mapping) -> StateOrders | None:
    """States by the canonical correlations of past and future, without a fit."""
    if not mapping.inputs:
        return None
    try:
        return state_orders(traces, mapping, most=MOST_SHOWN)
    except (UserError, np.linalg.LinAlgError, ValueError):  # too short, or a channel that never moves
        return None


def _orders_of(traces: TraceSet, mapping: Mapping, start: Start) -> tuple[ARX, ...]:
    try:
        found = cast("OrderSearch", search_orders(traces, mapping, start=start, workers=1))  # of one output
    except UserError:
        return ()  # too short for any: what is tried then says so itself
    structures = [one.fit.model.structure for one in found.finalists if np.isfinite(one.mean_fit)]
    return tuple(replace(one) for one in structures if isinstance(one, ARX))[:ARX_TRIED]


def _together(some: Sequence[ARX]) -> ARX:
    """One structure that has every lag of several: what acts at once on one output may act late on another.

    Example:
        >>> _together([ARX(na=1, nb=(1, 2), nk=(0, 1)), ARX(na=2, nb=(1, 1), nk=(1, 0))]).label
        'ARX [2; 2 3; 0 0]'
    """
    first = [min(lags) for lags in zip(*(one.nk for one in some), strict=True)]
    ends = [[n + k for n, k in zip(one.nb, one.nk, strict=True)] for one in some]
    last = [max(lags) for lags in zip(*ends, strict=True)]
    nb = tuple(end - begin for begin, end in zip(first, last, strict=True))
    return replace(some[0], na=max(one.na for one in some), nb=nb, nk=tuple(first))


def _not_looked_at(mapping: Mapping) -> list[str]:
    """That some outputs were not looked at."""
    n, of = len(looked_at(mapping)), len(mapping.outputs)
    if n == of:
        return []
    names = ", ".join(mapping.outputs[:n])
    return [
        f"Only {names} of {of} outputs had a look before the search and for its page, as it takes long with "
        f"{len(mapping.inputs)} inputs. sysid advise looks at any."
    ]


def _cautions(advice: Sequence[Advice]) -> list[str]:
    found = []
    for one in advice:
        output = f"{one.mapping.output}: " if len(advice) > 1 else ""
        record = AdviceRecord.model_validate(one.to_dict())
        found += [f"{output}{says} {do}".strip() for _, verdict, says, do in lines(record) if verdict == LOOK]
    return list(dict.fromkeys(found))


LOOK = Verdict.LOOK.value
