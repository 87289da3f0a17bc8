"""A long ARX model: what inputs do and what the innovations were, of any linear system with noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.linear.poles import stabilised
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.subspace.yardstick import Yardstick
from sysid.models.converting.orthonormal_basis import Domain

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class LongARX:
    """``A y = B u + constant + e`` with many lags, polynomials in ``1/z``.

    Args:
        A: Of the output, from 1 on, shape ``(order + 1,)``.
        B: Of each input, from lag 0 on.
        constant: On the right side.
        yardstick: What it leaves unexplained; ``None`` where it was not fitted to that.
    """

    A: Array
    B: tuple[Array, ...]
    constant: float = 0.0
    yardstick: Yardstick | None = None

    @property
    def poles(self) -> NDArray[np.complex128]:
        """In the z plane, mirrored into the unit circle."""
        return stabilised(self.raw_poles, Domain.DISCRETE)

    @property
    def raw_poles(self) -> NDArray[np.complex128]:
        """In the z plane, wherever they are."""
        return np.asarray(np.roots(self.A), dtype=np.complex128)

    def innovations(self, piece: Segment) -> Array:
        """What the model does not explain.

        Args:
            piece: An unbroken record of one output.

        Returns:
            Shape ``(n_samples,)``; its first samples, which it cannot tell, are zero.
        """
        e = scipy.signal.lfilter(self.A, [1.0], piece.outputs[:, 0]) - self.constant
        for j, b in enumerate(self.B):
            e = e - scipy.signal.lfilter(b, [1.0], piece.inputs[:, j])
        e[: len(self.A) - 1] = 0.0
        return np.asarray(e)
