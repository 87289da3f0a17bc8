"""How a cascade is laid out: levels of members, and bounds and limits as one."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from sysid.kernels import cascade as kernel
from sysid.kernels import cascade_layout as layout
from sysid.kernels.cascade_layout import FREE, HIGH, LOST, LOW, SUM_HEAD, Program
from sysid.kernels.cascade_plan import Plan
from sysid.kernels.held_sums import bounded, limited
from sysid.models.cascades.cascade_stages import CompiledStage
from tests.models.cascades.cascades import CASCADES, command

NUMBERS = st.integers(-3, 3).map(float)
PAIRS = st.tuples(NUMBERS, NUMBERS).map(sorted)


def program(name: str) -> Program:
    (stage,) = CASCADES[name].stages
    assert isinstance(stage, CompiledStage)
    return stage.program


def of_outputs(plan: Plan, column: np.uintp) -> np.ndarray:
    return plan.part(layout.OUTPUTS).reshape(-1, int(layout.OUTPUT_ROW))[:, int(column)]


def test_members_that_do_not_read_each_other_at_the_same_sample_are_of_one_level():
    plan = Plan.of(program("the emergency reservoir too"))  # STP -> BP, BP -> ER, BP+ER -> AR, BP+AR+ER -> BC
    assert_array_equal(plan.part(layout.OUTPUT_FIRST), [0, 2, 3, 4])  # ER reads the pipe of two samples ago
    assert_array_equal(plan.part(layout.NEURONS_FIRST), [0, 8 + 16, 32, 40])

    circle = Plan.of(program("a circle through the past"))  # the pipe reads what is behind it a sample later
    assert_array_equal(circle.part(layout.OUTPUT_FIRST), [0, 1, 2, 3])


def test_a_sum_runs_behind_what_it_reads_and_begins_no_level():
    plan = Plan.of(program("a linear member"))  # STP -> BP, BP -> AR without neurons, BP+AR -> BC
    assert_array_equal(plan.part(layout.NETWORK_FIRST), [0, 1, 2])
    assert_array_equal(plan.part(layout.SUM_FIRST), [0, 1, 1])
    assert_array_equal(plan.part(layout.OUTPUT_FIRST), [0, 1, 2])


def test_what_a_limit_is_made_of_comes_before_it():
    plan = Plan.of(program("a limit made of what it limits, a sample ago"))  # BP, x = AR a sample ago, AR, BC
    assert_array_equal(of_outputs(plan, layout.POSITION), [0, 2, 3])
    assert_array_equal(of_outputs(plan, layout.FIXED), [True, False, True])
    assert_array_equal(plan.part(layout.OUTPUT_FIRST), [0, 1, 2, 3])
    assert_array_equal(plan.part(layout.SUM_FIRST), [0, 1, 1, 1])


def test_a_sum_between_two_numbers_stands_with_its_terms_side_by_side():
    one = program("a limit made of what it limits, a sample ago")
    plan = Plan.of(one)

    indices, numbers = plan.part(layout.SUM_INDICES), plan.part(layout.SUM_NUMBERS)
    first, terms = int(one.regressor_first[1]), int(indices[0])
    assert_array_equal(indices[1:], [one.output_channel[1], 1, *range(first, first + terms)])
    assert_array_equal(numbers[1:], [*one.limits[1], *[0.0] * terms])
    assert_array_equal(plan.part(layout.SUM_CODES), [LOST, LOST])  # nothing holds it: neither is ever said
    to, of = plan.part(layout.TERMS).reshape(-1, 2).T
    assert_array_equal(to, [0, *range(SUM_HEAD, SUM_HEAD + terms)])
    assert_array_equal(of, one.theta_first[1] + np.arange(1 + terms))


@given(PAIRS, PAIRS, st.floats(-4.0, 4.0))
def test_bounds_and_limits_at_once_are_first_the_one_and_then_the_other(bounds, limits, value):
    one = program("three networks")
    n = len(one.output_channel)
    plan = Plan.of(
        one._replace(
            bounds=np.tile(np.array(bounds), (n, 1)),
            limits=np.tile(np.array(limits), (n, 1)),
            output_offset=np.zeros(n),
            output_scale=np.ones(n),
        )
    )
    held, code = bounded(value, *bounds)
    expected = limited(held, code, *limits, LOW, HIGH)
    hold, own = plan.part(layout.HOLDS)[:4], plan.part(layout.OUTPUTS).astype(np.int64)
    codes = own[int(layout.LOW_CODE)], own[int(layout.HIGH_CODE)]
    fixed = max(bounds[0], limits[0]) <= min(bounds[1], limits[1])
    assert bool(own[int(layout.FIXED)]) == fixed
    before = (value, FREE) if fixed else bounded(value, *hold[2:])
    assert limited(*before, *hold[:2], *codes) == expected


def test_parameters_act_between_units_as_the_members_do_in_their_own_numbers():
    one = program("gates")
    found = kernel.acting(*Plan.of(one), one.numbers)
    rng, n_x = np.random.default_rng(0), int(one.regressor_first[1])
    size, n = slice(0, n_x), int(one.neurons[0])
    values = rng.uniform(0.0, 90.0, n_x)
    x = (values - one.regressor_offset[size]) / one.regressor_scale[size]
    sums = one.theta[: n * n_x].reshape(n, n_x) @ x + one.theta[n * n_x :][:n]
    np.testing.assert_allclose(found[: n * n_x].reshape(n, n_x) @ values + found[n * n_x :][:n], sums, atol=1e-12)
    linear = int(one.theta_first[0]) + n * (n_x + 2)
    alone = one.output_scale[0] * (one.theta[linear] + one.theta[linear + 1 :][:n_x] @ x) + one.output_offset[0]
    np.testing.assert_allclose(found[linear] + found[linear + 1 :][:n_x] @ values, alone, rtol=1e-12)


def test_runs_in_several_threads_share_a_layout():
    """Gates write their readouts anew at every sample: each run has its own."""
    cascade = CASCADES["gates"]
    inputs = [command(400, len(cascade.inputs), seed) for seed in range(8)]
    expected = [cascade.simulate(one).values for one in inputs]
    with ThreadPoolExecutor(4) as pool:
        for found, alone in zip(pool.map(lambda one: cascade.simulate(one).values, inputs), expected, strict=True):
            assert_array_equal(found, alone)
