"""Which structures are worth a try, with the orders that the record asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sysid.advice.finding import Finding, Suggestion
from sysid.advice.record import Record
from sysid.errors import UserError
from sysid.estimation.linear.order_search import Criterion, OrderGrid, search_orders
from sysid.models import ARX, NARX, NeuralStateSpace, Start, StartKind, TransferFunction

NOT_LINEAR = {"linearity.curved", "linearity.distorted", "linearity.perhaps_curved", "linearity.nothing_explained"}
NOT_LINEAR |= {"channel.clipped_above", "channel.clipped_below"}
"""Findings that ask for a network."""
NOISY, FEEDBACK = {"noise.some", "noise.loud", "noise.coloured"}, {"feedback.found", "feedback.exchanged"}
MOST_ORDER, MOST_CANDIDATES = 8, 60_000


def suggestions(record: Record, findings: Sequence[Finding]) -> tuple[Suggestion, ...]:
    """Structures, the simplest first.

    Args:
        record: The record.
        findings: What was found in it.

    Returns:
        None where nothing is known of the dynamics.
    """
    codes = {finding.code for finding in findings}
    chosen = _arx(record)
    if chosen is None:
        return ()
    arx, order = chosen
    at_edge = max(arx.na, *arx.nb, 0) >= order
    found = [Suggestion(structure=arx, code="structure.arx", at_edge=at_edge)]
    if record.moving and "linearity.nothing_explained" not in codes:
        poles = min(max(arx.na, 1), 4)
        m = len(arx.nb)
        delays = tuple(max(int(k), 0) for k in arx.nk)
        transfer = TransferFunction(poles=(poles,) * m, zeros=(poles - 1,) * m, delays=delays)
        if codes & NOISY and not codes & (FEEDBACK | NOT_LINEAR):
            found.insert(0, Suggestion(structure=transfer, code="structure.transfer_function_noise"))
        else:
            found.append(Suggestion(structure=transfer, code="structure.transfer_function"))
    if record.integrates:
        sums = NeuralStateSpace(states=2, neurons=2 if codes & NOT_LINEAR else 0, integrators=1)
        found.append(Suggestion(structure=sums, code="structure.integrates"))
    if codes & NOT_LINEAR:
        lags = max(arx.na, 2)
        late = 0 if "linearity.nothing_explained" in codes else max(arx.nk, default=0) + 1
        network = NARX(input_delays=max(lags, late), output_delays=lags, neurons=8)
        found.append(Suggestion(structure=network, code="structure.network"))
    return tuple(found)


def _arx(record: Record) -> tuple[ARX, int] | None:
    """The ARX structure of least BIC, its dead times near those of the impulse response, and the largest order."""
    some = record.some
    impulse = record.impulse
    m = len(some.mapping.inputs)
    dead = [] if isinstance(impulse, str) else [one.best for one in impulse.dead_times]
    if m and (isinstance(impulse, str) or not any(one.acts for one in impulse.dead_times)):
        return None
    # The grid has the same range of dead times for each input: what they have in common is taken off the inputs.
    low = max(min(dead, default=0) - 1, 0)
    if not isinstance(some.feedback, str) and some.feedback.at_once:
        low = max(low, 1)
    spread = min(max(dead, default=0) + 1 - low, 4) if dead else 0
    samples = sum(map(len, some.segments))
    order = next(
        (n for n in range(MOST_ORDER, 0, -1) if 4 * (n + m * (n + low + spread) + 1) <= samples
         and OrderGrid(max_na=n, max_nb=n, max_nk=low + spread, min_nk=low).size(m) <= MOST_CANDIDATES),
        None,
    )  # fmt: skip
    if order is None:
        return None
    grid = OrderGrid(max_na=order, max_nb=order, max_nk=low + spread, min_nk=low)
    try:
        losses = search_orders(some.traces, some.mapping, grid, start=Start(kind=StartKind.ESTIMATED), workers=1)
    except UserError:
        return None
    best = losses.best(Criterion.BIC)
    if m == len(record.mapping.inputs):
        return best, order
    # Inputs that never move have a place in the mapping all the same.
    places = {name: k for k, name in enumerate(some.mapping.inputs)}
    nb = tuple(best.nb[places[name]] if name in places else 0 for name in record.mapping.inputs)
    nk = tuple(best.nk[places[name]] if name in places else 0 for name in record.mapping.inputs)
    return replace(best, nb=nb, nk=nk), order
