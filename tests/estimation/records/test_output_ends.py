"""Ends at which an output stands, and networks that are held there."""

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.estimation import Status, Training, fit_narx
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.records.experiment import experiments_of
from sysid.estimation.records.output_ends import found_ends, told
from sysid.models import NARX, Mapping, Start
from sysid.testing import finite_difference_jacobian
from sysid.traces import Trace
from tests.traces.made import trace_of

SLIDE = Mapping.parse("u -> y")


def slide(seed: int, *, low: float = -np.inf, high: float = np.inf, pole: float = 1.0) -> Trace:
    """Moves at a rate that bends with its input, between two ends; or follows it."""
    u = np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, 40), 10)
    y, at = np.empty(400), 2.0
    for k in range(400):
        at = min(max(pole * at + 0.3 * u[k] * abs(u[k]), low), high)
        y[k] = at
    return trace_of({"u": u, "y": y}, name=f"slide {seed}", units={"u": "V", "y": "m"})


@pytest.mark.parametrize(
    ("ends", "pole", "found"),
    [
        ({"low": 0.0, "high": 4.0}, 1.0, (0.0, 4.0)),
        ({"low": 0.0}, 1.0, (0.0, None)),
        ({}, 1.0, (None, None)),
        ({}, 0.5, (None, None)),  # follows its input, and stands where that does
    ],
    ids=["both", "one", "none", "none of what follows"],
)
def test_an_end_is_where_an_output_stands_while_its_input_goes_on(ends, pole, found):
    traces = [slide(seed, pole=pole, **ends) for seed in range(6)]
    assert found_ends([(t.columns(["u"]), t["y"]) for t in traces]) == found


def test_nothing_stands_at_an_end_where_nothing_moves_or_is_measured():
    still = np.zeros((50, 1)), np.zeros(50)
    assert found_ends([still]) == found_ends([]) == found_ends([(np.zeros((0, 1)), np.zeros(0))]) == (None, None)


def test_what_meets_its_ends_is_learnt_by_a_network_that_is_held_and_not_by_one_that_runs_on():
    traces, unseen = [slide(seed, low=0.0, high=4.0) for seed in range(6)], slide(99, low=0.0, high=4.0)
    off = {}
    for limits in (None, "found"):
        network = NARX(input_delays=[0], output_delays=1, neurons=4, limits=limits)
        fit = fit_narx(traces, SLIDE, network, Training(max_iterations=60), rest_output=2.0)
        off[limits] = float(np.sqrt(np.mean((fit.model.simulate(unseen.columns(["u"])) - unseen["y"]) ** 2)))
        assert any("is held" in note for note in fit.notes) is (limits is not None)
    assert fit.model.between == (0.0, 4.0)
    assert fit.status is not Status.UNSTABLE
    assert off["found"] < 0.0025 * 4.0 < 0.1 * off[None]


def test_sensitivities_are_those_of_what_is_held():
    trace = slide(3, low=0.0, high=4.0)
    network = NARX(input_delays="0:1", output_delays=2, neurons=2, limits="found")
    model = fit_narx([trace], SLIDE, network, Training(max_iterations=3), rest_output=2.0).model
    experiments = experiments_of([trace], SLIDE, Start(), 2.0)
    provider = RecursionProvider(template=model.recursion, experiments=experiments, closed=True)
    inputs = trace.columns(["u"])

    def run(theta):
        return model.scaling.scale_output(model.with_theta(theta).simulate(inputs))

    held = np.isin(model.simulate(inputs), model.between)
    rows, numeric = provider.jacobian(model.theta), finite_difference_jacobian(run, model.theta)
    assert held.any()
    assert not rows[held].any()
    np.testing.assert_allclose(rows, numeric, atol=1e-6 * np.abs(numeric).max())


def test_ends_that_are_to_be_found_and_are_not_there_are_refused():
    network = NARX(input_delays=[0], output_delays=1, neurons=2, limits="found")
    with pytest.raises(ConfigError, match="y stands at no end") as refused:
        fit_narx([slide(0)], SLIDE, network, Training(max_iterations=2))
    assert "limits: [low, high]" in str(refused.value)


def test_a_pure_number_is_told_without_a_unit() -> None:
    assert told((-0.4, None), "y", "1") == "The free run of y is held at -0.4 from below."
