"""A lag of first order without noise, and the structure that it has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import sysid

U = np.repeat([0.0, 1.0, -1.0, 0.5, 0.0], 20)
ORDERS = sysid.ARX(na=1, nb=1, nk=1)


def lag(u: NDArray[np.float64], first: float = 0.0) -> NDArray[np.float64]:
    y = np.full(len(u), first)
    for k in range(len(u) - 1):
        y[k + 1] = 0.8 * y[k] + 0.2 * u[k]
    return y


Y = lag(U)
