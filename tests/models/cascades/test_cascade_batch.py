"""Many records at once: in lockstep, one by one, or a cascade for each."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.errors import ConfigError
from sysid.models import (
    Cascade,
    simulate_family,
)
from sysid.models.cascades.cascade_batch import lockstep_pays, run_in_lockstep
from tests.models.cascades.cascades import CASCADES, command, lag, network, service

MANY = 43
"""Records of two groups, and no multiple of the lanes."""


def check_records(cascade, inputs, batch):
    assert batch["BC"].shape == inputs.shape[:2]
    for i, one in enumerate(inputs):
        alone = cascade.simulate(one)
        assert_allclose(batch.values[i], alone.values, rtol=0.0, atol=1e-10)
        assert_array_equal(batch.held[i], alone.held)


@pytest.mark.parametrize("name", CASCADES)
def test_records_in_lockstep_are_the_records_one_by_one(name):
    # Two groups, whose last lanes have no record of their own; several chunks of samples.
    cascade = CASCADES[name]
    inputs = np.stack([command(300, len(cascade.inputs), seed) for seed in range(MANY)])
    batch = run_in_lockstep(cascade, cascade.stages[0], inputs, None, workers=2)
    check_records(cascade, inputs, batch)
    if cascade.limits:
        assert np.count_nonzero(batch.held) > 100


@pytest.mark.parametrize("n", [1, 5, 20, 43, 64])
def test_many_records_are_the_records_one_by_one(n):
    cascade, inputs = CASCADES["limits"], np.stack([command(seed=seed) for seed in range(n)])
    check_records(cascade, inputs, cascade.simulate_batch(inputs, workers=1))


@pytest.mark.parametrize(
    ("neurons", "members", "records", "pays"),
    [(0, 3, 32, False), (4, 1, 32, True), (4, 1, 10, False), (8, 3, 25, False), (40, 3, 32, False), (8, 4, 32, False)],
)
def test_lockstep_is_for_few_small_networks_whose_records_fill_the_registers(neurons, members, records, pays):
    """As measured: others run one by one, to the last digit."""
    chain = pairwise(("STP", "BP", "AR", "ER", "BC")[: members + 1])
    models = tuple(network(f"{a} -> {b}", neurons=neurons, seed=1) for a, b in chain)
    cascade = Cascade(models=models)
    assert lockstep_pays(cascade.stages[0].program, records) is pays
    if not pays:
        inputs = np.stack([command(seed=seed) for seed in range(records)])
        batch = cascade.simulate_batch(inputs, workers=1)
        assert_array_equal(batch.values[-1], cascade.simulate(inputs[-1]).values)


def test_many_records_of_a_model_with_a_state_of_its_own():
    cascade = Cascade(models=(lag("STP -> BP"), network("BP -> BC", seed=3)))
    inputs = np.stack([command(seed=seed) for seed in range(MANY)])
    check_records(cascade, inputs, cascade.simulate_batch(inputs))


def test_a_value_that_is_not_a_number_stays_in_its_record():
    cascade = service()
    inputs = np.stack([command(seed=seed) for seed in range(MANY)])
    inputs[3, 50:] = np.nan
    for batch in (cascade.simulate_batch(inputs), run_in_lockstep(cascade, cascade.stages[0], inputs, None, workers=2)):
        assert np.isnan(batch["BC"][3, 60:]).all()
        assert np.isfinite(np.delete(batch["BC"], 3, axis=0)).all()


def test_a_family_has_a_cascade_for_each_record():
    family = [service().with_member(network("BP -> AR", seed=seed)) for seed in range(3)]
    inputs = np.stack([command(seed=seed) for seed in range(3)])
    run = simulate_family(family, inputs, workers=1)
    for i, cascade in enumerate(family):
        assert_array_equal(run.values[i], cascade.simulate(inputs[i]).values)
    with pytest.raises(ConfigError, match="2 cascades"):
        simulate_family(family[:2], inputs)
