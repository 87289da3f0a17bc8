"""Single models, one of every structure: the table that every exporter is held to."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from sysid.kernels.neurons import NEURONS
from sysid.models import ARX, NARX, AbstractModel, ARXModel, Mapping, NARXModel, Scaling, parameter_count

MAPPINGS = {1: "BP -> BC", 2: "BP+AR -> BC"}


def build_arx(*, na: int, nb: tuple[int, ...], nk: tuple[int, ...], seed: int = 1) -> ARXModel:
    """A stable ARX model: the moduli of its ``a`` add up to 0.9."""
    rng = np.random.default_rng(seed)
    b, a = rng.normal(size=sum(nb)), rng.uniform(0.1, 1.0, na) * rng.choice([-1.0, 1.0], na)
    a *= 0.9 / max(np.abs(a).sum(), 1e-3)
    return ARXModel(
        orders=ARX(na=na, nb=nb, nk=nk),
        coefficients=np.concatenate([b, a]),
        intercept=1.5,
        mapping=Mapping.parse(MAPPINGS[len(nb)]),
        sample_time=0.1,
        input_units=("psi",) * len(nb),
        output_unit="psi",
        rest_output=2.0,
    )


def build_narx(
    structure: NARX,
    *,
    n_inputs: int = 2,
    clamp: float = 3.0,
    gain: float = 0.4,
    seed: int = 2,
    between: tuple[float | None, float | None] = (None, None),
) -> NARXModel:
    """A NARX network with random weights, shrunk until its free run forgets where it started."""
    rng = np.random.default_rng(seed)
    lags = structure.lags(n_inputs)
    count = parameter_count(lags, structure.neurons, linear=structure.feedthrough, gated=structure.gated)
    theta = rng.normal(size=count)
    theta *= gain / np.sqrt(len(theta))
    theta[structure.neurons * lags.n_regressors :] *= 2.0
    return NARXModel(
        network=structure,
        theta=theta,
        scaling=Scaling(
            input_offset=(45.0, 70.0)[:n_inputs],
            input_scale=(45.0, 20.0)[:n_inputs],
            output_offset=38.0,
            output_scale=40.0,
        ),
        mapping=Mapping.parse(MAPPINGS[n_inputs]),
        sample_time=0.1,
        input_units=("psi",) * n_inputs,
        output_unit="psi",
        rest_output=0.0,
        clamp=clamp,
        between=between,
    )


MODELS: dict[str, Callable[[], AbstractModel]] = {
    "ARX": lambda: build_arx(na=2, nb=(2,), nk=(1,)),
    "ARX, two inputs, dead times": lambda: build_arx(na=3, nb=(2, 3), nk=(0, 5)),
    "ARX, finite impulse response": lambda: build_arx(na=0, nb=(4,), nk=(1,)),
    "ARX, direct input only": lambda: build_arx(na=0, nb=(1,), nk=(0,)),
    "ARX, one input unused": lambda: build_arx(na=1, nb=(0, 2), nk=(0, 1)),
    "ARX, no input used": lambda: build_arx(na=2, nb=(0,), nk=(0,)),
    "NARX 4/4/20": lambda: build_narx(NARX(input_delays=4, output_delays=4, neurons=20)),
    "NARX, one input": lambda: build_narx(NARX(input_delays=2, output_delays=3, neurons=5), n_inputs=1),
    "NARX without feed-through": lambda: build_narx(
        NARX(input_delays=2, output_delays=2, neurons=6, feedthrough=False)
    ),
    "NARX, linear part alone": lambda: build_narx(NARX(input_delays=2, output_delays=2, neurons=0)),
    "NARX, direct input": lambda: build_narx(NARX(input_delays="0:3", output_delays=2, neurons=5)),
    "NARX, direct input only": lambda: build_narx(NARX(input_delays="0:0", output_delays=1, neurons=5)),
    "NARX of inputs alone": lambda: build_narx(NARX(input_delays="0:2", output_delays=[], neurons=5)),
    "NARX, a curve without memory": lambda: build_narx(NARX(input_delays=[0], output_delays=[], neurons=5)),
    "NARX, sparse lags": lambda: build_narx(NARX(input_delays=[1, 2, 4, 8], output_delays=[2, 5], neurons=5)),
    "NARX, delays per input": lambda: build_narx(NARX(input_delays=[[0], [1, 2, 4]], output_delays="1:2", neurons=5)),
    "NARX against its limits": lambda: build_narx(
        NARX(input_delays=2, output_delays=2, neurons=8), gain=3.0, seed=5, between=(30.0, 42.5)
    ),
    "NARX against its bounds": lambda: build_narx(
        NARX(input_delays=2, output_delays=2, neurons=8), clamp=0.1, gain=3.0, seed=5
    ),
    **{
        f"NARX, gates of {kind}": partial(
            build_narx, NARX(input_delays="0:1", output_delays=1, neurons=6, gated=True, activation=kind)
        )
        for kind in NEURONS
    },
    "NARX, gates, sparse lags": lambda: build_narx(
        NARX(input_delays=[[0], [1, 2, 5]], output_delays=[2, 3], neurons=4, gated=True)
    ),
    "NARX without bounds": lambda: build_narx(NARX(input_delays=2, output_delays=2, neurons=5), clamp=float("inf")),
}
