"""Which of a record's channels are inputs, where nobody says: their names tell, or how two of them move."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sysid.advice.feedback import exchanged
from sysid.advice.record import Record
from sysid.models import Mapping
from sysid.traces import Role, Trace, TraceSet

INPUTS: Final = frozenset(
    ["u", "in", "input", "inputs", "command", "cmd", "excitation", "pwm", "duty", "setpoint", "eingang", "entrada"]
)
OUTPUTS: Final = frozenset(["y", "out", "output", "outputs", "response", "measured", "ausgang", "saida", "salida"])
"""What an engineer calls them; a word of a name, without its digits."""

SELDOM: Final = 0.5
"""What is set by steps moves at fewer samples than this part."""

LEAST: Final = 5
"""Moves that show how a channel moves."""

FAR: Final = 0.1
"""A step that was set goes through this part of the range; what a converter rounds moves by the least it can."""

FORETOLD: Final = 0.5
"""Steps of which the other channel's past explains this part and more are its samples, or a controller's."""

SEEN: Final = 20_000
"""Samples that are looked at."""


@dataclass(frozen=True, kw_only=True)
class Guess:
    """A mapping that was guessed.

    Attributes:
        mapping: Inputs and outputs.
        reason: What told them apart; empty where nothing did, and the last channel is taken for the output.
    """

    mapping: Mapping
    reason: str = ""


def guessed(traces: TraceSet) -> Guess | None:
    """Inputs and outputs of a data set: by the names of its channels, else, of two, by how they move.

    Args:
        traces: The data set; its estimation and selection traces are looked at, all where there are none.

    Returns:
        The mapping, or none: of three channels and more whose names do not tell, nothing does.
    """
    names = tuple(channel.name for channel in traces.channels)
    if len(names) < 2:
        return Guess(mapping=Mapping(inputs=(), outputs=names))
    given = Mapping(inputs=names[:-1], outputs=names[-1:])
    if (named := _by_names(names)) is not None:
        return Guess(mapping=named, reason="" if named == given else "by their names")
    if len(names) > 2:
        return None
    record = Record(traces=tuple(traces.with_role(Role.ESTIMATION, Role.SELECTION) or traces.traces), mapping=given)
    other = Mapping(inputs=names[1:], outputs=names[:1])
    if _is_set(record.traces, other):
        return Guess(mapping=other, reason=f"{names[1]} is held and steps from level to level, {names[0]} is not")
    if not isinstance(record.feedback, str) and record.feedback.found and any(exchanged(record)):
        return Guess(mapping=other, reason=f"{names[0]} answers {names[1]}, and not the other way round")
    return Guess(mapping=given)


def _by_names(names: Sequence[str]) -> Mapping | None:
    """Where each name is that of an input or of an output, or one of two is."""
    roles = [_role(name) for name in names]
    if len(names) == 2 and roles.count(None) == 1:
        known = roles[0] if roles[1] is None else roles[1]
        roles = ["output" if role is None and known == "input" else role or "input" for role in roles]
    inputs = tuple(name for name, role in zip(names, roles, strict=True) if role == "input")
    outputs = tuple(name for name, role in zip(names, roles, strict=True) if role == "output")
    return Mapping(inputs=inputs, outputs=outputs) if None not in roles and inputs and outputs else None


def _role(name: str) -> str | None:
    """What a name says of itself: the last part of ``data.u1`` counts, and ``uEst`` has two words."""
    words = {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name.rsplit(".", 1)[-1])}
    found = [role for role, known in (("input", INPUTS), ("output", OUTPUTS)) if words & known]
    return found[0] if len(found) == 1 else None


def _is_set(traces: Sequence[Trace], mapping: Mapping) -> bool:
    """Whether the input of a mapping is held and steps, the output is not, and the output's past foretells no step."""
    trace = max(traces, key=len)[:SEEN]
    driver, driven = (
        np.where(trace.usable_of((name,)), trace[name], np.nan) for name in (mapping.inputs[0], mapping.output)
    )
    return _steps(driver) and not _steps(driven) and not _foretold(driver, driven)


def _steps(values: NDArray[np.float64]) -> bool:
    """Whether a channel stands at levels and goes from one to another, by more than the least that it can."""
    moves = np.diff(values[np.isfinite(values)])
    jumps = np.abs(moves[moves != 0.0])
    if len(jumps) < LEAST or len(jumps) > SELDOM * len(moves):
        return False
    levels = np.unique(values[np.isfinite(values)])
    least = float(np.min(np.diff(levels)))
    typical = float(np.median(jumps))
    return typical >= FAR * float(np.ptp(levels)) and (len(levels) == 2 or typical > 1.5 * least)


def _foretold(driver: NDArray[np.float64], driven: NDArray[np.float64]) -> bool:
    """Whether what came before on the other channel explains the steps of one, beyond what its own level does."""
    at = np.flatnonzero((np.diff(driver) != 0.0) & np.isfinite(np.diff(driver))) + 1
    lags = min(max(2 * len(driver) // max(len(at), 1), 2), max(len(at) // 5, 1))
    at = at[at >= lags]
    own = np.column_stack([np.ones(len(at)), driver[at - 1]])
    other = np.column_stack([driven[at - lag] for lag in range(1, lags + 1)])
    known = np.isfinite(other).all(axis=1)
    if np.count_nonzero(known) < 2 * (lags + 2):
        return False
    own, other, steps = own[known], other[known], driver[at][known]
    alone, both = _left(own, steps), _left(np.hstack([own, other]), steps)
    return bool(both < (1.0 - FORETOLD) * alone and alone > 1e-6 * np.var(steps))


def _left(regressors: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Mean square that a linear regression leaves, for the samples it has free."""
    scaled = regressors / np.maximum(np.linalg.norm(regressors, axis=0), np.finfo(np.float64).tiny)
    left = values - scaled @ np.linalg.lstsq(scaled, values, rcond=None)[0]
    return float(left @ left / max(len(values) - regressors.shape[1], 1))
