"""Block-oriented models and polynomials of records whose truth is known."""

from __future__ import annotations

from functools import cache
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.errors import ConfigError
from sysid.estimation import FitResult, StabilityOptions, Status
from sysid.estimation.blocks.fit import fit_blocks
from sysid.estimation.blocks.polynomial_narx import fit_polynomial_narx
from sysid.estimation.blocks.sections import block_of, responses, sections_of
from sysid.estimation.blocks.selection import choose_terms, products
from sysid.estimation.networks.training import Training
from sysid.export import EXPORTERS, Surrogate
from sysid.models import (
    BuiltModel,
    HammersteinWiener,
    History,
    Mapping,
    PolynomialNARX,
    Start,
    StartKind,
    WienerHammerstein,
    model_from_dict,
)
from sysid.models.blocks.curve_values import curve_values, has_curves
from sysid.models.blocks.curves import Curve
from sysid.traces import Trace
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
ONE = Training(starts=1, max_iterations=80, workers=1)
POLES = np.poly([0.85 * np.exp(0.2j), 0.85 * np.exp(-0.2j)]).real


def a_trace(u: np.ndarray, y: np.ndarray) -> Trace:
    return trace_of({"u": u, "y": y}, sample_time=0.5)


def steps(seed: int, n: int = 400) -> np.ndarray:
    u = np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, n // 4), 4)
    u[:20] = 0.0  # so that what began at 0 is at rest
    return u


def block(w: np.ndarray) -> np.ndarray:
    return np.asarray(lfilter((0.0, 0.05, 0.04), POLES, w))


def error(fit: FitResult, system: Any) -> float:
    """Of the free run over another record, over the spread of its output."""
    u = steps(99)
    y = system(u)
    return float(np.std(fit.model.simulate(u[:, None]) - y) / np.std(y))


def saturated(u: np.ndarray) -> np.ndarray:
    return block(np.clip(u, -0.6, 0.4))


def bent(u: np.ndarray) -> np.ndarray:
    z = block(u)
    return np.asarray(z + 0.4 * z**2)


def both(u: np.ndarray) -> np.ndarray:
    return np.asarray(np.clip(block(u + 0.5 * u**3), -0.5, 0.5))


def late(u: np.ndarray) -> np.ndarray:
    return saturated(np.concatenate([np.zeros(3), u[:-3]]))


@pytest.mark.parametrize(
    ("system", "structure"),
    [
        pytest.param(saturated, {"input": "saturation"}, id="Hammerstein"),
        pytest.param(saturated, {"input": {"saturation": [-0.6, 0.4]}}, id="Hammerstein, its limits known"),
        pytest.param(saturated, {"input": {"table": [[-0.6, -6], [0.4, 4]]}}, id="Hammerstein, its curve known"),
        pytest.param(late, {"input": "saturation", "delays": 4}, id="with a dead time"),
        pytest.param(bent, {"output": "polynomial 2"}, id="Wiener"),
        pytest.param(lambda u: np.abs(block(u)), {"output": "absolute"}, id="Wiener, no sign"),
        pytest.param(both, {"input": "polynomial 3", "output": "saturation"}, id="Hammerstein-Wiener"),
    ],
)
def test_blocks_and_curves_are_found(system: Any, structure: dict[str, Any]) -> None:
    u = steps(1)
    fit = fit_blocks([a_trace(u, system(u))], MAPPING, HammersteinWiener(states=2, **structure), ONE)
    assert error(fit, system) < 2e-3


def test_a_curve_behind_a_block_may_turn_back() -> None:
    """It had ended, CONVERGED, near what a linear model knows of it, which is nothing."""
    u, brief = steps(1), Training(starts=2, max_iterations=80, workers=1)
    structure = HammersteinWiener(states=2, input="polynomial 3", output="piecewise 2")

    def system(u: np.ndarray) -> np.ndarray:
        return np.abs(block(u**3))

    assert error(fit_blocks([a_trace(u, system(u))], MAPPING, structure, brief), system) < 5e-3


def test_a_network_begins_as_the_curve_that_was_found_whatever_it_sees_is_scaled_by() -> None:
    """It began as if nothing were scaled, a thousand times further off, and starts that were right were dropped."""
    u, one = steps(1), Training(starts=2, max_iterations=1, workers=1)

    def system(u: np.ndarray) -> np.ndarray:
        return np.abs(block(u))

    fit = fit_blocks([a_trace(u, system(u))], MAPPING, HammersteinWiener(states=2, output="network 6"), one)
    assert error(fit, system) < 0.2


NAMED = {
    "blocks": HammersteinWiener(states=1, input="piecewise 4", output="piecewise 4"),
    "polynomial": PolynomialNARX(),
}


@cache
def named(structure: str, given: str, comes: str) -> sysid.Fit:
    """A fit of channels with these names; how well it ends, and how long its record is, are no matter of theirs."""
    u = steps(0, 160)
    trace = trace_of({given: u, comes: saturated(u)}, name="r")
    brief, few = Training(starts=2, max_iterations=5, workers=1), StabilityOptions(count=20)
    return sysid.fit(trace, Mapping(inputs=(given,), outputs=(comes,)), NAMED[structure], brief, stability=few)


@pytest.mark.parametrize(
    ("structure", "given", "comes"),
    [
        ("blocks", "t", "max"), ("polynomial", "t", "max"), ("blocks", 'u "1"', "pi"), ("polynomial", "f_in", "and"),
        ("polynomial", "c1", "inside"), ("blocks", "k", "x = 1"),
    ],
)  # fmt: skip
def test_channels_may_be_called_as_words_of_equations_are(structure: str, given: str, comes: str) -> None:
    found, plain, u = named(structure, given, comes), named(structure, "u", "y"), steps(0)
    np.testing.assert_array_equal(found.model.simulate(u[:, None]), plain.model.simulate(u[:, None]))
    if has_curves(found.model):
        rest = History.at_rest(inputs=u[:1], output=0.0)
        drawn, usual = (curve_values(one.model, [(u[:, None], rest)]) for one in (found, plain))
        for one, other in zip(drawn, usual, strict=True):
            np.testing.assert_array_equal(one.y, other.y)


def test_the_limits_of_a_saturation_have_intervals_that_hold_them() -> None:
    u = steps(1)
    y = saturated(u) + 0.005 * np.random.default_rng(0).standard_normal(len(u))
    fit = fit_blocks([a_trace(u, y)], MAPPING, HammersteinWiener(states=2, input="saturation"), ONE)
    known, middle, half = fit.uncertainty, (u.max() + u.min()) / 2.0, (u.max() - u.min()) / 2.0
    assert known is not None
    places = [known.names.index(name) for name in ("f_low", "f_high")]
    away = known.values[places] * half + middle - [-0.6, 0.4]
    assert (np.abs(away) < 3.0 * known.standard_deviations[places] * half).all()
    assert (known.standard_deviations[places] < 0.05).all()
    assert any("clamp(f_in, (-0." in note for note in fit.notes)


def sandwich(u: np.ndarray) -> np.ndarray:
    return np.asarray(lfilter([0.0, 0.5], [1.0, -0.5], block(u) + 2.0 * block(u) ** 3))


def circuit(u: np.ndarray) -> np.ndarray:
    """Two first-order filters around a diode, in eight steps a sample; the input is held."""
    y, x1, x2 = np.empty(len(u)), 0.0, 0.0
    for k, held in enumerate(u):
        y[k] = x2
        for _ in range(8):
            x1, x2 = x1 + 0.125 * 0.8 * (held - x1), x2 + 0.125 * 0.3 * (min(x1, 0.2) - x2)
    return y


def test_a_curve_that_acts_between_the_samples_is_followed_there() -> None:
    noise = 1e-4 * np.random.default_rng(1).standard_normal(400)
    trace = a_trace(steps(1), circuit(steps(1)) + noise)
    fits = [
        fit_blocks([trace], MAPPING, WienerHammerstein(first=1, second=1, curve="piecewise 1", between=between), ONE)
        for between in (0, 2)
    ]
    at_samples, between = (error(fit, circuit) for fit in fits)
    assert at_samples > 0.01
    assert between < at_samples / 3.0
    assert fits[1].model.structure.label == "WH 1/1, piecewise 1, 2 between"


def test_a_rounded_corner_is_as_wide_as_it_was() -> None:
    def system(u: np.ndarray) -> np.ndarray:
        return block(u - 0.12 * (np.logaddexp(0.0, (u - 0.3) / 0.15) - np.logaddexp(0.0, -2.0)))

    fit = fit_blocks(
        [a_trace(steps(1), system(steps(1)))], MAPPING, HammersteinWiener(states=2, input="rounded 1"), ONE
    )
    assert error(fit, system) < 1e-4
    model = fit.model
    assert isinstance(model, BuiltModel)
    half = np.ptp(steps(1)) / 2.0  # widths are shares of what the curve ranges over
    assert model.parameters["f_width1"] * half == pytest.approx(0.15, rel=0.02)


def test_poles_are_parted_around_the_curve() -> None:
    u = steps(1)
    structure = WienerHammerstein(first=2, second=1, curve="polynomial 3")
    fit = fit_blocks([a_trace(u, sandwich(u))], MAPPING, structure, Training(starts=3, max_iterations=80, workers=1))
    assert error(fit, sandwich) < 2e-3
    found = fit.model.parameters  # type: ignore[attr-defined]
    assert [found["g1_a1_1"], found["g1_a1_2"], found["g2_a1_1"]] == pytest.approx([*POLES[1:], 0.5], abs=1e-3)


def test_a_scale_that_no_record_can_tell_is_no_fault_of_the_record() -> None:
    """How large what lies between two blocks is has no meaning: all gains were told as open, twice as wide as large."""
    y = sandwich(u := steps(5)) + 1e-3 * np.random.default_rng(1).standard_normal(400)
    structure = WienerHammerstein(first=2, second=1, curve="polynomial 3")
    fit = fit_blocks([a_trace(u, y)], MAPPING, structure, Training(starts=1, max_iterations=60))
    assert not [note for note in fit.notes if "do not tell" in note]
    known = fit.uncertainty
    assert known is not None
    width = known.standard_deviations / np.abs(known.values)
    held = [name for name, one in zip(known.names, width, strict=True) if np.isnan(one)]
    assert [name[:4] for name in held] == ["g1_b"]
    assert width[known.names.index("f_c3")] < 0.2


def test_a_model_is_stored_and_read_again() -> None:
    u = steps(1)
    structure = HammersteinWiener(states=2, input="network 2")
    fit = fit_blocks([a_trace(u, saturated(u))], MAPPING, structure, Training(starts=1, max_iterations=2))
    again = model_from_dict(fit.model.to_dict())
    assert isinstance(again, BuiltModel)
    assert again.structure == structure
    assert (again.simulate(u[:, None]) == fit.model.simulate(u[:, None])).all()


@pytest.mark.parametrize("poles", [[0.5], [0.9, 0.9], [0.9 + 0.2j, 0.9 - 0.2j, 0.7], [0.99, 0.98, 0.97, 0.5]], ids=str)
def test_sections_have_the_response_of_the_poles(poles: list[complex]) -> None:
    impulse = np.eye(200)[0]
    wanted = np.asarray(lfilter([0.3, *[0.1] * len(poles)], np.poly(poles).real, impulse))
    found = block_of(np.array(poles, dtype=np.complex128), wanted[:, None], direct=True)
    answer = responses(sections_of(np.array(poles, dtype=np.complex128)), 200) @ found.gains[:, 0]
    answer[0] = found.direct[0]
    assert answer == pytest.approx(wanted, abs=1e-7)
    assert found.filtered(impulse[:, None]) == pytest.approx(wanted, abs=1e-6)


def slow_choice(X: np.ndarray, y: np.ndarray, candidates: list[tuple[int, ...]], most: int) -> list[tuple[int, ...]]:
    """The term that leaves least, again and again, by least squares over all that are chosen."""
    taken: list[tuple[int, ...]] = []
    for _ in range(most):
        left = {}
        for one in candidates:
            if one not in taken:
                P = products(X, [*taken, one]).T
                left[one] = np.sum((y - P @ np.linalg.lstsq(P, y, rcond=None)[0]) ** 2)
        taken.append(min(left, key=lambda one: left[one]))
    return taken


def test_terms_are_those_that_leave_least(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    X, y = 5.0 + rng.standard_normal((3, 60)), rng.standard_normal(60)
    candidates = [term for d in range(3) for term in combinations_with_replacement(range(3), d)]
    monkeypatch.setattr("sysid.estimation.blocks.selection.CHUNK", 180)
    found = choose_terms(X, y, candidates, 6)
    assert list(found.terms) == slow_choice(X, y, candidates, 6)
    P = products(X, found.terms).T
    best = np.linalg.lstsq(P, y, rcond=None)[0]
    assert found.coefficients[-1] == pytest.approx(best, rel=1e-6)
    assert sum(found.reductions) == pytest.approx(1.0 - np.sum((y - P @ best) ** 2) / (y @ y), abs=1e-9)


@pytest.mark.parametrize("name", ["c", "onnx"])
def test_files_of_one_compute_what_it_computes(name: str, tmp_path: Path) -> None:
    u = steps(1)
    brief = Training(starts=1, max_iterations=2)
    blocks = HammersteinWiener(states=2, input="network 2", output="saturation")
    for fit in (
        fit_blocks([a_trace(u, saturated(u))], MAPPING, blocks, brief),
        fit_polynomial_narx([a_trace(u, polynomial(u))], MAPPING, PolynomialNARX(degree=2, terms=4), brief),
    ):
        whole = Surrogate.of(fit.model)
        for file in EXPORTERS[name].write(whole, tmp_path):
            run = EXPORTERS[name].load(file, tmp_path)
            found = run(u[:300, None, None], whole.at_rest(u[:1])[None])
            np.testing.assert_allclose(found.output[:, 0, 0], fit.model.simulate(u[:300, None]), atol=1e-9)


def polynomial(u: np.ndarray) -> np.ndarray:
    y = np.zeros(len(u))
    for k in range(2, len(u)):
        y[k] = 0.5 * y[k - 1] + 0.3 * y[k - 1] * u[k - 1] + 0.8 * u[k - 2] ** 2
    return y


def test_the_terms_of_a_polynomial_are_found_and_told() -> None:
    u = steps(1)
    y = polynomial(u) + 0.01 * np.random.default_rng(0).standard_normal(len(u))
    fit = fit_polynomial_narx([a_trace(u, y)], MAPPING, PolynomialNARX(degree=2, terms=8))
    model = fit.model
    assert isinstance(model, BuiltModel)
    assert error(fit, polynomial) < 0.01
    assert sorted(model.parameters.values()) == pytest.approx([0.3, 0.5, 0.8], abs=0.01)
    assert model.equations.count("*") == 4
    assert model.equations in fit.notes
    assert any("u[k-2]^2" in note and "%" in note for note in fit.notes)


@pytest.mark.parametrize(
    ("written", "said"),
    [("spline 4", "spline 4"), ("piecewise 0", "piecewise 0"), ({"saturation": [2, 1]}, "saturation"),
     ({"table": [[0, 1], [0, 2]]}, "table"), (3, "3")],
    ids=str,
)  # fmt: skip
def test_what_is_no_curve_is_refused(written: object, said: str) -> None:
    with pytest.raises(ConfigError, match="not a static curve") as caught:
        HammersteinWiener(states=1, input=written)
    assert said in str(caught.value.got)


def test_structures_refuse_what_does_not_fit_the_inputs() -> None:
    two = Mapping.parse("u+v -> y")
    with pytest.raises(ConfigError, match="the curves do not match the inputs"):
        HammersteinWiener(states=1, input=["none", "none", "none"]).check_mapping(two)
    with pytest.raises(ConfigError, match="the dead times do not match the inputs"):
        WienerHammerstein(first=1, second=1, delays=[1]).check_mapping(two)
    with pytest.raises(ConfigError, match="a network acts at the samples alone"):
        WienerHammerstein(first=1, second=1, curve="network 3", between=1)
    with pytest.raises(ConfigError, match="what lies between two blocks has no unit"):
        WienerHammerstein(first=1, second=1, curve={"saturation": [0, 1]})
    with pytest.raises(ConfigError, match="too many candidate terms"):
        PolynomialNARX(input_delays=30, output_delays=30, degree=5).check_mapping(two)


def test_a_known_curve_is_written_as_it_was_given() -> None:
    structure = HammersteinWiener(states=1, input={"dead zone": [-1, 1]}, output="absolute")
    assert structure.to_dict()["input"] == [{"dead zone": [-1, 1]}]
    assert HammersteinWiener(**{k: v for k, v in structure.to_dict().items() if k != "kind"}) == structure
    assert Curve.parse("network 5", "input").size == 5


def first_order(u: np.ndarray, pole: float, level: float) -> np.ndarray:
    return np.asarray(level + lfilter((0.0, 0.2), (1.0, -pole), u))


@pytest.mark.parametrize(("pole", "level"), [(0.8, 1e9), (0.8, 1e3), (1.0, 0.0), (1.0 - 1e-16, 2.0)])
def test_a_polynomial_is_found_far_from_zero_and_where_it_integrates(pole: float, level: float) -> None:
    u = steps(1)
    y = first_order(u, pole, level)
    linear = PolynomialNARX(input_delays=1, output_delays=1, degree=2, terms=4)
    fit = fit_polynomial_narx([a_trace(u, y)], MAPPING, linear, ONE, start=Start(kind=StartKind.ESTIMATED))
    run = fit.model.simulate(u[:, None], History.at_rest(inputs=u[:1], output=y[0]))
    assert np.abs(run - y).max() < 1e-6 * np.ptp(y) + 1e-15 * level * len(y)


def test_what_the_time_cuts_is_told() -> None:
    u = steps(3)
    y = block(u + 0.4 * u**2)
    rich = PolynomialNARX(input_delays=4, output_delays=4, degree=3)
    fit = fit_polynomial_narx([a_trace(u, y)], MAPPING, rich, Training(max_time_s=1e-3))
    assert "The time ended before all was tried: 1 terms were chosen" in fit.notes[-1]
    assert fit.status is Status.TIME_LIMIT
    wiener = fit_blocks(
        [a_trace(u, y)], MAPPING, HammersteinWiener(states=2, input="polynomial 3"), Training(max_time_s=1e-3)
    )
    assert wiener.status is Status.TIME_LIMIT
    assert wiener.train_time_s < 5.0


def test_an_output_that_never_changes_is_a_constant_and_no_power_of_itself() -> None:
    fit = fit_polynomial_narx([a_trace(steps(1), np.full(400, 0.3))], MAPPING, PolynomialNARX(), ONE)
    assert fit.model.equations == "y = 0.3 + 0"


def test_a_plant_that_integrates_behind_a_valve_and_a_lag_is_found() -> None:
    """Its slow pole takes all that the free run's error says of a linear model: steps of the output say the rest."""

    def tank(u: np.ndarray) -> np.ndarray:
        flow = lfilter((0.0, 0.2), (1.0, -0.8), np.clip(u, -0.3, 0.6))
        return np.asarray(lfilter((0.0, 0.1), (1.0, -1.0), flow))

    u = steps(1)
    y = tank(u)
    y = y + 0.01 * np.std(y) * np.random.default_rng(0).standard_normal(len(u))
    structure = HammersteinWiener(states=2, input="saturation")
    fit = fit_blocks([a_trace(u, y)], MAPPING, structure, Training(starts=1, max_iterations=60))
    assert error(fit, tank) < 0.05  # its pole is estimated, and sums up what is wrong with it
    assert fit.status.usable


@pytest.mark.parametrize(("kind", "drift"), [(StartKind.REST, 0.0), (StartKind.ESTIMATED, -0.02)])
def test_a_block_may_integrate_an_input_that_is_off(kind: StartKind, drift: float) -> None:
    u = steps(7)
    y = 5.0 + np.concatenate([[0.0], np.cumsum(0.05 * u + drift)[:-1]])
    found = fit_blocks(
        [a_trace(u + 3.0, y)], MAPPING, HammersteinWiener(states=1), ONE, start=Start(kind=kind), rest_output=5.0
    )
    run = found.model.simulate(u[4:, None] + 3.0, History(inputs=u[:4, None] + 3.0, output=y[:4]))
    assert np.abs(run - y[4:]).max() < 1e-6 * np.std(y)
