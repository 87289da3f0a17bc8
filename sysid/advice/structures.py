"""Which structures are worth a try, with the orders that the record asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sysid.advice.finding import Finding, Suggestion
from sysid.advice.record import Record
from sysid.models import ARX, NARX, NeuralStateSpace, TransferFunction

NOT_LINEAR = {"linearity.curved", "linearity.distorted", "linearity.perhaps_curved", "linearity.nothing_explained"}
NOT_LINEAR |= {"linearity.curved_state"}
NOT_LINEAR |= {"channel.clipped_above", "channel.clipped_below"}
"""Findings that ask for a network."""
NOISY, FEEDBACK = {"noise.some", "noise.loud", "noise.coloured"}, {"feedback.found", "feedback.exchanged"}


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
    if record.runs_away:
        return tuple(found)  # of others the free run is fitted, and there is none
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
    if codes & NOT_LINEAR and "sampling.at_once" in codes and len(record.mapping.inputs) == 1:
        curve = NARX(input_delays=[0], output_delays=[], neurons=8)
        found.append(Suggestion(structure=curve, code="structure.curve"))
    elif codes & NOT_LINEAR:
        lags = max(arx.na, 2)
        late = 0 if "linearity.nothing_explained" in codes else max(arx.nk, default=0) + 1
        network = NARX(input_delays=max(lags, late), output_delays=lags, neurons=8)
        found.append(Suggestion(structure=network, code="structure.network"))
    return tuple(found)


def _arx(record: Record) -> tuple[ARX, int] | None:
    """The ARX structure of least BIC for all inputs, and the largest order that was tried."""
    found = record.equation
    if found is None:
        return None
    some, best = record.some, found.structure
    if len(some.mapping.inputs) == len(record.mapping.inputs):
        return best, found.order
    # Inputs that never move have a place in the mapping all the same.
    places = {name: k for k, name in enumerate(some.mapping.inputs)}
    nb = tuple(best.nb[places[name]] if name in places else 0 for name in record.mapping.inputs)
    nk = tuple(best.nk[places[name]] if name in places else 0 for name in record.mapping.inputs)
    return replace(best, nb=nb, nk=nk), found.order
