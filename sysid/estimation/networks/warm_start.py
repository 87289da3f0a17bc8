r"""A network begun from a smaller one, or from a linear model: what those know is kept, the rest begins at random.

A network contains every network with fewer neurons and with some of its lags, and every linear model over its lags:
the weights of what the smaller one lacks are zero. Begun there, it can only get better on the records that it is
fitted to, and a short fit is enough where a random start would need a long one.

Scaled numbers differ between records. With :math:`x = A x' + c` between the scaled regressors of the two models, and
:math:`y' = r y + d` between their scaled outputs,

.. math:: W' = W A,\quad b' = b + W c,\quad v' = r (v + V c),\quad V' = r\,V A,\quad w' = r\,w A,
    \quad c_0' = r (c_0 + w c) + d.
"""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.networks.initialise import Layout
from sysid.models import AbstractStructure, Lags, NARXModel, Scaling, VectorScaling
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.models.lagged.lagged_form import AbstractLaggedForm
from sysid.models.orders.lags import Lagged


def check_initial(network: AbstractStructure, initial: AbstractStructure, n_inputs: int) -> None:
    """Refuse an initial fit that a network does not contain, before any data are read.

    Args:
        network: The structure that is to start from it.
        initial: The structure of the initial fit.
        n_inputs: Inputs of the mapping.

    Raises:
        ConfigError: If it has hidden states, other lags, or more neurons.
    """
    ours, theirs = network.lagged(n_inputs), initial.lagged(n_inputs)
    if network == initial or (ours is not None and theirs is not None and ours.contains(theirs)):
        return
    raise ConfigError(
        "the initial fit is not contained in the network that is to start from it",
        where="initial",
        expected=f"{network.label}, a smaller network over some of its lags, or an ARX model over them",
        got=initial.label if theirs is None else f"{initial.label}: {theirs}",
        remedy="start from such a fit, or leave initial out",
    )


def grown(source: AbstractLaggedForm, template: AbstractLaggedForm, fresh: NDArray[np.float64]) -> NDArray[np.float64]:
    """The parameters of a smaller network inside a larger one.

    Args:
        source: The smaller network, or a linear model.
        template: Lags, neurons and scaling of the larger one; its parameters are not read.
        fresh: A random start of the larger one, from which it takes the neurons that the smaller one lacks; shape
            ``(n_parameters,)``, over plain regressors.

    Returns:
        Flat parameters, shape ``(n_parameters,)``. Where no neuron is added the function is the smaller one's.

    Raises:
        ConfigError: If the larger one does not contain the smaller.
    """
    ours, theirs = _lagged(template.columns), _lagged(source.columns)
    few, many = (Layout.of_columns(one.columns, one.n_inputs) for one in (source, template))
    parts = _parts(few, source.numbers)
    # A linear part of zeros is none: an ARX model of a network without one may have it.
    if not ours.contains(replace(theirs, linear=theirs.linear and bool(np.any(parts.w)))):
        raise ConfigError(
            "the initial fit is not contained in the network that is to start from it",
            where="initial",
            expected=str(ours),
            got=str(theirs),
            remedy="start from a smaller network over the same lags or some of them, or leave initial out",
        )
    small = _in_scaling(parts, few, source, template.scaling)
    kept, n = places(many.columns, few.columns), few.neurons
    theta = np.array(fresh, dtype=np.float64)
    large = _parts(many, theta)  # views: what is put into them is in the parameters
    large.W[:n] = 0.0
    large.W[:n, kept] = small.W
    large.b[:n] = small.b
    large.v[:, :n] = small.v
    large.constant[:] = small.constant
    if many.linear:
        large.w[:] = 0.0
        large.w[:, kept] = small.w
    if many.gated:
        large.V[:n] = 0.0
        if few.gated:
            large.V[:n, kept] = small.V
    return theta


def _lagged(columns: ColumnRecursion) -> Lagged:
    """What a map is made of, each output a channel like the others."""
    return Lagged(
        lags=columns.lags, neurons=columns.neurons, linear=columns.linear, gated=columns.gated,
        activation=columns.activation,
    )  # fmt: skip


def widened(model: NARXModel, reads: Dict[str, tuple[int, ...]], sources: Dict[str, NARXModel]) -> NARXModel:
    """A network that reads more channels than it did, with weights of zero for them: the same function.

    Members of an assembly that read each other may run away when they are wired as each was fitted alone. Begun as a
    chain and widened, they close their circle from zero, as far as it helps.

    Args:
        model: The network.
        reads: Lags of each channel that it is to read.
        sources: For each of them the network that writes it, whose scaling and unit are taken.

    Returns:
        The wider network.

    Raises:
        ConfigError: If it reads one of them already.
    """
    known = [name for name in reads if name in model.mapping.inputs]
    if known:
        raise ConfigError(
            f"{model.mapping} reads {', '.join(known)} already",
            where="reads",
            expected="channels that it does not read",
            got=", ".join(reads),
            remedy="leave them out, or give the member these lags from the beginning",
        )
    new, lags = tuple(sources[name] for name in reads), model.recursion.lags
    scaling = replace(
        model.scaling,
        input_offset=(*model.scaling.input_offset, *(source.scaling.output_offset for source in new)),
        input_scale=(*model.scaling.input_scale, *(source.scaling.output_scale for source in new)),
    )
    before = replace(model.recursion, lags=replace(lags, inputs=(*lags.inputs, *(() for _ in new))), scaling=scaling)
    network = replace(model.network, input_delays=(*lags.inputs, *reads.values()))
    wider = replace(
        model,
        network=network,
        mapping=replace(model.mapping, inputs=(*model.mapping.inputs, *reads)),
        scaling=scaling,
        input_units=(*model.input_units, *(source.output_unit for source in new)),
        theta=np.zeros(Layout.of(network, len(scaling.input_scale)).n_parameters),
    )
    return replace(wider, theta=grown(before, wider.recursion, wider.theta))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Parts:
    """A network's parameters by what they do; the letters are those of the module's docstring.

    Shapes: ``W`` and ``V`` ``(neurons, regressors)``, ``v`` ``(outputs, neurons)``, ``w`` ``(outputs, regressors)``;
    ``V`` is empty without gates, ``w`` zero without a linear part.
    """

    W: NDArray[np.float64]
    b: NDArray[np.float64]
    v: NDArray[np.float64]
    V: NDArray[np.float64]
    w: NDArray[np.float64]
    constant: NDArray[np.float64]


def _parts(layout: Layout, theta: NDArray[np.float64]) -> _Parts:
    """Views of flat parameters."""
    r, k, m = layout.lags.n_regressors, layout.neurons, len(layout.outputs)
    affine = theta[layout.affine]
    return _Parts(
        W=theta[: k * r].reshape(k, r),
        b=theta[k * r : k * (r + 1)],
        v=theta[layout.readout].reshape(m, k),
        V=theta[layout.gates].reshape(-1, r),
        w=affine[m:].reshape(m, r) if layout.linear else np.zeros((m, r)),
        constant=affine[:m],
    )


def _in_scaling(parts: _Parts, layout: Layout, source: AbstractLaggedForm, to: Scaling | VectorScaling) -> _Parts:
    """The same function in other scaled numbers."""
    theirs, channel = source.columns, layout.columns.input_channel
    offset, scale = (np.concatenate([np.atleast_1d(one) for one in both]) for both in _numbers(to))
    slopes, shifts = scale / np.array(theirs.scale), (offset - np.array(theirs.offset)) / np.array(theirs.scale)
    A, c = slopes[channel], shifts[channel]
    out = slice(len(slopes) - len(layout.outputs), None)
    r, d = 1.0 / slopes[out], -shifts[out] / slopes[out]
    gated = len(parts.V) > 0
    return _Parts(
        W=parts.W * A,
        b=parts.b + parts.W @ c,
        v=r[:, np.newaxis] * (parts.v + parts.V @ c if gated else parts.v),
        V=r[0] * parts.V * A,
        w=r[:, np.newaxis] * parts.w * A,
        constant=r * (parts.constant + parts.w @ c) + d,
    )


def _numbers(scaling: Scaling | VectorScaling) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """Offsets and scales of inputs and outputs."""
    return (scaling.input_offset, scaling.output_offset), (scaling.input_scale, scaling.output_scale)


def places(larger: Lags, smaller: Lags) -> list[int]:
    """Where each regressor of the smaller set stands in the larger.

    Args:
        larger: The larger set.
        smaller: The smaller one.

    Returns:
        Positions, in the order of the smaller set.

    Example:
        >>> places(Lags(inputs=((0, 1), (0,)), output=(1,)), Lags(inputs=((), (0,)), output=(1,)))
        [2, 3]
    """

    def named(lags: Lags) -> list[tuple[int, int]]:
        inputs = [(channel, lag) for channel, some in enumerate(lags.inputs) for lag in some]
        return inputs + [(-1, lag) for lag in lags.output]

    position = {name: index for index, name in enumerate(named(larger))}
    return [position[name] for name in named(smaller)]
