"""Linear models in other forms: the same outputs, whatever the structure, the rate and the number of outputs."""

from __future__ import annotations

import control
import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.models import ARMAX, ARX, NARX, OE, AbstractModel, ARXModel, Mapping, TransferFunction, TransferFunctionModel
from sysid.models.cascades.cascade import Cascade
from sysid.models.channels.scaling import Scaling
from sysid.models.conversions import c2d
from sysid.models.converting.to_control import of_wired
from sysid.models.lagged.cascade_program import Limit
from sysid.models.linear.polynomial import PolynomialModel

T = 1e-3
ONE = Mapping.parse("u -> y")
U = np.concatenate([[[0.0]], np.random.default_rng(0).normal(size=(59, 1))])
"""What the first sample is, each input was before."""


def arx(*coefficients: float, nk: int = 1, na: int = 2, mapping: Mapping = ONE) -> ARXModel:
    m = len(mapping.inputs)
    nb = (len(coefficients) - na) // m if m else 0
    return ARXModel(
        orders=ARX(na=na, nb=(nb,) * m, nk=(nk,) * m), coefficients=np.array(coefficients), intercept=0.3,
        mapping=mapping, sample_time=T, input_units=("V",) * m, output_unit="V", rest_output=0.0,
    )  # fmt: skip


def polynomial(orders: OE | ARMAX, theta: list[float], mapping: Mapping = ONE) -> PolynomialModel:
    m = len(mapping.inputs)
    return PolynomialModel(
        orders=orders, theta=np.array(theta), scaling=Scaling(input_offset=(0.5,) * m, input_scale=(2.0,) * m,
        output_offset=1.0, output_scale=3.0), mapping=mapping, sample_time=T, input_units=("V",) * m, output_unit="V",
        rest_output=0.0,
    )  # fmt: skip


def transfer_function(domain: str, sections: list[float], delay: int) -> TransferFunctionModel:
    return TransferFunctionModel(
        orders=TransferFunction(poles=(2,), zeros=(1,), delays=(delay,), domain=domain),
        sections=((np.array(sections),),), taps=(np.array([0.4, 0.7]),), constant=0.2,
        scaling=Scaling.identity(1), mapping=ONE, sample_time=T,
        input_units=("V",), output_unit="V", rest_output=0.0,
    )  # fmt: skip


MODELS: dict[str, AbstractModel] = {
    "ARX": arx(0.3, 0.2, 1.5, -0.7, nk=4),
    "ARX, at once": arx(0.3, 0.2, 1.5, -0.7, nk=0),
    "OE": polynomial(OE(nb=2, nf=2, nk=1), [0.3, 0.2, -1.5, 0.7, 0.1]),
    "ARMAX": polynomial(ARMAX(na=2, nb=2, nc=1, nk=2), [0.3, 0.2, -1.5, 0.7, 0.5, 0.1]),
    "TF": transfer_function("discrete", [1.0, -1.5, 0.7], 3),
    "continuous TF": transfer_function("continuous", [4e5, 300.0, 1.0], 3),
}


def response(model: AbstractModel) -> np.ndarray:
    return np.asarray(model.simulate(U)) - np.asarray(model.simulate(0.0 * U))


def forced(system: object, u: np.ndarray = U) -> np.ndarray:
    found = control.forced_response(system, U=u.T, T=np.arange(len(u)) * T).outputs
    return np.atleast_2d(found)[0]


@pytest.mark.parametrize("name", MODELS)
def test_the_continuous_form_has_the_samples_of_the_model(name: str) -> None:
    model = MODELS[name]
    found = model.continuous()  # type: ignore[attr-defined]
    late = round(found.delays[0] / T)
    assert late == {"ARX": 3, "ARMAX": 1, "TF": 2, "continuous TF": 3}.get(name, 0)
    plant = control.ss(found.A, found.B, found.C, found.D)
    u = np.concatenate([np.zeros((late, 1)), U])[: len(U)]
    np.testing.assert_allclose(forced(c2d(plant, T), u), response(model), rtol=1e-8, atol=1e-10)
    assert model.to_control(continuous=True, pade_order=2).nstates == 2 + 2 * bool(late)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (arx(0.3, 0.2, 0.1, 1.5, -0.7), "at most 2 coefficients"),
        (arx(0.3, 0.2, -0.5, 0.1), "negative real axis"),
        (arx(0.5, 0.1, mapping=Mapping.parse("-> y")), "a model with inputs"),
    ],
    ids=["more coefficients than poles", "a negative pole", "a time series"],
)
def test_what_has_no_continuous_form_is_refused_with_a_remedy(model: ARXModel, said: str) -> None:
    with pytest.raises(ConfigError, match=said) as caught:
        model.to_control(continuous=True)
    assert caught.value.remedy


def test_models_of_several_outputs_and_chains_are_one_system() -> None:
    parts = (arx(0.3, 0.2, 1.5, -0.7), arx(0.3, 0.1, 0.8, -0.1, nk=0, mapping=Mapping.parse("y -> z")),
             arx(0.2, 0.4, 0.5, na=1, mapping=Mapping.parse("u+z -> w")))  # fmt: skip
    cascade = Cascade(models=parts)
    system = cascade.to_control()
    assert (system.input_labels, system.output_labels, system.dt) == (["u"], ["y", "z", "w"], T)
    found = control.forced_response(system, U=U.T, T=np.arange(len(U)) * T).outputs
    moved, still = cascade.simulate(U), cascade.simulate(0.0 * U)
    for row, name in zip(found, ("y", "z", "w"), strict=True):
        np.testing.assert_allclose(row, moved[name] - still[name], rtol=1e-9, atol=1e-10)


def test_a_cascade_that_is_not_linear_is_refused() -> None:
    with pytest.raises(ConfigError, match="limits") as caught:
        Cascade(models=(arx(0.3, 0.2, 1.5, -0.7),), limits={"y": Limit(high=1.0)}).to_control()
    assert caught.value.remedy
    network = NARX(input_delays=1, output_delays=1, neurons=1)
    model = type("Network", (), {"mapping": ONE, "structure": network})()
    with pytest.raises(ConfigError, match="not linear"):
        of_wired([model], ["u"], ["y"], T)
