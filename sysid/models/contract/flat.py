"""Flat parameters: as many as a model has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened


def as_many(theta: object, n: int) -> NDArray[np.float64]:
    """Flat parameters in place of others.

    Args:
        theta: Numbers.
        n: How many there are.

    Returns:
        The numbers, shape ``(n,)``.

    Raises:
        ConfigError: If they are no numbers, or not as many.
    """
    try:
        found = np.asarray(theta, dtype=np.float64)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape != (n,):
        raise ConfigError(
            "not the parameters of the model",
            where="theta",
            expected=f"{n} numbers, in the order of model.vector",
            got=shortened(theta) if np.ndim(found) == 0 or not len(found) else f"shape {found.shape}",
            remedy="change a copy of model.vector",
        )
    return found
