"""Between at which an output stands: limits of what integrates, found in the records.

A position at its stop, a tank that runs over, a charge at its bound: the output stands at its least or greatest value
while what drives it goes on moving. A plant that merely follows its input stands at its greatest value too, but only
where that input does: an end is told from that by how far the inputs go while the output does not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.records.experiment import Experiment
from sysid.models.orders.output_limits import FOUND, Between, Named
from sysid.units import in_unit

Array = NDArray[np.float64]
Records = Sequence[tuple[Array, Array]]
"""Of each record the inputs, shape ``(n_samples, n_inputs)``, and the output, shape ``(n_samples,)``."""

BAND = 0.005
"""Share of the output's range from its extreme within which it is at its end: a stop gives way a little."""
STILL = 1e-3
"""Share of the range by which it may move in a sample while it stands."""
SHARE = 0.01
"""Of all samples, those at which it stands there at least."""
DRIVEN = 0.2
"""Share of an input's range that it goes over while the output stands at an end."""


def found_ends(records: Records) -> Between:
    """Where an output stands at its least and at its greatest value whatever its inputs do.

    Args:
        records: The records, without samples that do not count.

    Returns:
        Both, in the output's unit; ``None`` for a side without an end.

    Example:
        >>> u = np.random.default_rng(0).uniform(-1.0, 1.0, (2000, 1))
        >>> y, level = [], 0.0
        >>> for one in u[:, 0].repeat(1):
        ...     level = min(max(level + one, 0.0), 3.0)
        ...     y.append(level)
        >>> found_ends([(u, np.array(y))])
        (0.0, 3.0)
        >>> found_ends([(u, u[:, 0])])
        (None, None)
    """
    records = [(u, y) for u, y in records if len(y) > 1]
    if not records:
        return None, None
    inputs, output = (np.concatenate(parts) for parts in zip(*records, strict=True))
    span, driven = float(np.ptp(output)), np.ptp(inputs, axis=0)
    moved = np.concatenate([np.abs(np.diff(y, prepend=y[0] + span)) for _, y in records])
    if not span > 0.0 or not (driven > 0.0).any():
        return None, None
    low, high = (_end(np.abs(output - extreme) / span, moved / span, inputs, output) for extreme in _extremes(output))
    return low, high


def _extremes(output: Array) -> tuple[float, float]:
    return float(output.min()), float(output.max())


def _end(away: Array, moved: Array, inputs: Array, output: Array) -> float | None:
    """The end at an extreme; ``None`` where the output does not stand there, or only where its inputs stand too."""
    stands = (away < BAND) & (moved < STILL)
    if np.count_nonzero(stands) < max(2, SHARE * len(output)):
        return None
    reach = np.ptp(inputs, axis=0)
    moves = np.where(reach > 0.0, np.ptp(inputs[stands], axis=0) / np.where(reach > 0.0, reach, 1.0), 0.0)
    return float(np.median(output[stands])) if moves.max() > DRIVEN else None


def ends_of(limits: str | Between | None, experiments: Sequence[Experiment], output: str) -> Between:
    """The limits of an output: none, given ones, or those that the records show.

    Args:
        limits: As a structure has them.
        experiments: The records.
        output: Its name, for the error's text.

    Returns:
        Both sides, in its unit.

    Raises:
        ConfigError: If they are to be found, and the output stands at no end.
    """
    if limits is None:
        return None, None
    if not isinstance(limits, str):
        return limits
    found = found_ends(_counting(experiments))
    if found == (None, None):
        raise _no_end(output)
    return found


def _counting(experiments: Sequence[Experiment]) -> list[tuple[Array, Array]]:
    """Inputs and outputs where these count."""
    return [(e.inputs, e.output) if e.usable is None else (e.inputs[e.usable], e.output[e.usable]) for e in experiments]


def _no_end(output: str) -> ConfigError:
    return ConfigError(
        f"{output} stands at no end",
        where="limits",
        expected=f"an output that stands at its least or greatest value for {SHARE:.0%} of the samples, while an "
        f"input goes over {DRIVEN:.0%} of its range",
        got=FOUND,
        remedy="write limits: [low, high] where you know them, or leave limits out",
    )


def ends_of_several(
    limits: str | Named | None, experiments: Sequence[Experiment], outputs: Sequence[str]
) -> tuple[Between, ...]:
    """The limits of several outputs: none, given ones, or those that the records show.

    Args:
        limits: As a structure has them.
        experiments: The records.
        outputs: Their names.

    Returns:
        Both sides of each, in its unit; empty where none is asked for.

    Raises:
        ConfigError: If they are to be found, and no output stands at an end; or a name is no output.
    """
    if limits is None:
        return ()
    if not isinstance(limits, str):
        strangers = [name for name, _ in limits if name not in outputs]
        if strangers:
            raise ConfigError(
                f"limits name {', '.join(strangers)}, which is no output", where="limits",
                expected=", ".join(outputs), got=", ".join(strangers), remedy="correct the name",
            )  # fmt: skip
        given = dict(limits)
        return tuple(given.get(name, (None, None)) for name in outputs)
    records = _counting(experiments)
    found = tuple(found_ends([(u, y[:, j]) for u, y in records]) for j in range(len(outputs)))
    if all(one == (None, None) for one in found):
        raise _no_end(" and ".join(outputs))
    return found


def told(ends: Between, output: str, unit: str) -> str:
    """What holds an output, as a sentence.

    Example:
        >>> told((0.0, None), "level", "m")
        'The free run of level is held at 0 m from below.'
    """
    sides = [
        f"at {in_unit(f'{value:.6g}', unit)} from {side}"
        for value, side in zip(ends, ("below", "above"), strict=True)
        if value is not None
    ]
    return f"The free run of {output} is held {' and '.join(sides)}."
