"""Whether a fit stands at a minimum, where one more step would bring nothing but rounding."""

from __future__ import annotations

import numpy as np

from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.state import State

FLAT = 1e-8
"""Share of the loss that one more Newton step would take away, below which a fit stands at a minimum."""

SHOWN = 1e-12
"""Part of the strongest direction's curvature from which on a direction is more than rounding."""

NOTHING_LEFT = 1e-24
"""Mean squared error over the output's scale that is rounding."""

STANDS = 1e-6
"""Over the loss of one sample: what a Newton step would take away where it would move no parameter by more than a
thousandth of its standard deviation."""


def stands(state: State, provider: AbstractProvider) -> bool:
    """Whether a fit that goes on changes nothing but rounding: neither did its last step, nor would the next.

    A decrease over many iterations says that some time after it is so. Where precisions of the prior are found on the
    way, they may still move what a step would bring: such a fit does not stand.

    Args:
        state: Where it stands.
        provider: Residuals and Jacobians.

    Returns:
        Whether it does.
    """
    if len(state.losses) < 2 or not all(group.known for group in state.prior.groups):
        return False
    share = STANDS / provider.n_samples
    before, loss = state.losses[-2:]
    return abs(before - loss) <= share * loss and at_minimum(state, provider, share)


def at_minimum(state: State, provider: AbstractProvider, share: float = FLAT, *, shown: float = SHOWN) -> bool:
    """Whether a fit that finds no better step stands where there is none: its gradient is zero to rounding.

    Args:
        state: Where it stands.
        provider: Residuals and Jacobians.
        share: Of the loss, that one more Newton step may take away.
        shown: Part of the strongest direction's curvature that one must have to be stepped along.

    Returns:
        Whether it does.
    """
    at, prior = state.at, state.prior
    if 2.0 * at.loss <= NOTHING_LEFT * provider.n_samples:
        return True
    if not at.finite:
        return False
    ridge = prior.precision / prior.beta
    g = at.gradient + ridge * (state.theta - prior.centre)
    free = np.ones(len(g), dtype=np.bool_)
    if provider.bounds is not None:
        low, high = provider.bounds
        free = ~(((state.theta <= low) & (g > 0.0)) | ((state.theta >= high) & (g < 0.0)))
    H = at.gauss_newton + np.diag(ridge)
    root = np.sqrt(np.maximum(np.diag(H)[free], 1e-300))
    scaled = g[free] / root
    step = np.linalg.lstsq(H[np.ix_(free, free)] / np.outer(root, root), scaled, rcond=shown)[0]
    return bool(scaled @ step <= share * at.loss)
