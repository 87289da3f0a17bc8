"""Quotients of what acts by what stands still over a record: a flow into a tank of some area, an inertia."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid.estimation.resets.reset_map import Array, Ratio

MOST = 3
"""Inputs that others are divided by, at most."""


def ratios_of(inputs: Sequence[Array]) -> tuple[Ratio, ...]:
    """Quotients that a map may be linear in.

    Args:
        inputs: Of each record, shape ``(n_samples, n_inputs)``.

    Returns:
        The inverse of each input that stands still over every record, differs between them and never is nought, and
        every other input over it.

    Example:
        >>> ratios_of([np.column_stack([[0.0, 1.0], [a, a]]) for a in (1.0, 2.0)])
        ((None, 1), (0, 1))
    """
    if not inputs or min(map(len, inputs)) == 0:
        return ()
    n, firsts = inputs[0].shape[1], np.array([u[0] for u in inputs])
    held = [
        k
        for k in range(n)
        if np.ptp(firsts[:, k]) > 0.0
        and (np.all(firsts[:, k] > 0.0) or np.all(firsts[:, k] < 0.0))
        and all((u[:, k] == u[:1, k]).all() for u in inputs)
    ][:MOST]
    return tuple((above, below) for below in held for above in (None, *range(n)) if above != below)
