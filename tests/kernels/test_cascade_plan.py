"""How a cascade is laid out: levels of members, and bounds and limits as one."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from sysid.kernels.cascade_layout import FREE, HIGH, LOW, SUM_HEAD, Layout, Program
from sysid.kernels.cascade_plan import Plan
from sysid.kernels.held_sums import bounded, limited
from sysid.models.cascade_stages import CompiledStage
from tests.models.cascades import CASCADES, command

NUMBERS = st.integers(-3, 3).map(float)
PAIRS = st.tuples(NUMBERS, NUMBERS).map(sorted)


def laid_out(one: Program) -> Layout:
    return Plan.of(one).laid_out(one.theta)


def program(name: str) -> Program:
    (stage,) = CASCADES[name].stages
    assert isinstance(stage, CompiledStage)
    return stage.program


def test_members_that_do_not_read_each_other_at_the_same_sample_are_of_one_level():
    layout = laid_out(program("the emergency reservoir too"))  # STP -> BP, BP -> ER, BP+ER -> AR, BP+AR+ER -> BC
    assert_array_equal(layout.level_first_y, [0, 2, 3, 4])  # ER reads the pipe of two samples ago
    assert_array_equal(layout.neurons_first, [0, 8 + 16, 32, 40])

    circle = laid_out(program("a circle through the past"))  # the pipe reads what is behind it a sample later
    assert_array_equal(circle.level_first_y, [0, 1, 2, 3])


def test_a_sum_runs_behind_what_it_reads_and_begins_no_level():
    layout = laid_out(program("a linear member"))  # STP -> BP, BP -> AR without neurons, BP+AR -> BC
    assert_array_equal(layout.network_first, [0, 1, 2])
    assert_array_equal(layout.sums.first, [0, 1, 1])
    assert_array_equal(layout.level_first_y, [0, 1, 2])


def test_what_a_limit_is_made_of_comes_before_it():
    layout = laid_out(program("a limit made of what it limits, a sample ago"))  # BP, x = AR a sample ago, AR, BC
    assert_array_equal(layout.order_y, [0, 2, 3])
    assert_array_equal(layout.level_first_y, [0, 1, 2, 3])
    assert_array_equal(layout.sums.first, [0, 1, 1, 1])
    assert_array_equal(layout.fixed, [True, True, False, True])


def test_a_sum_between_two_numbers_stands_with_its_terms_side_by_side():
    one = program("a limit made of what it limits, a sample ago")
    layout = laid_out(one)

    terms = int(layout.sums.indices[0])
    member, (constant, low, high) = layout.member[1], layout.sums.numbers[:SUM_HEAD]
    first = one.regressor_first[member]
    assert_array_equal(layout.sums.indices[1:], [one.output_channel[1], 1, *range(first, first + terms)])
    assert constant == layout.theta[layout.constant[1]]
    assert [low, high] == layout.fixed_limits[1].tolist()
    assert_array_equal(layout.sums.numbers[SUM_HEAD:], layout.theta[layout.linear_first[1] :][:terms])
    assert_array_equal(layout.sums.codes, layout.fixed_codes[[1]])


@given(PAIRS, PAIRS, st.floats(-4.0, 4.0))
def test_bounds_and_limits_at_once_are_first_the_one_and_then_the_other(bounds, limits, value):
    one = program("three networks")
    n = len(one.output_channel)
    layout = laid_out(
        one._replace(
            bounds=np.tile(np.array(bounds), (n, 1)),
            limits=np.tile(np.array(limits), (n, 1)),
            output_offset=np.zeros(n),
            output_scale=np.ones(n),
        )
    )
    held, code = bounded(value, *bounds)
    expected = limited(held, code, *limits, LOW, HIGH)
    assert layout.fixed[0] == (max(bounds[0], limits[0]) <= min(bounds[1], limits[1]))
    if layout.fixed[0]:
        assert limited(value, FREE, *layout.fixed_limits[0], *layout.fixed_codes[0]) == expected


def test_a_plan_lays_out_other_parameters_and_leaves_former_layouts_as_they_were():
    one = program("gates")
    plan, other = Plan.of(one), one.theta[::-1].copy()
    before, after = plan.laid_out(one.theta), plan.laid_out(other)
    for name, expected in laid_out(one._replace(theta=other))._asdict().items():
        if name != "sums":
            assert_array_equal(getattr(after, name), expected)
    assert_array_equal(before.weights, laid_out(one).weights)
    assert (before.weights != after.weights).any()


def test_runs_in_several_threads_share_a_layout():
    """Gates write their readouts anew at every sample: each run has its own."""
    cascade = CASCADES["gates"]
    inputs = [command(400, len(cascade.inputs), seed) for seed in range(8)]
    expected = [cascade.simulate(one).values for one in inputs]
    with ThreadPoolExecutor(4) as pool:
        for found, alone in zip(pool.map(lambda one: cascade.simulate(one).values, inputs), expected, strict=True):
            assert_array_equal(found, alone)
