r"""Where a fit begins a record that is scored from the state which its first samples show.

A free run is scored from the state that the first samples of its record show (:mod:`sysid.models.contract.beginning`).
A fit estimates that state with the parameters, over the whole record. Both come to the same where a state is forgotten,
and where the model is the plant's. What integrates keeps an error of its first state for ever: a model that is nearly
the plant's is then trained to begin where the rest of the record is met best, which the first samples deny, and the run
that is scored is another one. Where that is so, the fit is made as it is scored: the state is the one that the first
samples show, a function :math:`x_0(\theta)` of the parameters, and these samples do not count. With the outputs
:math:`y(\theta, x_0)` over them,

.. math:: \frac{dx_0}{d\theta} = -\Big(\frac{\partial y}{\partial x_0}\Big)^{+} \frac{\partial y}{\partial \theta},

the pseudoinverse of Gauss and Newton (Golub and Pereyra 2003, "Separable nonlinear least squares", without the terms
of second order).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

WORSE = 2.0
"""Times the mean squared error of the trained run from which on the run from the shown state is another one."""

MOST_NAMED = 3
"""Records that are told by name."""

DEPENDENT = 1e-9
"""Singular values below this part of the largest belong to states that the first samples do not show."""


def is_another(shown: NDArray[np.float64], trained: NDArray[np.float64]) -> bool:
    """Whether the run that is scored is another one than the run that was trained.

    Args:
        shown: Errors from the state that the first samples show, at the samples after them.
        trained: The same from the state that was trained.

    Returns:
        Whether its mean square is so much larger.
    """
    scored, own = float(np.vdot(shown, shown)), float(np.vdot(trained, trained))
    return bool(np.isfinite(scored)) and scored > WORSE * own


def moves_of_shown(by_state: NDArray[np.float64], by_parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    """How the state that some samples show moves with the parameters.

    Args:
        by_state: Derivative of these samples by the state, shape ``(n_samples, n_states)``.
        by_parameters: The same by the parameters, shape ``(n_samples, n_parameters)``.

    Returns:
        Shape ``(n_states, n_parameters)``.
    """
    return np.asarray(-np.linalg.lstsq(by_state, by_parameters, rcond=DEPENDENT)[0])


def shown_note(names: Sequence[str]) -> list[str]:
    """What is told of records that were begun as they are scored.

    Args:
        names: The records.

    Returns:
        A sentence; nothing where there are none.
    """
    return [
        f"The fit of {which} begins at the state that its first samples show, as the scored run does: the state that "
        "was trained with the parameters contradicted them, as where a model integrates and is not quite the plant."
        for which in _which(names)
    ]


def other_note(names: Sequence[str]) -> list[str]:
    """What is told of records whose scored run is another one than the trained one, which no training has mended.

    Args:
        names: The records.

    Returns:
        A sentence; nothing where there are none.
    """
    return [
        f"The run over {which} from the state that its first samples show, which is scored, is another one than was "
        "trained, from a state of its own: its error is larger than that of the training."
        for which in _which(names)
    ]


def _which(names: Sequence[str]) -> list[str]:
    more = f" and {len(names) - MOST_NAMED} more" * (len(names) > MOST_NAMED)
    return [", ".join(names[:MOST_NAMED]) + more] if names else []
