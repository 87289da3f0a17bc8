"""What records leave open, and what a fit leaves out of them, is told for every kind of structure."""

from __future__ import annotations

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import sysid
from sysid.estimation.remarks.error_lags import left_out
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.estimation.remarks.record_notes import between_levels, contradicted, outnumbered, underexcited, undetermined
from sysid.models import History, Mapping, Start

N = 400
STRUCTURES = [
    sysid.ARX(na=1, nb=1, nk=1),
    sysid.TransferFunction(poles=(1,), zeros=(0,), delays=(1,)),
    sysid.LinearStateSpace(states=1),
    sysid.OE(nb=1, nf=1, nk=1),
    sysid.NARX(input_delays=1, output_delays=1, neurons=1),
]
"""One of each kind that can leave the lag 0 out."""
BUDGET = {"NARX": sysid.Training(max_iterations=5, starts=1), "NSS": sysid.Training(max_iterations=5, starts=1)}


def _u(seed: int = 0) -> np.ndarray:
    return np.repeat(np.random.default_rng(seed).uniform(-1, 1, N // 4), 4)


def _y(u: np.ndarray, dead: int) -> np.ndarray:
    """``y(k) = 0.9 y(k-1) + 0.1 u(k - dead)``."""
    late = np.r_[np.zeros(dead), u][:N]
    return np.convolve(late, 0.1 * 0.9 ** np.arange(N))[:N]


def _fit(u: np.ndarray, y: np.ndarray, structure: object) -> sysid.FitResult:
    mapping = "u -> y" if u.ndim == 1 else "+".join(f"u{j + 1}" for j in range(u.shape[1])) + " -> y"
    traces = sysid.data((u, y), sample_time=1.0, split=(0.6, 0.4))
    training = BUDGET.get(structure.kind) if hasattr(structure, "kind") else None
    return sysid.fit(traces, mapping, structure, **({} if training is None else {"training": training}))


@pytest.mark.parametrize("structure", STRUCTURES, ids=lambda s: s.kind)
def test_an_input_that_acts_at_once_is_told_where_the_model_leaves_it_out(structure: object) -> None:
    u = _u()
    (told,) = [note for note in _fit(u, _y(u, dead=0), structure).warnings if "at once" in note]
    if isinstance(structure, sysid.NARX):
        assert "moves with u of the same sample. Either u acts at once" in told
    else:  # of linear models it is tried
        assert "y answers u sooner than this model has it: with a coefficient at lag 0" in told


@pytest.mark.parametrize("structure", STRUCTURES, ids=lambda s: s.kind)
def test_nothing_is_told_where_the_input_acts_later(structure: object) -> None:
    u = _u()
    y = _y(u, dead=1) + 0.02 * np.random.default_rng(1).standard_normal(N)
    told = _fit(u, y, structure).warnings
    assert not [note for note in told if "of the same sample" in note or "sooner than this model" in note]


def test_nothing_is_told_where_the_model_has_the_path() -> None:
    u = _u()
    y = _y(u, dead=0) + 0.1 * u**3  # an error that moves with u of the same sample
    fit = _fit(u, y, sysid.ARX(na=1, nb=1, nk=0))
    assert not [note for note in fit.warnings if "of the same sample" in note]


@pytest.mark.parametrize("structure", [*STRUCTURES, sysid.NeuralStateSpace(states=1, neurons=1)], ids=lambda s: s.kind)
def test_channels_that_say_nothing_are_named(structure: sysid.ARX) -> None:
    u = _u()
    inputs = np.column_stack([u, 2.0 * u + 1.0, np.full(N, 3.0)])
    wide = {
        "ARX": sysid.ARX(na=1, nb=(1, 1, 1), nk=(1, 1, 1)),
        "TransferFunction": sysid.TransferFunction(poles=(1,) * 3, zeros=(0,) * 3, delays=(1,) * 3),
        "OE": sysid.OE(nb=(1, 1, 1), nf=(1, 1, 1), nk=(1, 1, 1)),
    }.get(structure.kind, structure)
    told = _fit(inputs, _y(u, dead=1), wide).warnings
    assert "u2 is made of u1 in these records: they do not tell their effects apart." in told
    assert "u3 never changes in these records: they say nothing of its effect." in told
    assert not [note for note in told if note.startswith("u1 ")]


@pytest.mark.parametrize(("own", "told"), [(1e-3, True), (0.1, False)])
def test_an_input_that_is_nearly_made_of_another_is_told(own: float, told: bool) -> None:
    u = _u()
    both = np.column_stack([u, u + own * np.random.default_rng(3).standard_normal(N) * u.std()])
    (trace,) = sysid.data((both, _y(u, dead=1)), sample_time=1.0)
    found = undetermined([trace], Mapping(inputs=("u1", "u2"), outputs=("y",)))
    assert [note.startswith("u2 is nearly made of u1 in these records: 0.1 %") for note in found] == [True] * told


@pytest.mark.parametrize("level", [0.0, 3.0])
@pytest.mark.parametrize("structure", [*STRUCTURES, sysid.NeuralStateSpace(states=1, neurons=1)], ids=lambda s: s.kind)
def test_a_constant_output_is_told_and_no_number_overflows(structure: object, level: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        fit = _fit(_u(), np.full(N, level), structure)
    assert "y never changes in these records: they say nothing of a response to any input." in fit.warnings


def test_a_free_run_that_a_constant_beats_is_told() -> None:
    u = _u()
    y = _y(u, dead=1)
    fit = _fit(u, y, sysid.ARX(na=1, nb=1, nk=1))
    assert not [note for note in fit.warnings if "than a constant" in note]
    (other_way,) = sysid.data((u, -y), sample_time=1.0)
    told, *_ = contradicted(fit.model, [other_way], Start())
    assert told.startswith("Over the records that were fitted the free run of y is worse than a constant")
    assert "intervals" not in told
    told, *_ = contradicted(fit.model, [other_way], Start(), uncertainty=fit.uncertainty)
    assert "intervals of its parameters mean nothing" in told
    (drowned,) = sysid.data((u, y + 20.0 * y.std() * np.random.default_rng(5).standard_normal(N)), sample_time=1.0)
    told, *_ = contradicted(fit.model, [drowned], Start(), uncertainty=fit.uncertainty)
    assert "intervals" not in told
    assert told.startswith("Over the records that were fitted the free run of y is hardly better than a constant")
    (as_it_is,) = sysid.data((u, y), sample_time=1.0)
    assert contradicted(fit.model, [as_it_is], Start()) == ()


def test_more_parameters_than_samples_are_told() -> None:
    u = _u()
    (told,) = outnumbered(
        _fit(u, _y(u, 1), sysid.ARX(na=1, nb=1, nk=1)).model, sysid.data((u[:3], u[:3]), sample_time=1.0)
    )
    assert "3 parameters" in told
    assert "3 samples" in told
    few = sysid.data((u[:4], u[:4] + 1.0), sample_time=1.0)
    assert outnumbered(_fit(u, _y(u, 1), sysid.ARX(na=1, nb=1, nk=1)).model, tuple(few)) == ()


def test_an_output_that_never_changes_is_the_constant_of_an_arx_model() -> None:
    found = _fit(_u(), np.full(N, 0.3), sysid.ARX(na=1, nb=1, nk=1)).model
    assert found.intercept == pytest.approx(0.3, abs=1e-12)
    assert np.abs(found.coefficients).max() < 1e-12


@pytest.mark.parametrize("domain", ["discrete", "continuous"])
def test_a_transfer_function_without_effect_still_leaves_the_state_in_which_it_begins(domain: str) -> None:
    y = 2.0 - 2.0 * 0.9 ** np.arange(N)
    traces = sysid.data((np.full(N, 2.0), y), sample_time=1.0)
    structure = sysid.TransferFunction(poles=(1,), zeros=(0,), delays=(2,), domain=domain)
    fit = sysid.fit(traces, "u -> y", structure, stability=sysid.StabilityOptions(count=0))
    (case,) = next(iter(sysid.compare(traces, fit).evaluations.values())).cases.values()
    assert case.free_run.max_abs_error < 1e-9
    assert not fit.model.recursion.B.any()


def test_a_controller_read_backwards_is_told() -> None:
    rng = np.random.default_rng(2)
    y, u, x = np.zeros(N), np.zeros(N), 0.0
    for k in range(N):
        y[k] = x + 0.05 * rng.standard_normal()
        u[k] = -3.0 * y[k]
        x = 0.9 * x + 0.1 * u[k]
    fit = _fit(u, y, sysid.NeuralStateSpace(states=1, neurons=1))
    (told,) = [note for note in fit.warnings if "of the same sample" in note]
    assert told.startswith("100 % of what is new in y moves with u")
    assert "controller" in told
    plant = _fit(_u(), _y(_u(), dead=1), sysid.NeuralStateSpace(states=1, neurons=1))
    assert not [note for note in plant.warnings if "of the same sample" in note]


def test_samples_far_from_all_others_are_told_and_large_steps_are_not() -> None:
    u = _u()
    y = _y(u, dead=1)
    y[[50, 120]] = 1e6
    (told,) = [note for note in _fit(u, y, STRUCTURES[0]).warnings if "samples of y lie" in note]
    assert told.startswith("2 of 240 samples of y lie up to ")
    pulse = np.where(np.arange(N) % 100 < 3, 30.0, 0.0) + 0.01 * u  # 3 % of the samples are no faults
    assert not [note for note in _fit(pulse, _y(pulse, dead=1), STRUCTURES[0]).warnings if "samples of" in note]


def _noisy(y: np.ndarray) -> np.ndarray:
    return y + 0.02 * np.std(y) * np.random.default_rng(1).standard_normal(len(y))


@pytest.mark.parametrize("structure", STRUCTURES[:1] + STRUCTURES[2:], ids=lambda s: s.kind)
def test_a_dead_time_that_is_too_short_is_told_with_the_right_one(structure: object) -> None:
    """Only a transfer function searches its dead time by itself."""
    u = np.repeat(np.random.default_rng(0).uniform(-1, 1, 200), 4)
    y = np.convolve(np.r_[np.zeros(30), u], 0.1 * 0.9 ** np.arange(800))[:800]
    told = [note for note in _fit(u, _noisy(y), structure).warnings if "dead time is too" in note]
    assert len(told) == 1
    word = "input_delays from 30" if structure.kind == "NARX" else "nk: 30"
    assert f"acts from lag 1 on: its dead time is too short. Begin there ({word})," in told[0]


def test_a_remedy_is_in_the_words_of_the_structure() -> None:
    u = np.repeat(np.random.default_rng(0).uniform(-1, 1, 200), 4)
    y = np.convolve(np.r_[np.zeros(30), u], 0.1 * 0.9 ** np.arange(800))[:800]
    traces = sysid.data((u, _noisy(y)), sample_time=1.0)
    grey = sysid.GreyBox(equations="dx/dt = (u - x)/tau; y = g*x", parameters={"tau": 5.0, "g": 1.0})
    (told,) = [note for note in sysid.fit(traces, "u -> y", grey).warnings if "dead time is too" in note]
    late = int(told.split("give it the input ")[1].split(" samples later")[0])
    shifted = sysid.data((u[:-late], y[late:]), sample_time=1.0)  # as it says
    assert not [note for note in sysid.fit(shifted, "u -> y", grey).warnings if "dead time" in note]


def test_an_input_that_the_model_let_go_is_told_with_its_dead_time() -> None:
    u = np.repeat(np.random.default_rng(0).uniform(-1, 1, 200), 4)[:, np.newaxis]
    y = np.convolve(np.r_[np.zeros(30), u[:, 0]], 0.1 * 0.9 ** np.arange(800))[:800]
    model = SimpleNamespace(
        mapping=Mapping(inputs=("u",), outputs=("y",)),
        structure=SimpleNamespace(acts_at_once=False, input_delays=((1,),)),
        simulate=lambda u, _: np.zeros(len(u)),
    )
    run = FreeRun(
        inputs=u,
        output=_noisy(y)[:, np.newaxis],
        simulated=np.zeros((800, 1)),
        usable=np.ones(800, dtype=bool),
        history=History.at_rest(inputs=[0.0], output=0.0),
    )
    (told,) = left_out(model, run)
    assert "y does not depend on u. Begin there (input_delays from 30)," in told


def test_an_input_that_goes_with_another_is_no_input_let_go() -> None:
    u = _u()
    both = np.column_stack([u, u + 1e-4 * np.random.default_rng(3).standard_normal(N)])
    (trace,) = sysid.data((both, _noisy(_y(u, dead=1))), sample_time=1.0)
    grey = sysid.GreyBox(equations="x[k+1] = 0.9*x + 0.1*u1; y = g*x", parameters={"g": 0.5})
    told = sysid.fit(trace, "u1+u2 -> y", grey, stability=sysid.StabilityOptions(count=0)).warnings
    assert not [note for note in told if "does not depend" in note]


def test_a_dead_time_that_is_too_long_is_told_with_the_right_one() -> None:
    u = _u()
    for structure in (sysid.ARX(na=1, nb=1, nk=12), sysid.OE(nb=1, nf=1, nk=12)):
        told = [note for note in _fit(u, _noisy(_y(u, dead=3)), structure).warnings if "dead time is too" in note]
        assert len(told) == 1
        assert "acts from lag 12 on: its dead time is too long. Begin there (nk: 3)," in told[0]


@pytest.mark.parametrize("plant", ["quantised", "dead zone", "drift", "two paths", "slow"])
def test_no_dead_time_is_told_where_something_else_is_wrong(plant: str) -> None:
    """Each leaves an error that moves with earlier inputs, and each begins at the lag 1."""
    u = np.repeat(np.random.default_rng(2).uniform(-1, 1, 60), 10)
    linear = np.convolve(np.r_[0.0, u][:600], 0.1 * 0.9 ** np.arange(600))[:600]
    rest = np.convolve(np.r_[0.0, np.sign(u) * np.maximum(np.abs(u) - 0.5, 0.0)][:600], 0.9 ** np.arange(600))[:600]
    y = {
        "quantised": np.round(4.0 * linear) / 4.0,
        "dead zone": rest,
        "drift": linear + 0.05 * np.cumsum(np.random.default_rng(3).standard_normal(600)),
        "two paths": linear + 0.5 * np.r_[np.zeros(60), linear][:600],
        "slow": np.convolve(linear, 0.05 * 0.95 ** np.arange(600))[:600],
    }[plant]
    traces = sysid.data((u, _noisy(y)), sample_time=1.0)
    for structure in (sysid.ARX(na=1, nb=1, nk=1), sysid.OE(nb=1, nf=1, nk=1)):
        assert not [note for note in sysid.fit(traces, "u -> y", structure).warnings if "dead time is too" in note]


@pytest.mark.parametrize("seed", range(3))
def test_a_few_steps_that_all_say_the_same_are_enough(seed: int) -> None:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.0, 4.0, 10), 15)
    y = np.convolve(u, 0.1 * 0.9 ** np.arange(150))[:150] + 0.002 * rng.standard_normal(150)
    fit = sysid.fit(sysid.data((u, y), sample_time=0.1), "u -> y", sysid.OE(nb=1, nf=1, nk=1))
    assert [note for note in fit.warnings if "sooner than this model has it: with a coefficient at lag 0" in note]


@pytest.mark.parametrize("jumps", [(200,), (100, 260)])
@pytest.mark.parametrize("shift", [0, 3])
def test_no_dead_time_is_read_from_a_few_jumps_of_another_cause(jumps: tuple[int, ...], shift: int) -> None:
    """Of held levels one falls on the jump at some lag, and is then all that is new in both."""
    u = np.repeat(np.random.default_rng(8).uniform(-1, 1, 50), 8)
    y = np.zeros(len(u))
    for jump in jumps:
        y[jump + shift :] += 1.0
    for structure in (sysid.ARX(na=1, nb=1, nk=1), sysid.OE(nb=1, nf=1, nk=1)):
        told = sysid.fit(sysid.data((u, y), sample_time=0.1), "u -> y", structure).warnings
        assert not [note for note in told if "dead time" in note or "of the same sample" in note or "sooner" in note]


def test_a_free_run_that_grows_without_bound_is_told_and_ends_nothing() -> None:
    """``y = 2 u`` at once, by an equation without that lag: its squares were too large to be numbers."""
    u = np.repeat(np.random.default_rng(1).choice([-1.0, 1.0], 126), 8)[:1_000]
    fit = sysid.fit(sysid.data((u, 2.0 * u), sample_time=0.1), "u -> y", sysid.ARX(na=2, nb=2, nk=1))
    assert [note for note in fit.warnings if "sooner than this model has it: with a coefficient at lag 0" in note]


@pytest.mark.parametrize(
    ("u", "order"),
    [(np.sin(0.1 * np.arange(N)), 3), (np.where(np.arange(N) % 2, 1.0, -1.0), 1), (_u(), None)],
    ids=["one sine", "every other sample", "random"],
)
@pytest.mark.parametrize(
    "structure",
    [sysid.OE(nb=3, nf=2, nk=1), sysid.TransferFunction(poles=(2,), zeros=(2,)), sysid.LinearStateSpace(states=3)],
    ids=lambda s: s.kind,
)
def test_an_input_that_moves_in_too_few_ways_is_told(structure: object, u: np.ndarray, order: int | None) -> None:
    fit = sysid.fit(sysid.data((u, _noisy(_y(u, dead=1))), sample_time=1.0), "u -> y", structure)
    told = [note for note in fit.warnings if "too few ways" in note]
    assert [f"excites order {order}," in note for note in told] == ([] if order is None else [True])


CURVED = [
    sysid.NARX(input_delays=2, output_delays=2, neurons=1),
    sysid.VectorNARX(input_delays=2, output_delays=2, neurons=1),
    sysid.PolynomialNARX(input_delays=1, output_delays=1),
    sysid.NeuralStateSpace(states=1, neurons=1),
    sysid.HammersteinWiener(states=1, input="polynomial 2"),
    sysid.WienerHammerstein(first=1, second=1, curve="polynomial 2"),
]


@pytest.mark.parametrize("structure", CURVED, ids=lambda s: s.kind)
def test_a_structure_that_learns_curves_is_told_what_one_sine_and_two_levels_leave_open(structure: object) -> None:
    model = SimpleNamespace(
        mapping=Mapping(inputs=("u",), outputs=("y",)), structure=structure, ratios={}
    )  # what is asked is of structure and records alone
    told = {}
    sine, steps = np.sin(0.1 * np.arange(N)), np.sign(_u())
    for name, u in {"sine": sine, "steps": steps, "switch": np.maximum(steps, 0.0), "random": _u()}.items():
        traces = list(sysid.data((u, _y(u, dead=1)), sample_time=1.0))
        switches, levels = between_levels(model, traces)
        told[name] = (len(underexcited(model, traces)), len(levels), len(switches))
    assert told == {"sine": (1, 0, 0), "steps": (0, 1, 0), "switch": (0, 0, 1), "random": (0, 0, 0)}


def test_a_network_of_two_levels_has_a_warning_and_one_of_a_switch_a_note() -> None:
    warned = []
    for u in (np.sign(_u()), np.maximum(np.sign(_u()), 0.0)):
        traces = sysid.data((u, _noisy(_y(u, dead=1))), sample_time=1.0)
        fit = sysid.fit(traces, "u -> y", CURVED[0], sysid.Training(max_iterations=2))
        warned.append([any("is only ever" in one for one in told) for told in (fit.warnings, fit.notes)])
    assert warned == [[True, True], [False, True]]


def test_equations_are_not_told_of_curves() -> None:
    u = np.sign(_u())
    grey = sysid.GreyBox(equations="dx/dt = (u - x)/tau; y = x", parameters={"tau": 5.0})
    traces = list(sysid.data((u, _y(u, dead=1)), sample_time=1.0))
    model = SimpleNamespace(mapping=Mapping(inputs=("u",), outputs=("y",)), structure=grey, ratios={})
    assert (underexcited(model, traces), between_levels(model, traces)) == ((), ((), ()))


def test_inputs_of_several_outputs_are_looked_at_once() -> None:
    u = np.sin(0.1 * np.arange(N))
    traces = sysid.data((u, np.column_stack([_noisy(_y(u, dead=1)), _noisy(_y(u, dead=2))])), sample_time=1.0)
    fit = sysid.fit(traces, "u -> y1+y2", sysid.VectorStateSpace(states=3))
    assert len([note for note in fit.warnings if "too few ways" in note]) == 1


@pytest.mark.parametrize(("zone", "told"), [(0.8, False), (0.0, True)], ids=["within a dead zone", "without one"])
def test_a_model_that_a_move_at_the_beginning_does_not_reach_is_not_accused(zone: float, told: bool) -> None:
    """Its first sample moves nothing, and that is no dead time."""

    def response(u: np.ndarray, dead: int, pole: float) -> np.ndarray:
        held = np.sign(u) * np.maximum(np.abs(u) - zone, 0.0)
        return np.convolve(np.r_[np.zeros(dead), held], 0.1 * pole ** np.arange(len(u)))[: len(u)]

    u = np.r_[np.zeros((20, 1)), np.repeat(np.random.default_rng(4).uniform(-1, 1, (60, 1)), 10, axis=0)]
    model = SimpleNamespace(
        mapping=Mapping(inputs=("u",), outputs=("y",)),
        structure=SimpleNamespace(acts_at_once=False),
        simulate=lambda u, _: response(u[:, 0], 1, 0.9),
    )
    run = FreeRun(
        inputs=u,
        output=_noisy(response(u[:, 0], 20, 0.9))[:, np.newaxis],
        simulated=response(u[:, 0], 1, 0.9)[:, np.newaxis],
        usable=np.ones(620, dtype=bool),
        history=History.at_rest(inputs=[0.0], output=0.0),
    )
    assert ["dead time is too short" in note for note in left_out(model, run)] == [True] * told


@pytest.mark.parametrize("structure", STRUCTURES[:4], ids=lambda s: s.kind)
def test_records_at_other_levels_are_told_as_that(structure: object) -> None:
    """An error that the level makes moves with a slow response to any input: it was taken for too little memory."""
    levels = (0.0, 5.0, -3.0)
    records = [(u, _y(u, dead=1) + 0.01 * _u(9) + level) for level, u in zip(levels, map(_u, range(3)), strict=True)]
    told = sysid.fit(sysid.data(records, sample_time=1.0), "u -> y", structure).warnings
    assert any("stands at other levels" in note for note in told)
    assert not [note for note in told if "too little memory" in note]
    records = [(u, y - level) for (u, y), level in zip(records, levels, strict=True)]
    told = sysid.fit(sysid.data(records, sample_time=1.0), "u -> y", structure).warnings
    assert not [note for note in told if "levels" in note]


def test_an_input_without_coefficients_is_not_asked_how_it_moves():
    fit = _fit(_u(), _y(_u(), 1), sysid.ARX(na=1, nb=0, nk=1))
    assert not any("too few ways" in note for note in fit.notes)
