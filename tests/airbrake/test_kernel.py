"""The compiled kernel against the plain step of reference.py: random states, every switch, and short runs."""

import dataclasses

import numpy as np
import pytest

from sysid.airbrake.consist import Consist
from sysid.airbrake.equipment import EQUIPMENT
from sysid.airbrake.flow import flow_table
from sysid.airbrake.machine import BrakedTrain, all_probes
from sysid.airbrake.reference import PlainTrain
from sysid.airbrake.variant import ACOUSTIC, LISTING, PHYSICAL, Variant
from sysid.units import PSI_IN_PA, STANDARD_ATMOSPHERE_PA

STEP = 1e-3
TRAINS = {
    "one pair": Consist(pairs=1),
    "three pairs": Consist(pairs=3),
    "locomotive inside": Consist(pairs=3, locomotives=(1,)),
    "locomotive last": Consist(pairs=2, locomotives=(2,)),
    "retainers": Consist(pairs=2, retainers=(20.0, 0.0)),
}


def single_switches() -> dict[str, Variant]:
    """Both presets, and each of their switches turned alone where the variant allows it."""
    variants = {"listing": LISTING, "physical": PHYSICAL}
    for field in dataclasses.fields(Variant):
        if getattr(LISTING, field.name) != getattr(PHYSICAL, field.name):
            back = {field.name: getattr(LISTING, field.name)}
            if field.name == "latched_release":
                back |= {"feed_closed_in_lap": False, "graduating_lap": False}
            if field.name == "relay_band":
                back |= {"equalising_rate": None}
            variants[f"physical, {field.name} as printed"] = dataclasses.replace(PHYSICAL, **back)
    variants["physical, no quick service"] = PHYSICAL.with_options({"quick_service": "none"})
    variants["listing, no quick service"] = LISTING.with_options({"quick_service": "none"})
    variants["physical, air with momentum"] = ACOUSTIC
    variants["physical, leaking"] = PHYSICAL.with_options({"leakage": 574.6})
    variants["listing, exhaust as printed"] = LISTING.with_options({"exhaust_as_printed": True})
    for name in ("accelerated_service", "accelerated_emergency"):
        variants[f"physical, no {name}"] = PHYSICAL.with_options({name: False})
    variants["physical, accelerated application"] = PHYSICAL.with_options({"accelerated_application": True})
    variants["distributor of UIC 540"] = EQUIPMENT["uic-p"].variant
    return variants


VARIANTS = single_switches()


def train_pair(consist: Consist, variant: Variant, sample_time: float = STEP) -> tuple[BrakedTrain, PlainTrain]:
    # The stability guard is about runs, not about single steps: the printed switches may be tried at 1 ms too.
    compiled = BrakedTrain(
        consist=consist, variant=variant, probes=all_probes(consist), time_step=STEP, sample_time=sample_time
    )
    table = flow_table(laminar_ratio=variant.laminar_ratio)
    return compiled, PlainTrain(consist=consist, variant=variant, time_step=STEP, table=table)


def plain_pressures(plain: PlainTrain) -> np.ndarray:
    columns = [
        [getattr(pair, name) for pair in plain.pairs] for name in ("auxiliary", "emergency", "cylinder", "action")
    ]
    return np.array([*plain.pipe, *np.ravel(columns)])


def randomise(compiled: BrakedTrain, plain: PlainTrain, rng: np.random.Generator) -> None:
    """Put both into the same random state, thresholds and equalities included."""
    charged, state = compiled.consist.charged, compiled.state
    nodes, valves = compiled.consist.vehicles, compiled.consist.pairs
    base = rng.uniform(STANDARD_ATMOSPHERE_PA, charged)
    scale = rng.choice([300.0, 3e3, 3e4, 3e5])

    def pressures(count: int) -> np.ndarray:
        return np.clip(base + scale * rng.standard_normal(count), STANDARD_ATMOSPHERE_PA, charged)

    plain.pipe = pressures(nodes).tolist()
    plain.port = pressures(len(plain.port)).tolist()
    for pair in plain.pairs:
        pair.auxiliary, pair.emergency, pair.action = pressures(3).tolist()
        full = plain.consist.cylinder.volume * pair.auxiliary
        pair.content = float(rng.choice([0.0, rng.uniform(0.0, full), rng.uniform(0.0, full)]))
        if not plain.variant.piston:
            pair.content += STANDARD_ATMOSPHERE_PA * plain.consist.cylinder.volume
        pair.cylinder = plain._cylinder_pressure(pair.content)
        pair.releasing, pair.tripped = bool(rng.random() < 0.5), bool(rng.random() < 0.5)
        pair.past = pressures(len(pair.past)).tolist()
    state.pressures[:] = plain_pressures(plain)
    state.port[:] = plain.port
    plain.between = (0.1 * rng.standard_normal(nodes - 2)).tolist()
    state.flows[1 : nodes - 1] = plain.between
    for j, pair in enumerate(plain.pairs):
        state.content[j], state.releasing[j], state.tripped[j] = pair.content, pair.releasing, pair.tripped
        state.history[:, j] = pair.past
    state.cursor[0] = 0
    assert valves == len(plain.pairs)


@pytest.mark.parametrize("variant", VARIANTS.values(), ids=VARIANTS.keys())
@pytest.mark.parametrize("consist", TRAINS.values(), ids=TRAINS.keys())
def test_single_steps_from_random_states_agree_with_the_plain_step(consist: Consist, variant: Variant) -> None:
    rng = np.random.default_rng(20)
    compiled, plain = train_pair(consist, variant)
    for _ in range(60):
        randomise(compiled, plain, rng)
        command = float(rng.choice([0.0, 64.2, rng.uniform(50.0, 90.0), 90.0]))
        speed, tail = float(rng.choice([0.0, 5.0])), float(rng.choice([0.0, 2e-4]))
        heard = float(rng.choice([command, 0.0, 80.0]))
        compiled.advance(np.array([command]), speed=speed, tail_vent=tail, remote=np.array([heard]))
        absolute, remote = (psi * PSI_IN_PA + STANDARD_ATMOSPHERE_PA for psi in (command, heard))
        plain.step(absolute, speed=speed, tail_area=tail, remote=remote)
        np.testing.assert_allclose(compiled.state.pressures, plain_pressures(plain), rtol=1e-12, atol=0.0)
        np.testing.assert_allclose(compiled.state.port, plain.port, rtol=1e-15, atol=0.0)
        assert compiled.state.releasing.tolist() == [pair.releasing for pair in plain.pairs]
        assert compiled.state.tripped.tolist() == [pair.tripped for pair in plain.pairs]


@pytest.mark.parametrize("drop", [26.0, 90.0], ids=["full service", "emergency"])
@pytest.mark.parametrize("variant", [LISTING, PHYSICAL, ACOUSTIC], ids=["listing", "physical", "acoustic"])
def test_short_runs_agree_with_the_plain_steps(variant: Variant, drop: float) -> None:
    consist = Consist(pairs=2)
    compiled, plain = train_pair(consist, variant, sample_time=0.05)
    commands = np.repeat([90.0, 90.0 - drop, 90.0], [2, 60, 20])
    means = []
    for command in commands:
        rows = []
        for _ in range(50):
            plain.step(command * PSI_IN_PA + STANDARD_ATMOSPHERE_PA)
            rows.append(plain_pressures(plain))
        means.append(np.mean(rows, axis=0))
    np.testing.assert_allclose(compiled.advance(commands), means, rtol=1e-9)


def test_a_run_in_chunks_is_the_run_in_one_piece() -> None:
    consist, commands = Consist(pairs=2), np.repeat([90.0, 70.0, 90.0], [5, 40, 40])
    whole, _ = train_pair(consist, PHYSICAL, sample_time=0.1)
    chunked, _ = train_pair(consist, PHYSICAL, sample_time=0.1)
    parts = [chunked.advance(part) for part in np.split(commands, [3, 17, 60])]
    np.testing.assert_array_equal(np.concatenate(parts), whole.advance(commands))
