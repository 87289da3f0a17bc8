"""Where a reference begins: at a state of its own whatever its inputs are first, or at rest at these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sysid.references.config import ReferenceConfig
from sysid.references.runs import Case, ReferenceRuns
from sysid.workbench.auto.look import MOVED

HELD: Final = (("beginning-high", 0.9, 0.7), ("beginning-low", 0.1, 0.3))
"""Inputs that stay, as shares of their ranges from the first to the last input: at 0 many a reference stands still, and
where all are alike what moves by a difference."""


def stood_at(config: ReferenceConfig, like: Case, spans: Sequence[float]) -> dict[str, float]:
    """What the inputs of a surrogate stand at before its first sample, so that it begins where its reference does.

    Experiments all begin at the same inputs, and do not tell a reference that begins at rest at any from one that
    begins at one state. It is run twice more, at other inputs that stay: it stands still at both, or it does not.

    Args:
        config: The reference, with whole paths.
        like: An experiment, whose length and parameters are taken.
        spans: Range of each output over the experiments.

    Returns:
        By name the inputs that experiments begin at; none of a reference that begins at rest at whatever its inputs
        are first, that has none, or that settles first.
    """
    if not config.inputs or config.settling:
        return {}
    ports, n = config.inputs.values(), len(like.inputs)
    cases = []
    for name, low, high in HELD:
        shares = np.linspace(low, high, len(ports))
        levels = [p.at_levels(np.array([p.range[0] + x * np.ptp(p.range)])) for x, p in zip(shares, ports, strict=True)]
        cases.append(replace(like, name=name, inputs=np.tile(np.hstack(levels), (n, 1)), told="inputs that stay"))
    with ReferenceRuns(config=config, workers=1) as runs:
        found = runs.run(cases)
    moved = [np.ptp(one.trace.columns(tuple(config.outputs)), axis=0) for one in found if one.trace is not None]
    still = all((by <= MOVED * np.asarray(spans)).all() for by in moved)
    return {} if moved and still else {name: port.begin for name, port in config.inputs.items()}


def begun_elsewhere(config: ReferenceConfig, cases: Sequence[Case]) -> list[Case]:
    """Experiments that begin at other inputs than all others do: from where theirs are farthest from there.

    Args:
        config: The reference.
        cases: Experiments.

    Returns:
        The second part of each, half of it at least; none where no input moves.
    """
    ranges = np.array([port.range for port in config.inputs.values()]).reshape(-1, 2)
    found = []
    for case in cases:
        away = np.abs(case.inputs - config.begin) / np.ptp(ranges, axis=1) if len(ranges) else np.zeros((1, 0))
        at = int(np.argmax(away[: len(away) // 2].sum(axis=1))) if len(away) > 1 else 0
        if at:
            found.append(replace(case, name=f"{case.name}-elsewhere", inputs=case.inputs[at:]))
    return found
