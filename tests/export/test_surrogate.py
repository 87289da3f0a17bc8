"""Models as stages: what is wired to what, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.export import Flag, Surrogate, expected_flags
from sysid.models import ARX, NARX, ARXModel, Cascade, Mapping


def linear(mapping, **changes):
    parsed = Mapping.parse(mapping)
    n_inputs = len(parsed.inputs)
    model = ARXModel(
        orders=ARX(na=1, nb=(1,) * n_inputs, nk=(0,) * n_inputs),
        coefficients=np.array([1.0] * n_inputs + [0.5]),
        intercept=0.0,
        mapping=parsed,
        sample_time=0.1,
        input_units=("psi",) * n_inputs,
        output_unit="psi",
        rest_output=0.0,
    )
    return replace(model, **changes)


def test_inputs_are_what_no_stage_computes(cascade):
    assert [port.name for port in cascade.inputs] == ["STP", "FLOW"]
    assert [port.name for port in cascade.outputs] == ["BP", "AR", "BC"]
    assert cascade.mapping == "STP+FLOW -> BP, AR, BC"
    assert [port.range for port in cascade.inputs] == [(0.0, 80.0), None]


def test_stages_read_inputs_and_earlier_outputs(cascade):
    assert [stage.sources for stage in cascade.stages] == [(0, 1), (2,), (2, 3, 0)]


def test_states_lie_end_to_end(cascade):
    lines = cascade.lines
    assert [line.first for line in lines] == [0, *np.cumsum([line.length for line in lines])[:-1]]
    assert cascade.state_size == sum(line.length for line in lines)
    assert cascade.at_rest(np.array([10.0, 20.0])).shape == (cascade.state_size,)


def test_cascade_is_its_models_one_after_the_other():
    first, second = linear("STP -> BP"), linear("BP+STP -> BC")
    u = np.arange(5.0)[:, np.newaxis]
    bp = first.simulate(u)
    bc = second.simulate(np.column_stack([bp, u[:, 0]]))
    np.testing.assert_array_equal(Surrogate.of(Cascade(models=(second, first))).simulate(u), np.column_stack([bp, bc]))


def test_stages_run_in_an_order_in_which_they_can():
    first, second = linear("STP -> BP"), linear("BP+STP -> BC")
    surrogate = Surrogate.of(Cascade(models=(second, first)))
    assert [stage.model for stage in surrogate.stages] == [first, second]


def test_in_a_circle_what_is_computed_late_goes_into_the_state_at_the_end():
    back = linear("u+z -> y", orders=ARX(na=1, nb=(1, 1), nk=(0, 1)))
    surrogate = Surrogate.of(Cascade(models=(back, linear("y -> z"))))
    first, second = surrogate.stages
    assert [port.name for port in surrogate.channels] == ["u", "y", "z"]
    assert (first.sources, first.known_sources, second.known_sources) == ((0, 2), (0, 0), (1,))
    assert [(late.place, late.column) for late in surrogate.late] == [(0, 2)]
    assert surrogate.lines[1].channel == "z"
    assert surrogate.lines[1].first == 0


def test_what_nothing_goes_into_has_an_input_that_says_how_long_to_run():
    back = linear("z -> tick", orders=ARX(na=1, nb=(1,), nk=(1,)))
    cascade = Cascade(models=(linear("tick -> z"), back), rest={"tick": 3.0, "z": 1.0})
    surrogate = Surrogate.of(cascade)
    assert surrogate.ticks
    assert [port.name for port in surrogate.inputs] == ["tick_"]
    run = cascade.simulate(np.zeros((9, 0)))
    found = surrogate.simulate(np.full((9, 1), np.nan))
    np.testing.assert_array_equal(found, np.column_stack([run[port.name] for port in surrogate.outputs]))


@pytest.mark.parametrize(
    ("models", "match"),
    [
        pytest.param([], "there is no model", id="none"),
        pytest.param(["u -> y", "v -> y"], "y is computed twice", id="two models of one channel"),
        pytest.param(["y -> z", "z -> y"], "a circle: (y needs z, z needs y|z needs y, y needs z)", id="loop"),
        pytest.param(["u -> y", {"mapping": "y -> z", "sample_time": 0.2}], "sample times differ", id="sample times"),
        pytest.param(["u -> y", {"mapping": "y -> z", "input_units": ("kPa",)}], "y is in psi and in kPa", id="units"),
    ],
)
def test_wiring_that_cannot_run_is_refused(models, match):
    built = [
        linear(m) if isinstance(m, str) else linear(m["mapping"], **{k: m[k] for k in m if k != "mapping"})
        for m in models
    ]
    with pytest.raises(ConfigError, match=match):
        Surrogate.of(Cascade(models=tuple(built)))


@pytest.mark.parametrize(
    ("mapping", "identifier"),
    [
        ("BP+AR -> BC", "bp_ar_to_bc"),
        ("p in [1]+Δp -> 2nd", "p_in_1_p_to_c2nd"),
        ("a b+a-b -> a_b", "a_b_a_b_2_to_a_b_3"),
        ("日 -> 本", "channel_to_channel_2"),
    ],
)
def test_identifiers_are_c_names_and_all_different(mapping, identifier):
    surrogate = Surrogate.of(linear(mapping))
    assert surrogate.identifier == identifier
    names = [port.identifier for port in (*surrogate.inputs, *surrogate.outputs)]
    assert len(set(names)) == len(names)
    assert all(name.isascii() and name.isidentifier() for name in names)


def test_the_identifier_of_many_outputs_is_short_enough_to_name_a_file_and_differs_with_the_last_of_them():
    def identifier(last):
        names = [f"CH{i:03}" for i in range(99)] + [last]
        return Surrogate.of(Cascade(models=tuple(linear(f"STP -> {name}") for name in names))).identifier

    one, other = identifier("A"), identifier("B")
    assert len(one) < 80
    assert one.startswith("stp_to_ch000_ch001_")
    assert one.isidentifier()
    assert one != other


def test_what_comes_out_may_be_some_of_what_is_computed(limited):
    whole, some = Surrogate.of(limited), Surrogate.of(limited, outputs=["BC", "AR"])
    u = np.random.default_rng(2).uniform(20.0, 80.0, (50, 2))
    assert [port.name for port in some.outputs] == ["BC", "AR"]
    assert [some.channels[column].name for column in some.columns] == ["BC", "AR"]
    assert (some.mapping, some.identifier) == ("STP+FLOW -> BC, AR", "stp_flow_to_bc_ar")
    assert (whole.selects, some.selects) == (False, True)
    assert (some.computed, some.state_size) == (whole.computed, whole.state_size)
    places = [whole.outputs.index(port) for port in some.outputs]
    np.testing.assert_array_equal(some.simulate(u), whole.simulate(u)[:, places])


def test_where_some_outputs_begin_elsewhere_the_others_stand_at_their_levels(limited):
    whole, some = Surrogate.of(limited), Surrogate.of(limited, outputs=["BC", "AR"])
    u = np.full((50, 2), 60.0)
    rest = whole.rest(u[0])
    rest[[whole.outputs.index(port) for port in some.outputs]] = [37.7, 20.0]
    np.testing.assert_array_equal(some.rest(u[0], np.array([37.7, 20.0])), rest)
    assert not np.array_equal(some.rest(u[0]), rest)
    np.testing.assert_array_equal(some.simulate(u, np.array([37.7, 20.0])), some.chosen(whole.compute(u, rest)))


def test_nobody_is_told_of_the_limits_of_what_does_not_come_out(limited):
    u = np.random.default_rng(2).uniform(20.0, 80.0, (200, 2))
    found = {}
    for outputs in (None, ["BC"], ["X"]):
        surrogate = Surrogate.of(limited, outputs=outputs)
        found[str(outputs)] = expected_flags(surrogate, u, surrogate.compute(u)) & Flag.AT_LIMIT
    whole, *parts = found.values()
    assert all(((part & whole) == part).all() and 0 < (part > 0).sum() < (whole > 0).sum() for part in parts)


@pytest.mark.parametrize("outputs", [["BC", "nothing"], ["BC", "BC"], []])
def test_outputs_that_are_not_computed_are_named(limited, outputs):
    with pytest.raises(ConfigError, match="cannot be the outputs"):
        Surrogate.of(limited, outputs=outputs)


def test_state_of_a_single_model_is_the_models_own(narx, declared):
    surrogate = declared(narx(NARX(input_delays=2, output_delays=3, neurons=1)))
    assert surrogate.state_text() == {**surrogate.stages[0].state.to_dict(), "remainders_float32": 1}


def test_at_rest_every_channel_stands_at_its_declared_level(limited):
    surrogate = Surrogate.of(limited)
    levels = dict(
        zip((port.name for port in surrogate.channels), surrogate.levels(np.array([70.0, 20.0])), strict=True)
    )
    assert (levels["STP"], levels["FLOW"], levels["BP"], levels["AR"], levels["ER"]) == (70.0, 10.0, 70.0, 70.0, 60.0)
    u = np.tile([70.0, 20.0], (30, 1))
    np.testing.assert_array_equal(surrogate.simulate(u), limited.simulate(u).values[:, 2:])


def test_a_cascade_lies_in_its_own_order(limited):
    surrogate = Surrogate.of(limited)
    assert tuple(port.name for port in surrogate.outputs) == limited.outputs
    assert [stage.targets for stage in surrogate.stages] == [(2,), (3, 4), (5, 6), (7,), (8,)]
    assert surrogate.state_length("float32") - surrogate.state_size == surrogate.remainders
    assert [stage.remainders for stage in surrogate.stages] == [1, 2, 0, 1, surrogate.stages[-1].state.size]
