"""Small cascades that tests share: random weights, three reservoirs and their command."""

from __future__ import annotations

import numpy as np

from sysid.kernels.neurons import NEURONS
from sysid.models import (
    ARX,
    NARX,
    ARXModel,
    Cascade,
    Domain,
    GreyBox,
    GreyBoxModel,
    Limit,
    Mapping,
    NARXModel,
    Scaling,
    TransferFunction,
    TransferFunctionModel,
    VectorNARX,
    VectorNARXModel,
    VectorScaling,
    parameter_count,
)
from sysid.models.converting.orthonormal_basis import basis_of, numerators

RESTS = {"BP": 90.0, "AR": 90.0, "ER": 90.0, "BC": 0.0, "x": 0.0, "y": 0.0}


def network(
    text: str,
    *,
    seed: int = 0,
    neurons: int = 3,
    inputs=(0, 1, 3),
    outputs=(1, 2),
    spread: float = 0.3,
    gated=False,
    activation="tanh",
) -> NARXModel:
    """One network of a cascade."""
    mapping, structure = (
        Mapping.parse(text),
        NARX(
            input_delays=list(inputs), output_delays=list(outputs), neurons=neurons, gated=gated, activation=activation
        ),
    )
    n = len(mapping.inputs)
    count = parameter_count(structure.lags(n), neurons, linear=True, gated=gated)
    return NARXModel(
        network=structure,
        theta=spread * np.random.default_rng(seed).standard_normal(count),
        scaling=Scaling(
            input_offset=tuple(80.0 + i for i in range(n)),
            input_scale=tuple(12.0 + i for i in range(n)),
            output_offset=RESTS[mapping.output] * 0.8 + 5.0,
            output_scale=21.0,
        ),
        mapping=mapping,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_unit="psi",
        rest_output=RESTS[mapping.output],
    )


def linear(text: str) -> ARXModel:
    """One linear member, in units."""
    mapping = Mapping.parse(text)
    n = len(mapping.inputs)
    return ARXModel(
        orders=ARX(na=2, nb=(2,) * n, nk=(0,) * n),
        coefficients=np.array([*(0.1 / n, 0.05 / n) * n, 0.6, 0.25]),
        intercept=0.0,
        mapping=mapping,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_unit="psi",
        rest_output=RESTS[mapping.output],
    )


def at_most(text: str, *, above: float) -> ARXModel:
    """What a channel was a sample ago, and so much more: how fast it may rise."""
    return ARXModel(
        orders=ARX(na=0, nb=(1,), nk=(1,)),
        coefficients=np.array([1.0]),
        intercept=above,
        mapping=Mapping.parse(text),
        sample_time=0.1,
        input_units=("psi",),
        output_unit="psi",
        rest_output=90.0,
    )


def equation(text: str, *inputs: str, free: dict[str, float] | None = None, **tables) -> GreyBoxModel:
    """A member that is an equation; its parameters stand where they start."""
    free = free or {}
    output = text.split(" = ", maxsplit=1)[0]
    return GreyBoxModel(
        grey=GreyBox(equations=text, tables=tables, parameters=free),
        theta=np.array(list(free.values())),
        norms=(),
        levels=(),
        spans=(),
        substeps=1,
        scaling=Scaling.identity(len(inputs)),
        mapping=Mapping(inputs=inputs, output=output),
        sample_time=0.1,
        input_units=("psi",) * len(inputs),
        output_unit="psi",
        rest_output=RESTS.get(output, 0.0),
    )


def block(
    text: str,
    *,
    seed: int = 0,
    neurons: int = 4,
    output_delays=(1, 2),
    feedthrough: bool = True,
    activation="tanh",
) -> VectorNARXModel:
    """One network for several reservoirs."""
    mapping = Mapping.parse(text)
    structure = VectorNARX(
        input_delays=[0, 2],
        output_delays=output_delays,
        neurons=neurons,
        feedthrough=feedthrough,
        activation=activation,
    )
    n, m = len(mapping.inputs), len(mapping.outputs)
    return VectorNARXModel(
        network=structure,
        theta=0.3 * np.random.default_rng(seed).standard_normal(structure.parameter_count(n, m)),
        scaling=VectorScaling(
            input_offset=(80.0,) * n, input_scale=(12.0,) * n,
            output_offset=tuple(RESTS[name] * 0.8 + 5.0 for name in mapping.outputs),
            output_scale=tuple(21.0 + i for i in range(m)),
        ),
        mapping=mapping,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_units=("psi",) * m,
        rest_outputs=tuple(RESTS[name] for name in mapping.outputs),
    )  # fmt: skip


def service() -> Cascade:
    """Three networks, given in another order than that in which they run."""
    return Cascade(
        models=(network("BP+AR -> BC", seed=3), network("STP -> BP", seed=1), network("BP -> AR", seed=2)),
        rest={"BP": "STP", "AR": "STP"},
    )


CASCADES = {
    "three networks": service(),
    "the emergency reservoir too": Cascade(
        models=(
            network("STP -> BP", seed=1), network("BP -> ER", seed=2, neurons=9, inputs=(2, 5)),
            network("BP+ER -> AR", seed=3), network("BP+AR+ER -> BC", seed=4, outputs=(1, 4)),
        )
    ),
    "limits": Cascade(
        models=service().models,
        limits={"BC": Limit(low=0.0, high="BP"), "AR": Limit(high="BP"), "BP": Limit(low=70.0, high=82.0)},
    ),
    "a limit made of what it limits, a sample ago": Cascade(
        models=(*service().models, at_most("AR -> x", above=0.4)), limits={"AR": Limit(low=40.0, high="x")}
    ),
    "a linear member": Cascade(
        models=(network("STP -> BP", seed=1), linear("BP -> AR"), network("BP+AR -> BC", seed=5))
    ),
    "a network of several outputs": Cascade(models=(network("STP -> BP", seed=1), block("BP -> AR+ER+BC", seed=2))),
    "several outputs, a set of lags each": Cascade(
        models=(block("STP+F -> BP+AR", seed=3, output_delays=[[1, 2], [1, 3, 4]]), network("BP+AR -> BC", seed=4))
    ),
    "several outputs without a linear part": Cascade(models=(block("STP -> BP+BC", seed=3, feedthrough=False),)),
    "a circle through the past": Cascade(
        models=(
            network("STP+AR+BC -> BP", seed=1, inputs=(1, 3)), network("BP -> AR", seed=2),
            network("BP+AR -> BC", seed=3, spread=0.2),
        ),
        limits={"AR": Limit(high="BP"), "BC": Limit(low=0.0)},
    ),
    "gates": Cascade(
        models=(
            network("STP -> BP", seed=1), network("BP -> AR", seed=2, neurons=9, gated=True),
            network("BP+AR -> BC", seed=3, gated=True, spread=0.2),
        )
    ),
    **{
        f"{kind} beside tanh": Cascade(
            models=(
                network("STP -> BP", seed=1, activation=kind), network("STP -> x", seed=6, neurons=9),
                block("BP+x -> AR+ER", seed=2, activation=kind),
                network("BP+AR -> BC", seed=3, gated=True, spread=0.2, activation=kind),
            )
        )
        for kind in NEURONS
    },
    "equations in a circle": Cascade(
        models=(
            network("STP+x+BC -> BP", seed=1, inputs=(1, 3)), network("BP -> AR", seed=2),
            equation("x = root*sqrt(abs(BP[k-1] - share*AR[k-1]) + 0.1) * max(AR[k-2], ER[k-1])", "AR", "ER", "BP",
                     free={"share": 0.9, "root": 1.0}),
            equation("ER = where(STP > 75, BP, 0.5*y[k-1]) - filled(x)/30", "STP", "y", "BP", "x",
                     filled=[[0, 1], [80, 3], [400, -2]]),
            linear("ER -> y"), network("y+x -> BC", seed=3, spread=0.1),
        ),
        limits={"AR": Limit(high="BP", low="y"), "ER": Limit(low=-40.0), "x": Limit(high=500.0)},
    ),
    "no neurons": Cascade(models=(network("STP -> BP", neurons=0, spread=0.15), linear("STP+BP -> BC"))),
}  # fmt: skip


def command(n: int = 120, inputs: int = 1, seed: int = 0) -> np.ndarray:
    """Steps of the command, and whatever else goes in."""
    rng = np.random.default_rng(seed)
    steps = np.repeat(rng.uniform(64.0, 90.0, (n // 20 + 1, inputs)), 20, axis=0)[:n]
    return np.ascontiguousarray(steps)


def lag(text: str) -> TransferFunctionModel:
    """A first-order lag of gain 1 as a transfer function: a model with a state of its own."""
    section = (np.array([1.0, -0.8]),)
    table = numerators(basis_of(section, 0, Domain.DISCRETE))[:, :1]
    return TransferFunctionModel(
        orders=TransferFunction(poles=(1,), zeros=(0,), delays=(0,)),
        sections=(section,),
        taps=(np.linalg.solve(table.T, np.array([0.2])),),
        constant=0.0,
        scaling=Scaling.identity(1),
        mapping=Mapping.parse(text),
        sample_time=0.1,
        input_units=("psi",),
        output_unit="psi",
        rest_output=90.0,
    )
