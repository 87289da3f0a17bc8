"""Lines: a field modelled at knots, interpolated between them, and the same cascade at every position."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

from sysid.composite import committee
from sysid.errors import ChannelError, ConfigError
from sysid.models import Cascade, Interpolation, Limit, Mapping
from sysid.traces import Channel, Trace
from tests.models.cascades.cascades import network

KNOTS = {"BP": 1.0, "BP10": 10.0, "BP25": 25.0, "BP50": 50.0}


def along() -> Cascade:
    """The pipe at four knots."""
    models = [
        replace(network("STP -> BP", seed=i), mapping=Mapping(inputs=("STP",), output=name))
        for i, name in enumerate(KNOTS)
    ]
    return Cascade(models=tuple(models))


def valve(text: str = "BP -> AR") -> Cascade:
    """A reservoir and a cylinder behind the pipe."""
    models = (network(text, seed=7), network("BP+AR -> BC", seed=8))
    return Cascade(models=models, limits={"BC": Limit(low=0.0)})


def line() -> Interpolation:
    return Interpolation(along=along(), knots=KNOTS, at_place=valve(), channel="BP")


def handle(n: int = 200) -> np.ndarray:
    return np.repeat(np.random.default_rng(0).uniform(64.0, 90.0, n // 20), 20)[:, None]


def test_at_a_knot_the_line_is_what_its_cascades_are():
    run, alone = line().simulate(handle(), list(KNOTS.values())), along().simulate(handle())
    for position, name in enumerate(KNOTS):
        assert_allclose(run["BP"][position], alone[name], atol=1e-10)
        assert_allclose(run["BC"][position], valve().simulate(alone[name][:, None])["BC"], atol=1e-9)


def test_between_knots_the_field_is_the_cubic_spline_through_them():
    positions, alone = [3.0, 17.5, 49.0], along().simulate(handle())
    spline = CubicSpline(list(KNOTS.values()), np.stack([alone[name] for name in KNOTS]))
    run = line().simulate(handle(), positions)
    assert_allclose(run["BP"], spline(positions), atol=1e-10)
    assert_allclose(run["BC"][1], valve().simulate(spline(17.5)[:, None])["BC"], atol=1e-9)


def test_a_front_that_runs_along_the_line_arrives_at_each_position_at_its_own_time():
    """One shape at every knot, two samples later from each position to the next: it is the same at all of them."""
    shape = network("STP -> BP", seed=3)
    delayed = [
        replace(
            shape,
            network=replace(shape.network, input_delays=((2 * k, 2 * k + 1, 2 * k + 3),)),
            mapping=Mapping(inputs=("STP",), output=name),
        )
        for k, name in enumerate(("BP", "BP1", "BP2", "BP3"))
    ]
    assert delayed[0].recursion.lags.inputs == ((0, 1, 3),)
    knots = {"BP": 0.0, "BP1": 1.0, "BP2": 2.0, "BP3": 3.0}
    smeared = Interpolation(along=Cascade(models=tuple(delayed)), knots=knots, at_place=valve(), channel="BP")
    running = replace(smeared, delay=2 * smeared.sample_time)
    command, first = np.repeat([90.0, 70.0, 90.0], [140, 60, 60])[:, None], delayed[0]
    here = Cascade(models=(first,)).simulate(command)["BP"]
    for position in (0.5, 1.5, 3.0):
        steps = int(2 * position)
        expected = np.concatenate([np.full(steps, here[0]), here[:-steps]])
        errors = [
            np.abs(one.simulate(command, [position])["BP"][0] - expected)[139:250].max() for one in (running, smeared)
        ]
        assert errors[0] < 1e-9
        assert errors[1] > 0.1 or position == 3.0
    again = Interpolation.from_dict(running.to_dict())
    assert_allclose(again.simulate(command, [1.5])["BC"], running.simulate(command, [1.5])["BC"], rtol=0, atol=0)


def test_a_front_does_not_run_backwards():
    with pytest.raises(ConfigError, match="no front runs so"):
        replace(line(), delay=-0.1)


def test_a_straight_field_is_kept_straight_and_rows_of_weights_add_up_to_one():
    positions = np.linspace(1.0, 50.0, 99)
    weights = line().weights(positions)
    assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    assert_allclose(weights @ np.array(list(KNOTS.values())), positions, atol=1e-12)


def test_many_positions_run_in_lockstep_as_few_do_alone():
    positions = np.linspace(1.0, 50.0, 40)
    many = line().simulate(handle(), positions, workers=1)
    for i in (0, 13, 39):
        assert_allclose(many["BC"][i], line().simulate(handle(), [positions[i]])["BC"][0], atol=1e-9)


def test_what_stands_at_a_position_may_read_an_input_of_the_whole():
    reads = Interpolation(along=along(), knots=KNOTS, at_place=valve("BP+STP -> AR"), channel="BP")
    alone = along().simulate(handle())
    expected = valve("BP+STP -> AR").simulate(np.column_stack([alone["BP25"], handle()]))
    assert_allclose(reads.simulate(handle(), [25.0])["BC"][0], expected["BC"], atol=1e-9)


def test_a_trace_of_another_sample_time_is_refused():
    channel = (Channel(name="STP", unit="psi"),)
    same = Trace(name="T", sample_time=0.1, channels=channel, values=handle())
    assert_allclose(line().simulate_trace(same, [5.0])["BC"], line().simulate(handle(), [5.0])["BC"])
    with pytest.raises(ConfigError, match="another sample time"):
        line().simulate_trace(Trace(name="T", sample_time=0.2, channels=channel, values=handle()), [5.0])
    with pytest.raises(ConfigError, match="in another unit"):
        line().simulate_trace(replace(same, channels=(Channel(name="STP", unit="kPa"),)), [5.0])


def test_it_is_stored_and_read_again():
    again = Interpolation.from_dict(line().to_dict())
    assert again.outputs == line().outputs == ("BP", "AR", "BC")
    assert again.n_parameters == line().n_parameters
    assert_allclose(again.simulate(handle(), [7.0])["BC"], line().simulate(handle(), [7.0])["BC"], rtol=0, atol=0)
    earlier = line().to_dict() | {"structure": {"kind": "Line"}}
    assert Interpolation.from_dict(earlier).knots == line().knots
    with pytest.raises(ConfigError, match="not a stored line"):
        Interpolation.from_dict(along().to_dict())


def mean_of_two() -> Interpolation:
    """Two lines whose pipes and cylinders differ; the second names its inner channel otherwise."""
    models = [
        replace(network("STP -> BP", seed=20 + i), mapping=Mapping(inputs=("STP",), output=name))
        for i, name in enumerate(KNOTS)
    ]
    there = Cascade(models=(network("BP -> ER", seed=9), network("BP+ER -> BC", seed=10)))
    second = Interpolation(along=Cascade(models=tuple(models)), knots=KNOTS, at_place=there, channel="BP")
    return replace(line(), beside=(second,), spread=("BC",))


def test_the_mean_of_lines_is_that_of_what_each_has_behind_its_own_field():
    mean, positions = mean_of_two(), [1.0, 17.5, 50.0]
    run = mean.simulate(handle(), positions)
    parts = [one.simulate(handle(), positions) for one in (line(), *mean.beside)]
    assert mean.outputs == ("BP", "BC", "BC_spread")
    assert mean.n_parameters == line().n_parameters + mean.beside[0].n_parameters
    for name in ("BP", "BC"):
        assert_allclose(run[name], (parts[0][name] + parts[1][name]) / 2.0, atol=1e-12)
    assert_allclose(run["BC_spread"], np.abs(parts[0]["BC"] - parts[1]["BC"]), atol=1e-12)
    behind_the_mean_field = [one.at_place.simulate(run["BP"][1][:, None])["BC"] for one in (line(), *mean.beside)]
    assert np.abs(run["BC"][1] - np.mean(behind_the_mean_field, axis=0)).max() > 1e-3


def test_at_a_knot_the_mean_of_lines_is_the_mean_of_the_wholes_as_a_committee_has_it():
    lines = [
        replace(one, at_place=replace(one.at_place, rest={"BP": 90.0}), beside=(), spread=())
        for one in (line(), *mean_of_two().beside)
    ]
    mean = replace(lines[0], beside=(lines[1],), spread=("BC",))
    wholes = [Cascade(models=(*one.along.models, *one.at_place.models), limits=one.at_place.limits) for one in lines]
    answer = committee(wholes, mean=["BC", *KNOTS]).simulate(handle())
    run = mean.simulate(handle(), list(KNOTS.values()))
    assert_allclose(run["BC"][0], answer["BC"], atol=1e-9)
    assert_allclose(run["BC_spread"][0], answer["BC_spread"], atol=1e-9)
    for k, knot in enumerate(KNOTS):
        assert_allclose(run["BP"][k], answer[knot], atol=1e-9)


def test_the_mean_of_lines_is_stored_and_tells_what_held_any_of_them():
    mean = mean_of_two()
    again = Interpolation.from_dict(json.loads(json.dumps(mean.to_dict())))
    run, other = mean.simulate(handle(), [7.0]), again.simulate(handle(), [7.0])
    assert again.outputs == mean.outputs
    assert_allclose(other.values, run.values, rtol=0, atol=0)
    assert run.activity["BC"].low == line().simulate(handle(), [7.0]).activity["BC"].low > 0
    assert run.units["BC_spread"] == "psi"


def test_lines_of_other_questions_are_not_averaged():
    other = replace(line(), knots={"BP": 1.0, "BP10": 11.0, "BP25": 25.0, "BP50": 50.0})
    with pytest.raises(ConfigError, match="do not answer the same question"):
        replace(line(), beside=(other,))
    with pytest.raises(ChannelError, match="spread of the line"):
        replace(line(), beside=(line(),), spread=("ER",))
    with pytest.raises(ChannelError, match="spread of the line"):
        replace(line(), spread=("BC",))


@pytest.mark.parametrize("positions", [[0.0], [51.0], [np.nan], [], [5.0, 60.0]], ids=str)
def test_no_position_beyond_the_outer_knots(positions):
    with pytest.raises(ConfigError, match="no such position"):
        line().simulate(handle(), positions)


@pytest.mark.parametrize(
    ("changes", "error", "match"),
    [
        pytest.param({"knots": {"BP": 1.0}}, ConfigError, "no line", id="one knot"),
        pytest.param({"knots": {"BP": 2.0, "BP10": 1.0}}, ConfigError, "no line", id="knots out of order"),
        pytest.param({"knots": {"BP": 1.0, "BP11": 2.0}}, ChannelError, "knots", id="a knot that nobody writes"),
        pytest.param(
            {"channel": "PIPE"}, ChannelError, "inputs at a position", id="a position that reads something else"
        ),
    ],
)
def test_a_line_that_cannot_be_is_refused(changes, error, match):
    with pytest.raises(error, match=match):
        replace(line(), **changes)
