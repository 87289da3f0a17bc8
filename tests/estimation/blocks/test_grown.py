"""More states than a record needs: the larger structure begins as the smaller one, and ends no worse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid.equations.lowered import Net
from sysid.estimation.blocks.equations import hammerstein_wiener, wiener_hammerstein
from sysid.estimation.blocks.fit import fit_blocks
from sysid.estimation.blocks.grown import grown, states_of
from sysid.estimation.blocks.linear_start import LinearStart
from sysid.estimation.blocks.sections import Pair, block_of
from sysid.estimation.grey_box.layout import renormed
from sysid.estimation.grey_box.readying import built_template
from sysid.estimation.networks.training import Training
from sysid.models import BuiltModel, HammersteinWiener, Mapping, Scaling, Start, WienerHammerstein
from sysid.models.blocks.block_oriented import BlockStructure
from sysid.models.blocks.curves import Curve
from sysid.traces import Channel, Trace
from tests.traces.made import trace_of

FIRST, SECOND = ([0.0, 0.05, 0.04], np.poly([0.85 * np.exp(0.2j), 0.85 * np.exp(-0.2j)]).real), ([0.3], [1.0, -0.7])
BRIEF = Training(starts=1, max_iterations=20, workers=1)
NOISE = 0.02


def bent(z: np.ndarray) -> np.ndarray:
    return np.asarray(z + 2.0 * z**3)


def hammerstein(u: np.ndarray) -> np.ndarray:
    return np.asarray(lfilter(*FIRST, bent(u)))


def wiener(u: np.ndarray) -> np.ndarray:
    return bent(lfilter(*FIRST, u))


def sandwich(u: np.ndarray) -> np.ndarray:
    return np.asarray(lfilter(*SECOND, bent(lfilter(*FIRST, u))))


def steps(rng: np.random.Generator, n: int = 300) -> np.ndarray:
    u = np.repeat(rng.uniform(-1.0, 1.0, n // 3), 3)
    u[:10] = 0.0
    return u


def fitted(structure: BlockStructure, u: np.ndarray, y: np.ndarray) -> BuiltModel:
    trace = trace_of({"u": u, "y": y})
    model = fit_blocks([trace], Mapping.parse("u -> y"), structure, BRIEF).model
    assert isinstance(model, BuiltModel)
    return model


CURVE = "polynomial 3"


@pytest.mark.parametrize(
    ("system", "needed", "larger", "seed"),
    [
        pytest.param(
            hammerstein, HammersteinWiener(states=2, input=CURVE), HammersteinWiener(states=3, input=CURVE), 0,
            id="Hammerstein",
        ),
        # Its linear model of four states has one as slow as the record, and was taken to integrate.
        pytest.param(
            wiener, HammersteinWiener(states=2, output=CURVE), HammersteinWiener(states=4, output=CURVE), 1, id="Wiener"
        ),
        pytest.param(
            sandwich, WienerHammerstein(first=2, second=1, curve=CURVE),
            WienerHammerstein(first=3, second=2, curve=CURVE), 0, id="Wiener-Hammerstein",
        ),
    ],
)  # fmt: skip
def test_states_that_a_record_does_not_need_cost_nothing(
    system: Callable[[np.ndarray], np.ndarray], needed: BlockStructure, larger: BlockStructure, seed: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("sysid.estimation.blocks.first_block.DRAWN", 10)
    monkeypatch.setattr("sysid.estimation.blocks.first_block.MOVED", 1)
    rng = np.random.default_rng(seed)
    u, other = steps(rng), steps(rng)
    y, wanted = system(u), system(other)
    noisy = y + NOISE * y.std() * rng.standard_normal(len(y))
    errors = [
        np.hypot(np.std(fitted(one, u, noisy).simulate(other[:, None]) - wanted) / y.std(), NOISE)
        for one in (needed, larger)
    ]
    assert errors[0] < 1.1 * NOISE
    assert errors[1] < 1.06 * errors[0]


@pytest.mark.parametrize(
    ("smaller", "larger"),
    [
        (HammersteinWiener(states=1, input="network 2"), HammersteinWiener(states=2, input="network 2")),
        (HammersteinWiener(states=2, output=CURVE), HammersteinWiener(states=3, output=CURVE)),
        (
            WienerHammerstein(first=2, second=1, curve=CURVE, between=1),
            WienerHammerstein(first=3, second=2, curve=CURVE, between=1),
        ),
        (
            WienerHammerstein(first=1, second=2, curve=CURVE, delays=0),
            WienerHammerstein(first=2, second=3, curve=CURVE, delays=0),
        ),
    ],
    ids=lambda one: one.label,
)
def test_a_pole_and_a_zero_on_it_change_nothing(smaller: BlockStructure, larger: BlockStructure) -> None:
    rng = np.random.default_rng(3)
    inputs = np.column_stack([steps(rng, 60), steps(rng, 60)])
    y = sandwich(inputs.sum(axis=1))
    few, many = (_begun(one, inputs, y) for one in (smaller, larger))
    low, at = states_of(smaller), states_of(larger)
    assert all(at[tag] - low[tag] in {0, 1} for tag in at)
    known = dict(zip([one.name for one in few.grey.free], 0.3 * rng.standard_normal(len(few.grey.free)), strict=True))
    given = grown(known, smaller, larger, n_inputs=2, pole=0.7, name=str)
    weights = rng.standard_normal(few.lowered.n_weights)
    whole = replace(many, theta=np.array([*(given[one.name] for one in many.grey.free), *weights]), norms=few.norms)
    part = replace(few, theta=np.array([*known.values(), *weights]))
    np.testing.assert_allclose(whole.simulate(inputs), part.simulate(inputs), rtol=1e-9, atol=1e-9)


def _begun(structure: BlockStructure, inputs: np.ndarray, y: np.ndarray) -> BuiltModel:
    """A model of a structure, not fitted."""
    channels = tuple(Channel(name=name, unit="V") for name in ("u", "v", "y"))
    trace = Trace(name="record", sample_time=1.0, channels=channels, values=np.column_stack([inputs, y]))
    mapping = Mapping.parse("u+v -> y")
    scaling = Scaling(input_offset=(0.0, 0.0), input_scale=(1.0, 1.0), output_offset=0.5, output_scale=2.0)
    begun = LinearStart(
        scaling=scaling, poles=np.zeros(0, dtype=np.complex128), response=np.zeros((1, 2)), level=0.1, samples=60
    )
    low = states_of(structure)
    blocks = {
        tag: block_of(
            np.linspace(0.2, 0.8, n).astype(np.complex128), np.ones((50, 1 if tag == "g2" else 2)), direct=True
        )
        for tag, n in low.items()
    }
    if isinstance(structure, WienerHammerstein):
        pair = Pair(before=blocks["g1"], behind=blocks["g2"], x=np.linspace(-1.0, 1.0, 9), y=np.linspace(-1.0, 1.0, 9))
        grey, _ = wiener_hammerstein(structure, mapping, begun, pair)
    else:
        assert isinstance(structure, HammersteinWiener)
        grey, _ = hammerstein_wiener(structure, mapping, begun, blocks["g"])
    return built_template([trace], mapping, grey, built_of=structure, start=Start(), rest_output=0.0)[0]


def test_weights_are_those_of_the_same_network_whatever_it_sees_is_scaled_by() -> None:
    rng = np.random.default_rng(0)
    net = Net(arguments=2, neurons=3, first=0, norm=0, probe=0, scaled=False)
    weights, seen = rng.standard_normal(net.stop), rng.standard_normal((5, 2))

    def gives(weights: np.ndarray, norms: np.ndarray) -> np.ndarray:
        z = (seen - norms[:4:2]) * norms[1:4:2]
        W = weights[net.hidden].reshape(3, 3)
        inside = np.tanh(z @ W[:, :2].T + W[:, 2])
        return np.asarray(
            norms[4] * (inside @ weights[net.readout] + np.column_stack([z, np.ones(5)]) @ weights[net.linear])
        )

    before, after = rng.uniform(0.5, 2.0, 5), rng.uniform(0.5, 2.0, 5)
    assert gives(renormed([net], weights, before, after), after) == pytest.approx(gives(weights, before))


def test_a_network_begins_as_the_curve_between_both_blocks() -> None:
    x = np.linspace(-1.0, 1.0, 200)
    curve, y = Curve.parse("network 8", "curve"), np.minimum(x, 0.3)
    scale, _ = curve.like(x, y) or (0.0, {})
    weights, net = curve.weights(x, y / scale), Net(arguments=1, neurons=8, first=0, norm=0, probe=0, scaled=True)
    hidden = weights[net.hidden].reshape(8, 2)
    given = np.tanh(np.outer(x, hidden[:, 0]) + hidden[:, 1]) @ weights[net.readout] + weights[net.linear][0] * x
    left = scale * (x + given) - y
    assert np.std(left) < 0.05 * np.std(y)
    assert curve.like(x, x**2) is None
