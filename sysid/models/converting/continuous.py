r"""The continuous form of a discrete state space: the system that gives it when inputs are held between samples.

The logarithm of :math:`\Phi = [A, B; 0, I]` over the sample time holds the continuous matrices (Åström and Wittenmark
1997, "Computer-Controlled Systems", section 2.3). A pole at zero or on the negative real axis has no real logarithm of
this order: no continuous system of so many states has such samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.extras import need
from sysid.models.channels.mapping import Mapping
from sysid.models.converting.to_control import signals

Array = NDArray[np.float64]

NEGATIVE = 1e-12
"""Distance from the negative real axis, zero included, within which a pole lies on it."""


def rates(A: Array, B: Array, sample_time: float, *, remedy: str) -> tuple[Array, Array]:
    """The continuous matrices whose samples are given ones, inputs held.

    Args:
        A: Shape ``(n, n)``, from sample to sample.
        B: Shape ``(n, n_inputs)``.
        sample_time: Seconds.
        remedy: What to do where there are none.

    Returns:
        ``A`` and ``B`` of the rates, per second.

    Raises:
        ConfigError: If a pole is zero or negative.
    """
    poles = scipy.linalg.eigvals(A) if len(A) else np.zeros(0)
    bad = poles[(np.abs(poles.imag) < NEGATIVE) & (poles.real <= NEGATIVE)]
    if len(bad):
        raise ConfigError(
            "no continuous system of this order gives the discrete one",
            where="a pole",
            expected="no pole on the negative real axis, nor at zero, which is a dead time",
            got=", ".join(f"{pole.real:.4g}" for pole in bad),
            remedy=remedy,
        )
    n, m = B.shape
    block = np.eye(n + m)
    block[:n, :n], block[:n, n:] = A, B
    found = np.real(scipy.linalg.logm(block)) / sample_time
    return found[:n, :n], found[:n, n:]


@dataclass(frozen=True, kw_only=True, eq=False)
class ContinuousStateSpace:
    """``dx/dt = A x + B u(t - delay)``, ``y = C x + D u(t - delay)``, from deviations to deviations.

    Args:
        A: Per second, shape ``(n, n)``.
        B: In the inputs' units, shape ``(n, n_inputs)``.
        C: In the outputs' units, shape ``(n_outputs, n)``.
        D: Shape ``(n_outputs, n_inputs)``.
        delays: Dead time of each input in seconds.
        mapping: Its channels.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    delays: tuple[float, ...]
    mapping: Mapping

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Poles in the s plane, in rad/s, shape ``(n,)``."""
        return np.asarray(scipy.linalg.eigvals(self.A), dtype=np.complex128)

    def to_control(self, *, pade_order: int = 3) -> Any:
        """The same as a ``control.StateSpace`` in continuous time.

        Args:
            pade_order: Order of the Padé approximation that stands for each dead time; python-control has none.

        Returns:
            The state space; without dead times exactly this one.
        """
        need("control", "an object of python-control")
        import control

        plant = control.StateSpace(self.A, self.B, self.C, self.D, 0)
        if any(self.delays):
            late = [control.ss(control.tf(*control.pade(delay, pade_order))) for delay in self.delays]
            plant = plant * control.append(*late)
        return control.StateSpace(plant.A, plant.B, plant.C, plant.D, 0, **signals(self.mapping))
