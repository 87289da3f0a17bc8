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

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.networks.initialise import Layout
from sysid.models import AbstractStructure, Lags, NARXModel, Recursion, Scaling


def contains(larger: Lags, smaller: Lags) -> bool:
    """Whether every regressor of one set is in the other.

    Args:
        larger: The set that is to contain.
        smaller: The set that is to be contained.

    Returns:
        Whether it does.

    Example:
        >>> contains(Lags(inputs=((1, 2),), output=(1,)), Lags(inputs=((1,),), output=(1,)))
        True
    """
    return (
        larger.n_inputs == smaller.n_inputs
        and all(set(few) <= set(many) for many, few in zip(larger.inputs, smaller.inputs, strict=True))
        and set(smaller.output) <= set(larger.output)
    )


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
    if ours is not None and theirs is not None and ours.contains(theirs):
        return
    raise ConfigError(
        "the initial fit is not contained in the network that is to start from it",
        where="initial",
        expected=f"{network.label}, a smaller network over some of its lags, or an ARX model over them",
        got=initial.label if theirs is None else f"{initial.label}: {theirs}",
        remedy="start from such a fit, or leave initial out",
    )


def grown(source: Recursion, template: Recursion, fresh: NDArray[np.float64]) -> NDArray[np.float64]:
    """The parameters of a smaller network inside a larger one.

    Args:
        source: The smaller network, or a linear model.
        template: Lags, neurons and scaling of the larger one; its parameters say only whether it has a linear part
            and gates.
        fresh: A random start of the larger one, from which it takes the neurons that the smaller one lacks; shape
            ``(n_parameters,)``, over plain regressors.

    Returns:
        Flat parameters, shape ``(n_parameters,)``. Where no neuron is added the function is the smaller one's.

    Raises:
        ConfigError: If the larger one does not contain the smaller.
    """
    linear = len(template.theta) > template.neurons * (template.lags.n_regressors + 2) + 1
    if (
        not contains(template.lags, source.lags)
        or source.neurons > template.neurons
        or (not linear and bool(np.any(source.linear)))
        or (template.gates is None and source.gates is not None)
        or (source.neurons > 0 and source.activation != template.activation)
    ):
        raise ConfigError(
            "the initial fit is not contained in the network that is to start from it",
            where="initial",
            expected=f"lags among {template.lags.inputs} and {template.lags.output}, up to {template.neurons} neurons "
            f"({template.activation})",
            got=f"lags {source.lags.inputs} and {source.lags.output}, {source.neurons} neurons ({source.activation})",
            remedy="start from a smaller network over the same lags or some of them, or leave initial out",
        )
    small = _in_scaling(source, template.scaling)
    kept = places(template.lags, source.lags)
    r, k = template.lags.n_regressors, template.neurons
    theta = np.array(fresh, dtype=np.float64)
    W, b, v = theta[: k * r].reshape(k, r), theta[k * r : k * (r + 1)], theta[k * (r + 1) : k * (r + 2)]
    W[: source.neurons] = 0.0
    W[: source.neurons, kept] = small.W
    b[: source.neurons] = small.b
    v[: source.neurons] = small.v
    theta[k * (r + 2)] = small.constant
    if linear:
        w = theta[k * (r + 2) + 1 : k * (r + 2) + 1 + r]
        w[:] = 0.0
        w[kept] = small.w
    if template.gates is not None:
        V = theta[k * (r + 2) + 1 + r :].reshape(k, r)
        V[: source.neurons] = 0.0
        if small.V is not None:
            V[: source.neurons, kept] = small.V
    return theta


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
    """A network's parameters by what they do; the letters are those of the module's docstring."""

    W: NDArray[np.float64]
    b: NDArray[np.float64]
    v: NDArray[np.float64]
    V: NDArray[np.float64] | None
    w: NDArray[np.float64]
    constant: float


def _in_scaling(source: Recursion, to: Scaling) -> _Parts:
    """The same function in other scaled numbers."""
    ours = source.scaling
    channel = source.lags.input_channel
    n_outputs = len(source.lags.output)
    slope_u = np.array(to.input_scale) / np.array(ours.input_scale)
    shift_u = (np.array(to.input_offset) - np.array(ours.input_offset)) / np.array(ours.input_scale)
    slope_y = to.output_scale / ours.output_scale
    shift_y = (to.output_offset - ours.output_offset) / ours.output_scale
    A = np.concatenate([slope_u[channel], np.full(n_outputs, slope_y)])
    c = np.concatenate([shift_u[channel], np.full(n_outputs, shift_y)])
    r, d = 1.0 / slope_y, -shift_y / slope_y
    return _Parts(
        W=source.hidden_weights * A,
        b=source.hidden_bias + source.hidden_weights @ c,
        v=r * (source.readout if source.gates is None else source.readout + source.gates @ c),
        V=None if source.gates is None else r * source.gates * A,
        w=r * source.linear * A,
        constant=r * (source.constant + float(source.linear @ c)) + d,
    )


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
