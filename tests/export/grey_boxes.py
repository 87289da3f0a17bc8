"""Grey boxes with known numbers: what of the language there is, exported."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from sysid.equations import ROSENBROCK, RUNGE_KUTTA
from sysid.models import GreyBox, GreyBoxModel, Scaling, VectorGreyBox, VectorGreyBoxModel, VectorScaling
from sysid.models import Mapping as Channels
from sysid.models.grey_box.grey_box import lowered

Model = GreyBoxModel | VectorGreyBoxModel


def build_grey(
    equations: str,
    *,
    mapping: str = "BP+AR -> BC",
    substeps: int = 2,
    low: float = -np.inf,
    solver: str = RUNGE_KUTTA,
    **fields: Mapping[str, Any],
) -> Model:
    """A grey box at the starts of its parameters, with random weights; every state is ordinarily 10 and moves by 20."""
    channels = Channels.parse(mapping)
    kind = GreyBox if len(channels.outputs) == 1 else VectorGreyBox
    grey = kind(equations=equations, substeps=substeps, **fields)
    low_form = lowered(grey, channels.inputs, channels.outputs, 0.1, solver)
    weights = 0.3 * np.random.default_rng(1).normal(size=low_form.n_weights)
    n, m, n_u = low_form.n_states, len(channels.outputs), len(channels.inputs)
    terms: dict[str, Any] = {
        "grey": grey, "theta": np.concatenate([[one.start for one in grey.free], weights]), "norms": low_form.norms,
        "levels": (10.0,) * n, "spans": (20.0,) * n, "substeps": substeps, "mapping": channels, "sample_time": 0.1,
        "input_units": ("psi",) * n_u, "solver": solver,
    }  # fmt: skip
    plain = {"input_offset": (0.0,) * n_u, "input_scale": (1.0,) * n_u}
    if m == 1:
        scaling = Scaling(**plain, output_offset=0.0, output_scale=10.0)
        return GreyBoxModel(**terms, scaling=scaling, output_unit="psi", rest_output=5.0)
    vector = VectorScaling(**plain, output_offset=(0.0,) * m, output_scale=(10.0,) * m)
    return VectorGreyBoxModel(**terms, scaling=vector, output_units=("psi",) * m, rest_outputs=(5.0,) * m)


EVERYTHING = """
    dx/dt = 0.5*(valve(BP) - x) - 0.2*tanh(x/30) + 0.05*sin(x) - 0.01*abs(x - AR) + net(0.02*x, 0.02*AR; neurons=2)
    on = relay(x, on=20, off=10)
    z[k+1] = 0.9*z + 0.1*where(on and AR > 30, BP, hold(AR, BP > 50))
    w[k+1] = clamp(z, 5, 60) + 0.3*sign(BP - 40) + where(0.01*AR, 1, -1)
    smooth = exp(-x/50) + log(1 + z^2) + cos(z) + atan(x - 25)/2 + atan(w/90) + abs(x)^1.5/100 + 1/(1 + z^2)
    late = 0.1*BP[k-3] + 0.1*AR(t - 0.234) + latch(BP > 80, AR > 60) + 0.1*x[k-2] - 0.1*delay(z*w, 0.1)
    BC = w + smooth + late + min(x, z, 40) - max(x, sqrt(BP - AR))
"""
VALVE = {"valve": [[0, 0], [40, 30], [70, 33], [95, 60]]}

STIFF = """
    dp/dt = 2e4*(valve(BP) - p) - 50*tanh((p - q)/0.2)*sqrt(abs(p - q)) - 3*max(p - AR, 0)
    dq/dt = 0.5*(p - q) - 0.02*where(q > AR, q^1.5, 0.1*q^2) + net(0.02*q, 0.02*BP; neurons=2)
    dw/dt = 900*min(q, 50) - 900*w*abs(w)/(1 + w) + sin(w) - exp(-w) + valve(w)
    BC = w + 0.1*q
"""

MOVING = """
    dx/dt = 0.5*(BP - x) - 0.02*AR[k-1] + 0.05*sin(x) - 0.01*BP(t - 0.25) + net(0.02*x, 0.02*BP; neurons=2)
    dv/dt = 3*relay(x, on=20, off=10) - v
    z[k+1] = 0.9*z + 0.1*hold(AR, BP > 50)
    BC = z + v + 0.1*x + 0.02*BP + 0.1*delay(x, 0.1)
"""

GREY_BOXES: dict[str, Callable[[], Model]] = {
    "tanks": lambda: build_grey(
        "dx1/dt = k2*BP - k1*sqrt(x1)\ndBC/dt = k1*sqrt(x1) - k1*sqrt(max(BC, 0.1*AR))",
        parameters={"k1": 2.0, "k2": {"start": 0.1, "fixed": True}},
        initial={"x1": 3.0},
    ),
    "everything": lambda: build_grey(EVERYTHING, initial={"z": 3.0}, tables=VALVE),
    "nothing remembered": lambda: build_grey("BC = 0.5*BP + k", parameters={"k": 0.2}),
    "a delay alone": lambda: build_grey("BC = 0.5*BP[k-2]"),
    "two outputs": lambda: build_grey(
        "dx/dt = (BP - x)/2\nBC = x + 0.1*AR\nER = relay(x, on=50, off=40)", mapping="BP+AR -> BC+ER"
    ),
    "an integrator, where it is said to be": lambda: build_grey(
        "dq/dt = v\ndv/dt = 0.1*(BP - AR) - v\nBC = q", substeps=1
    ),
    "stiff": lambda: build_grey(STIFF, solver=ROSENBROCK, tables=VALVE),
    "moving": lambda: build_grey(MOVING, initial={"z": 3.0}, intersample={"BP": "foh"}),
    "stiff, moving": lambda: build_grey(STIFF, solver=ROSENBROCK, tables=VALVE, intersample="foh"),
    "declared states": lambda: build_grey("dBC/dt = 0.3*(BP - BC)", initial={"BC": {"start": 12, "fixed": True}}),
}
