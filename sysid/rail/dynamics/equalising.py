"""The equalising reservoir that a driver's handle makes: what the brake pipe then follows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.variant import USUAL
from sysid.units import PSI_IN_PA

EQUALISING_RATE = (USUAL.equalising_rate or np.inf) / PSI_IN_PA
"""Rate in psi/s at which the equalising reservoir follows a reduction: that of the reference physics."""


def equalising_from_handle(
    handle: NDArray[np.float64], sample_time: float, *, rate: float = EQUALISING_RATE
) -> NDArray[np.float64]:
    """The equalising reservoir that a handle makes, for traces that have the handle alone.

    It follows a reduction at a rate, and a release or an emergency at once.

    Args:
        handle: Psi gauge, 0 for the emergency, shape ``(n_samples,)``.
        sample_time: In s.
        rate: In psi/s.

    Returns:
        Psi gauge, same shape.

    Example:
        >>> equalising_from_handle(np.array([90.0, 84.0, 84.0, 84.0, 90.0]), 1.0, rate=4.0).tolist()
        [90.0, 86.0, 84.0, 84.0, 90.0]
    """
    out = np.array(handle, dtype=np.float64)
    for k in range(1, len(out)):
        if 0.0 < out[k] < out[k - 1]:
            out[k] = max(out[k], out[k - 1] - rate * sample_time)
    return out
