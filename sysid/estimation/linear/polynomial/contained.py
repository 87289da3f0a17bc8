"""Which polynomial models one contains: structures with a root less, and their coefficients with another root."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from sysid.models.linear.polynomial_orders import AbstractPolynomial

Array = NDArray[np.float64]


def has_common(orders: AbstractPolynomial) -> bool:
    """Whether inputs and noise, or noise alone, have one denominator.

    Args:
        orders: The structure.

    Returns:
        Whether they have.
    """
    return bool(orders.order("na")) or not orders.nb


def next_smaller(orders: AbstractPolynomial) -> list[tuple[AbstractPolynomial, str]]:
    """Structures that one contains.

    Args:
        orders: The structure.

    Returns:
        Each with the polynomials that it lacks a root of.
    """
    na, nc, nd, nb, nf = orders.order("na"), orders.order("nc"), orders.order("nd"), orders.nb, orders.denominators
    change: Any = partial(replace, cast("Any", orders))
    found = []
    if na:
        if na > 1 and nc > 1 and all(n > 1 for n in nb):
            found.append((change(na=na - 1, nc=nc - 1, nb=tuple(n - 1 for n in nb)), "BAC"))
    elif nb:
        if min(nf) > 1 and min(nb) > 1:
            found.append((change(nb=tuple(n - 1 for n in nb), nf=tuple(n - 1 for n in nf)), "BF"))
        if nc > 1 and nd > 1:
            found.append((change(nc=nc - 1, nd=nd - 1), "CD"))
    return found


def parts_of(orders: AbstractPolynomial) -> list[tuple[str, int]]:
    """The polynomials of the flat vector.

    Args:
        orders: The structure.

    Returns:
        In its order, each with its number of coefficients.
    """
    common = [("A", orders.order("na"))] if has_common(orders) else [("F", n) for n in orders.denominators]
    noise = [(letter, orders.order(f"n{letter.lower()}")) for letter in ("C" if has_common(orders) else "CD")]
    return [*(("B", n) for n in orders.nb), *common, *noise]


def with_root(part: Array, root: float, *, monic: bool) -> Array:
    """The coefficients of a polynomial times another root.

    Args:
        part: Its coefficients.
        root: The root.
        monic: Whether a leading 1 is not among them.

    Returns:
        One coefficient more.
    """
    whole = np.concatenate([[1.0], part]) if monic else part
    return np.asarray(np.convolve(whole, [1.0, -root])[int(monic) :])
