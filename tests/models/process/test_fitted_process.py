"""Fitted process models run, respond and are stored as the plants that they name."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.models import FittedProcess, History, Mapping, ProcessModel, Scaling, model_from_dict
from sysid.models.process.process_run import run

T = 0.5
VALUES = (np.array([2.0, 3.0, 0.8]), np.array([-1.0, 1.0, 0.3, 0.7, 1.0]))


def model(types: tuple[str, ...] = ("P1D", "P2DZU"), level: tuple[float, ...] = (0.0, 0.0)) -> FittedProcess:
    return FittedProcess.of(
        ProcessModel(type=types), VALUES[: len(types)], constant=5.0, level=np.array(level),
        scaling=Scaling(input_offset=(0.0,) * len(types), input_scale=(3.0, 0.2)[: len(types)], output_offset=0.0,
                        output_scale=7.0),
        mapping=Mapping.parse("a+b -> y" if len(types) > 1 else "a -> y"), sample_time=T,
        input_units=("V", "A")[: len(types)], output_unit="m", rest_output=5.0,
    )  # fmt: skip


def test_the_free_run_is_that_of_its_paths() -> None:
    u = np.repeat(np.random.default_rng(0).normal(size=(20, 2)), 6, axis=0)
    own, plants = model(), model().process.types
    paths = [run(plants[j], VALUES[j], u[:, j], u[0, j], T).output for j in (0, 1)]
    assert np.allclose(own.simulate(u), 5.0 + paths[0] + paths[1], atol=1e-9)


def test_what_integrates_counts_from_its_level() -> None:
    u = np.repeat(np.random.default_rng(0).normal(size=20), 6)
    own = model(("P1DI",), (0.4,))
    wanted = run(own.process.types[0], VALUES[0], u - 0.4, 0.0, T).output
    found = own.simulate(u[:, np.newaxis], History.at_rest(inputs=[0.4], output=1.0))
    assert np.allclose(found - found[0], wanted, atol=1e-9)
    assert np.allclose(own.simulate(np.full((40, 1), 0.4)), 5.0)


def test_its_response_is_the_formula_with_the_dead_time_as_it_is() -> None:
    w = np.logspace(-2, 0.5, 9)
    K, Tw, zeta, Tz, Td = VALUES[1]
    s = 1j * w
    wanted = K * (1 + Tz * s) / (1 + 2 * zeta * Tw * s + (Tw * s) ** 2) * np.exp(-Td * s)
    assert np.allclose(model().response(1, w), wanted)
    assert model().continuous().delays == pytest.approx((0.8, 1.0))
    assert model().ratio(0).delay == pytest.approx(1.6)


def test_it_survives_its_file() -> None:
    again = model_from_dict(model().to_dict())
    u = np.random.default_rng(0).normal(size=(40, 2))
    assert isinstance(again, FittedProcess)
    assert again.parameters == model().parameters
    assert np.array_equal(again.simulate(u), model().simulate(u))


def test_parameters_have_names_and_units() -> None:
    assert list(model().parameters) == ["K(a)", "Tp1(a)", "Td(a)", "K(b)", "Tw(b)", "zeta(b)", "Tz(b)", "Td(b)"]
    assert [model().unit_of(name, 1) for name in ("K", "Tw", "zeta")] == ["m/A", "s", "1"]
    assert model(("P1DI",), (0.0,)).unit_of("K", 0) == "m/V/s"


@pytest.mark.parametrize("known", [False, True], ids=["at rest", "behind known samples"])
def test_moves_are_those_of_differences(known: bool) -> None:
    u = np.repeat(np.random.default_rng(0).normal(size=20), 6)[:, np.newaxis]
    own, h = model(("P1D",), (0.0,)), 1e-5
    history = History.at_rest(inputs=u[0], output=5.0)
    found = own.output_moves(np.eye(4), u, history)
    for i in range(3):
        moved = []
        for sign in (1.0, -1.0):
            values = VALUES[0] + sign * h * np.eye(3)[i]
            moved.append(run(own.process.types[0], values, u[:, 0], u[0, 0], T).output)
        assert np.allclose(found[:, i], (moved[0] - moved[1]) / (2 * h), atol=1e-6)
    assert (found[:, 3] == 1.0).all()
    if known:
        held, earlier = np.repeat(u[:1], 6, axis=0), History(inputs=u[:6], output=np.full(6, 5.0))
        assert np.abs(own.output_moves(np.eye(4), held, earlier)[:, 0]).max() < 1e-9
