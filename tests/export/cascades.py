"""Models wired, and which outputs leave them: the table of cascades that every exporter is held to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from sysid.composite import committee
from sysid.models import (
    NARX,
    Cascade,
    Domain,
    GreyBoxModel,
    Limit,
    Mapping,
    NARXModel,
    Scaling,
    TransferFunction,
    VectorARX,
    VectorARXModel,
    VectorNARX,
    VectorNARXModel,
    VectorScaling,
    parameter_count,
)
from sysid.models.linear.transfer_function import TransferFunctionModel
from tests.models.cascades.cascades import equation


def wired_narx(mapping: str, structure: NARX, seed: int, *, clamp: float = 3.0) -> NARXModel:
    """A network of a cascade, all of whose channels lie between 0 and 90 psi."""
    rng = np.random.default_rng(seed)
    parsed = Mapping.parse(mapping)
    n_inputs = len(parsed.inputs)
    count = parameter_count(structure.lags(n_inputs), structure.neurons, linear=True, gated=structure.gated)
    theta = rng.normal(size=count)
    return NARXModel(
        network=structure,
        theta=theta * 0.4 / np.sqrt(len(theta)),
        scaling=Scaling(
            input_offset=(45.0,) * n_inputs, input_scale=(45.0,) * n_inputs, output_offset=40.0, output_scale=38.0
        ),
        mapping=parsed,
        sample_time=0.1,
        input_units=("psi",) * n_inputs,
        output_unit="psi",
        rest_output=3.0,
        clamp=clamp,
    )


def wired_vector(mapping: str, structure: VectorNARX, seed: int) -> VectorNARXModel:
    """A network of several outputs in a cascade."""
    parsed = Mapping.parse(mapping)
    n, m = len(parsed.inputs), len(parsed.outputs)
    theta = np.random.default_rng(seed).normal(size=structure.parameter_count(n, m))
    return VectorNARXModel(
        network=structure,
        theta=theta * 0.4 / np.sqrt(len(theta)),
        scaling=VectorScaling(
            input_offset=(45.0,) * n, input_scale=(45.0,) * n, output_offset=(40.0,) * m, output_scale=(38.0,) * m
        ),
        mapping=parsed,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_units=("psi",) * m,
        rest_outputs=(5.0,) * m,
    )


def wired_vector_arx(mapping: str, orders: VectorARX, seed: int) -> VectorARXModel:
    """A linear model of several outputs that read each other, in a cascade."""
    parsed = Mapping.parse(mapping)
    n, m = len(parsed.inputs), len(parsed.outputs)
    rng, terms = np.random.default_rng(seed), orders.sized(n, m).terms
    past = sum(channel >= n for _, channel, _ in terms)
    values = [rng.uniform(0.2, 0.9) / (past / m if channel >= n else 2.0 * n) for _, channel, _ in terms]
    return VectorARXModel(
        orders=orders,
        coefficients=np.array(values),
        intercepts=rng.normal(size=m),
        mapping=parsed,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_units=("psi",) * m,
        rest_outputs=(5.0,) * m,
    )


def wired_transfer_function(mapping: str) -> TransferFunctionModel:
    """A slow linear model of one input in a cascade."""
    return TransferFunctionModel(
        orders=TransferFunction(poles=(2,), zeros=(1,), delays=(2,), domain=Domain.DISCRETE),
        sections=((np.array([1.0, -1.9, 0.905]),),),
        taps=(np.array([0.004, 0.001]),),
        constant=0.1,
        scaling=Scaling(input_offset=(45.0,), input_scale=(45.0,), output_offset=38.0, output_scale=40.0),
        mapping=Mapping.parse(mapping),
        sample_time=0.1,
        input_units=("psi",),
        output_unit="psi",
        rest_output=0.0,
    )


def wired_equation(text: str, *inputs: str, free: dict[str, float] | None = None, **tables) -> GreyBoxModel:
    """A member that is an equation; its parameters stand where they start."""
    return replace(equation(text, *inputs, free=free, **tables), rest_output=2.0)


def build_cascade() -> Cascade:
    """Three models: the first computes BP, the second reads it, the third reads both outputs and the command."""
    return Cascade(
        models=(
            wired_narx("STP+FLOW -> BP", NARX(input_delays="0:3", output_delays=[1, 2, 5], neurons=6), 1),
            wired_narx("BP -> AR", NARX(input_delays=2, output_delays=3, neurons=4, gated=True), 2),
            wired_narx(
                "BP+AR+STP -> BC", NARX(input_delays=[[0], [1, 3], [2]], output_delays=2, neurons=5), 3, clamp=0.05
            ),
        )
    )


def build_limited() -> Cascade:
    """Every kind of model, levels that follow an input, and limits of every kind, all of which are reached."""
    return Cascade(
        models=(
            wired_narx("STP+FLOW -> BP", NARX(input_delays="0:1", output_delays=1, neurons=6), 1),
            wired_vector(
                "BP+STP -> AR+ER", VectorNARX(input_delays="0:1", output_delays=[[1, 2], [1, 4]], neurons=5), 2
            ),
            wired_vector("STP -> V+W", VectorNARX(input_delays=1, output_delays=[[2], [1]], neurons=3), 4),
            wired_narx("BP+AR -> BC", NARX(input_delays=1, output_delays=2, neurons=5), 3),
            wired_transfer_function("BP -> X"),
        ),
        rest={"BP": "STP", "AR": "STP", "ER": 60.0, "FLOW": 10.0},
        limits={
            "BP": Limit(low=0.0, high="STP"),
            "AR": Limit(low=12.0, high="BP"),
            "ER": Limit(low=41.0, high=50.0),
            "W": Limit(low="FLOW", high=37.0),
            "BC": Limit(low=37.6, high=37.9),
            "X": Limit(low=36.0, high="STP"),
        },
    )


def build_circle() -> Cascade:
    """Models that read each other through the past, one of them with two outputs and one with gates, and limits."""
    return Cascade(
        models=(
            wired_narx("STP+AR+ER -> BP", NARX(input_delays=[[0, 1], [1, 3], [1]], output_delays=2, neurons=5), 1),
            wired_vector(
                "BP+BC -> AR+ER", VectorNARX(input_delays=[[0], [2]], output_delays=[[1, 2], [1]], neurons=4), 2
            ),
            wired_narx("AR -> BC", NARX(input_delays="0:1", output_delays=1, neurons=3, gated=True), 3, clamp=0.05),
        ),
        rest={"BP": "STP", "AR": 30.0},
        limits={"AR": Limit(low=12.0, high="BP"), "ER": Limit(low=38.0)},
    )


def build_equations() -> Cascade:
    """Networks and equations that read each other through the past, with limits that are equations."""
    structure = NARX(input_delays="0:1", output_delays=1, neurons=4)
    return Cascade(
        models=(
            wired_narx("STP+Q -> BP", NARX(input_delays=[[0, 1], [1, 3]], output_delays=2, neurons=5), 1),
            wired_narx("BP+STP -> AR", structure, 2),
            wired_equation("TOP = max(BP, part*AR[k-1] + sqrt(abs(STP - BP[k-2])))", "STP", "AR", "BP",
                           free={"part": 0.8}),
            wired_equation("Q = where(STP > BP[k-1], share(AR)*BC[k-2], 40 - 0.1*STP[k-3])", "BC", "STP", "BP", "AR",
                           share=[[0, 1], [39, 0.5], [90, 1.5]]),
            wired_narx("Q -> BC", structure, 3),
        ),
        rest={"BP": "STP", "AR": 30.0, "Q": 25.0},
        limits={"AR": Limit(low=12.0, high="TOP"), "Q": Limit(low=12.0, high="STP")},
    )  # fmt: skip


def build_vector_arx() -> Cascade:
    """A linear model of two outputs that read each other, with dead times, and one that reads one of them."""
    first = wired_vector_arx(
        "STP+FLOW -> BP+AR", VectorARX(na=[[2, 1], [1, 3]], nb=[[2, 0], [1, 2]], nk=[[0, 1], [4, 2]]), 5
    )
    return Cascade(models=(first, wired_vector_arx("AR -> BC", VectorARX(na=1, nb=2, nk=0), 6)), rest={"BP": "STP"})


def build_committee(count: int = 3, threshold: float = 1.0, *, mean: bool = False) -> Cascade:
    """Pairs of models of the same outputs: a channel limits an output in each, and one judges the first, or all."""
    structure = NARX(input_delays="0:1", output_delays=1, neurons=4)
    wholes = [
        Cascade(
            models=(
                wired_narx("STP -> BP", structure, seed),
                wired_narx("BP+STP -> BC", structure, seed + 10, clamp=0.5),
            ),
            rest={"BP": "STP"},
            limits={"BC": Limit(low=37.6, high="BP")},
        )
        for seed in range(1, count + 1)
    ]
    return committee(wholes, {"BC": threshold}, mean=["BP", "BC"] if mean else ())


CASCADES: dict[str, tuple[Callable[[], Cascade], tuple[str, ...] | None]] = {
    "three models": (build_cascade, None),
    "every kind, limits and levels": (build_limited, None),
    "in a circle": (build_circle, None),
    "some outputs, in another order": (build_limited, ("BC", "AR")),
    "one output of a circle": (build_circle, ("ER",)),
    "equations in a circle": (build_equations, None),
    "linear, of several outputs": (build_vector_arx, None),
    "a mean of three": (partial(build_committee, 3, 1.0, mean=True), ("BC_spread", "BP", "BC")),
    "a committee of four": (partial(build_committee, 4, 0.5), ("BC",)),
}
"""Models wired, and which outputs leave them."""
