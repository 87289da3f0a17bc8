"""Records that do not begin in equilibrium: told where rest was declared, and no matter where it was not."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.estimation import StabilityOptions, Status, Training
from sysid.estimation.fitting import fit
from sysid.estimation.remarks.equilibrium import equilibrium_notes
from sysid.models import (
    ARX,
    NARX,
    AbstractModel,
    AbstractStructure,
    GreyBox,
    Mapping,
    NeuralStateSpace,
    Start,
    StartKind,
    TransferFunction,
)
from sysid.traces import Role, Trace
from sysid.validation.evaluation import evaluate_case
from tests.estimation.linear.test_any_record import bursts
from tests.estimation.linear_systems import trace_of

MAPPING = Mapping.parse("u1 -> y")
ESTIMATED, FIRST = Start(kind=StartKind.ESTIMATED), Start(kind=StartKind.FIRST_SAMPLE)
ARX_1, TF_1 = ARX(na=1, nb=(1,), nk=(1,)), TransferFunction(poles=(1,), zeros=(0,), delays=(1,))
QUICK = Training(max_iterations=60, starts=1)
NETWORKS = [NARX(input_delays=1, output_delays=1, neurons=1), NeuralStateSpace(states=1, neurons=1)]


def fitted(traces: list[Trace], structure: AbstractStructure, start: Start) -> AbstractModel:
    training = QUICK if structure in NETWORKS else None
    return fit(traces, MAPPING, structure, training, start=start, stability=None).model


@pytest.mark.parametrize("start", [Start(), FIRST], ids=["rest", "first-sample"])
@pytest.mark.parametrize("structure", [ARX_1, TF_1], ids=["ARX", "TF"])
def test_a_record_in_motion_is_told_where_it_was_declared_at_rest(structure: AbstractStructure, start: Start) -> None:
    found = fit(bursts(0.9), MAPPING, structure, start=start, rest_output=0.0, stability=None)
    told = [note for note in found.notes if "does not begin in equilibrium" in note]
    assert {note.split()[0] for note in told} >= {"burst0", "burst2"}


@pytest.mark.parametrize(("begins", "told"), [(3.0, 0), (1.0, 1)], ids=["there", "elsewhere"])
def test_a_grey_box_that_declares_its_state_is_asked_and_not_a_model_at_rest(begins: float, told: int) -> None:
    """A vessel that is emptied begins at 3 and not in equilibrium, which is what its equations say."""
    rng = np.random.default_rng(0)
    u, y = np.repeat(rng.uniform(size=40), 5), np.zeros(200)
    y[0] = begins
    for k in range(1, 200):
        y[k] = 0.9 * y[k - 1] + 0.1 * u[k - 1]
    trace = trace_of(u[:, None], y + 1e-3 * rng.standard_normal(200))
    grey = GreyBox(equations="y[k+1] = a*y + b*u1", parameters={"a": 0.8, "b": 0.2}, initial={"y": 3})
    found = fit([trace], MAPPING, grey, start=Start(), rest_output=0.0, stability=None)
    assert grey.learns_start
    assert len([note for note in found.notes if "does not begin where the model does" in note]) == told
    assert not any("in equilibrium" in note for note in found.notes)


def test_nothing_is_told_of_records_that_do_begin_so() -> None:
    u = np.r_[np.zeros(20), np.repeat(np.random.default_rng(0).normal(size=30), 5)]
    y = np.zeros(len(u))
    for k in range(1, len(u)):
        y[k] = 0.9 * y[k - 1] + 0.1 * u[k - 1]
    noisy = y + 0.01 * np.random.default_rng(1).standard_normal(len(u))
    found = fit([trace_of(u[:, None], noisy)], MAPPING, TF_1, start=Start(), rest_output=0.0, stability=None)
    assert equilibrium_notes(found.model, [trace_of(u[:, None], noisy)], Start()) == ()
    assert equilibrium_notes(found.model, bursts(0.9), ESTIMATED) == ()


@pytest.mark.parametrize("a", [0.9, 0.99, 0.999])
@pytest.mark.parametrize("structure", NETWORKS, ids=["NARX", "NSS"])
def test_networks_follow_bursts_off_equilibrium(structure: AbstractStructure, a: float) -> None:
    traces = bursts(a)
    model = fitted(traces, structure, ESTIMATED)
    for trace in traces:
        found = evaluate_case(model, trace, Role.ESTIMATION, ESTIMATED, 1)
        assert found.free_run.max_abs_error < 1e-4 * float(np.ptp(np.concatenate([t["y"] for t in traces])))


def test_which_model_is_better_does_not_depend_on_the_start() -> None:
    """Right models of every kind beside one that is too small: the order is the same, however the runs begin."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.normal(size=60), 5)
    y = np.zeros(300)
    for k in range(2, 300):
        y[k] = 1.5 * y[k - 1] - 0.56 * y[k - 2] + 0.06 * u[k - 1]
    clean = trace_of(u[100:, None], y[100:])
    trace = trace_of(u[100:, None], y[100:] + 0.003 * rng.standard_normal(200))
    right = {
        "ARX": ARX(na=2, nb=(1,), nk=(1,)),
        "TF": TransferFunction(poles=(2,), zeros=(1,), delays=(1,)),
        "NARX": NARX(input_delays=1, output_delays=2, neurons=1),
        "NSS": NeuralStateSpace(states=2, neurons=1),
    }
    training = {"NARX": QUICK, "NSS": QUICK}
    models = {
        name: fit([clean], MAPPING, structure, training.get(name), start=ESTIMATED, stability=None).model
        for name, structure in right.items()
    }
    models["too small"] = fit([clean], MAPPING, ARX_1, start=ESTIMATED, stability=None).model
    for start in (ESTIMATED, Start(kind=StartKind.MEASURED, n_measured=40)):
        errors = {
            name: evaluate_case(model, trace, Role.VALIDATION, start, 1).free_run.mse for name, model in models.items()
        }
        small = errors.pop("too small")
        assert max(errors.values()) < 1.5 * 0.003**2  # noise, whatever the kind
        assert small > 10.0 * max(errors.values())


def slow(lengths: tuple[int, ...], a: float) -> list[Trace]:
    """Bursts of a plant that is slower than they are long, each beginning anywhere."""
    rng = np.random.default_rng(202)
    found = []
    for i, n in enumerate(lengths):
        u = np.repeat(rng.uniform(-1.0, 1.0, n // 5 + 1), 5)[:n]
        y = np.full(n, rng.uniform(-3.0, 3.0))
        for k in range(1, n):
            y[k] = a * y[k - 1] + 0.1 * u[k - 1]
        found.append(trace_of(u[:, None], y, name=f"burst{i}"))
    return found


@pytest.mark.parametrize("lengths", [(12, 15, 20), (25, 30, 45), (60, 60, 60)], ids=str)
@pytest.mark.parametrize("structure", NETWORKS, ids=["NARX", "NSS"])
def test_a_right_model_of_a_slow_plant_is_not_called_unstable(
    structure: AbstractStructure, lengths: tuple[int, ...]
) -> None:
    """Excursions of such records go where the plant itself would leave what was recorded."""
    traces = slow(lengths, 0.999)
    found = fit(traces, MAPPING, structure, QUICK, start=ESTIMATED, stability=StabilityOptions(count=40))
    assert found.status is not Status.UNSTABLE
    for trace in traces:
        error = evaluate_case(found.model, trace, Role.ESTIMATION, ESTIMATED, 1).free_run.max_abs_error
        assert error < 1e-4 * float(np.ptp(np.concatenate([t["y"] for t in traces])))


def test_a_record_that_begins_with_its_step_is_asked_of_no_model_whose_rows_begin_behind_it() -> None:
    """A reaction curve from rest was told to be 0.7 off, by a small ARX model that had seen one value of the input."""
    u = np.concatenate([np.zeros(1), np.ones(120)])
    y = 2.0 * (1.0 - 0.93 ** np.maximum(np.arange(121) - 5, 0)) + 0.01 * np.random.default_rng(1).standard_normal(121)
    late = TransferFunction(poles=(1,), zeros=(0,), delays=(5,))
    found = fit([trace_of(u[:, None], y)], MAPPING, late, start=Start(), stability=None)
    assert not [note for note in found.notes if "does not begin" in note]
