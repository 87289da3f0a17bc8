"""What the fit of a transfer function has to say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.poles import too_fast
from sysid.estimation.linear.transfer_function.level import at_edge
from sysid.estimation.linear.transfer_function.runs import Candidate
from sysid.models import TransferFunctionModel
from sysid.models.converting.orthonormal_basis import Domain
from sysid.units import in_unit


def of_starts(candidates: Sequence[Candidate], best: Candidate, unit: float) -> tuple[str, ...]:
    """How the starts compare.

    Args:
        candidates: After their short runs.
        best: The one that went on.
        unit: From losses to the output's unit squared.

    Returns:
        One note.
    """
    finite = [c for c in candidates if np.isfinite(c.loss)]
    mse = [2.0 * c.loss / c.provider.n_samples * unit for c in finite]
    return (
        f"Best of {len(candidates)} starts: {best.start.name}. After the short runs their mean squared errors lie "
        f"between {min(mse):.4g} and {max(mse):.4g}, median {float(np.median(mse)):.4g}.",
    )


def of_stability(model: TransferFunctionModel) -> str:
    """Whether the model is stable, as a sentence.

    Args:
        model: The model.

    Returns:
        The sentence.
    """
    each = [model.poles(j) for j in range(len(model.sections))]
    poles, discrete = np.concatenate(each), model.orders.domain is Domain.DISCRETE
    edge = slow_poles.INTEGRATES * (1.0 if discrete else 1.0 / model.sample_time)

    def beyond(some: NDArray[np.complex128]) -> NDArray[np.float64]:
        return np.asarray(np.abs(some) - 1.0 if discrete else some.real)

    away, at_edge = beyond(poles), [some[np.abs(beyond(some)) <= edge] for some in each]
    swings = np.concatenate(at_edge)
    swings = swings[np.abs(swings.imag) > edge]
    if len(swings) and float(away.max()) <= edge:
        w = float(np.abs(np.angle(swings[0]) / model.sample_time if discrete else swings[0].imag))
        return (
            f"The transfer function neither settles nor grows: it swings undamped at {w:.4g} rad/s, and an error of "
            "its input stays for ever."
        )
    most = max(map(len, at_edge))
    if most and float(away.max()) <= edge:
        word = {1: "an integrator", 2: "a double integrator"}.get(most, f"{most} poles at the edge")
        return f"The transfer function is not stable: {word}; an error of its input adds up for ever."
    if model.stable:
        return "The transfer function is stable."
    largest = poles[int(np.argmax(away))]
    return (
        f"The transfer function is not stable: the pole {complex(largest):.6g} lies outside; its free run grows "
        "without bound, and it is of use in a loop only."
    )


def of_level(model: TransferFunctionModel) -> tuple[str, ...]:
    """At which input a plant that integrates stands, where that is another than zero.

    Args:
        model: The model.

    Returns:
        One sentence for each such input.
    """
    names = zip(model.mapping.inputs, model.input_units, model.scaling.input_offset, strict=True)
    return tuple(
        f"The output stands at {name} = {in_unit(f'{level:.6g}', unit)}; what is above or below adds up."
        for j, (name, unit, level) in enumerate(names)
        if level and at_edge(model.poles(j), model.orders.domain, model.sample_time).any()
    )


def of_speed(model: TransferFunctionModel) -> tuple[str, ...]:
    """Which poles of a continuous model are so fast that records with these samples cannot hold them.

    Args:
        model: The model.

    Returns:
        One sentence where there are some.
    """
    if model.orders.domain is Domain.DISCRETE:
        return ()
    poles = np.concatenate([model.poles(j) for j in range(len(model.sections))])
    nyquist, fast = np.pi / model.sample_time, too_fast(poles, model.sample_time)
    if not len(fast):
        return ()
    fastest = complex(fast[int(np.argmax(np.abs(fast)))])
    shown = f"{fastest.real:.4g}" if not fastest.imag else f"{fastest:.4g}"
    return (
        f"The pole {shown} rad/s is far faster than these records tell (half of their sampling rate is {nyquist:.4g} "
        "rad/s), and no coefficient is known. Fit a pole less.",
    )
