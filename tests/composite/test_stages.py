"""Stages as functions: members that come to read more are, at first, what they were."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.composite.members import assembled, whole_score
from sysid.composite.stages import choose_together, reading_more
from sysid.errors import ConfigError
from sysid.models import Cascade, NARXModel
from sysid.traces import Trace
from tests.composite.composites import models, pipe, trace
from tests.models.cascades.cascades import network


def whole() -> Cascade:
    """Two members, each with lags 0, 1 and 3 of its input, 1 and 2 of its output, and one that is a sum."""
    valve = replace(network("BP -> AR", seed=2), input_units=("psi",))
    return Cascade(models=(network("STP -> BP", seed=1), valve))


def member(cascade: Cascade, output: str) -> NARXModel:
    model = cascade.member(output)
    assert isinstance(model, NARXModel)
    return model


def command() -> np.ndarray:
    return np.random.default_rng(3).uniform(60.0, 90.0, (300, 1))


@pytest.mark.parametrize(
    ("reads", "inputs", "delays", "own"),
    [
        pytest.param({"AR": (4, 9)}, ("BP",), ((0, 1, 3),), (1, 2, 4, 9), id="its own output"),
        pytest.param({"BP": (7,)}, ("BP",), ((0, 1, 3, 7),), (1, 2), id="a channel that it reads"),
        pytest.param({"BP": (2,), "AR": (3,)}, ("BP",), ((0, 1, 2, 3),), (1, 2, 3), id="both, in between"),
    ],
)
def test_a_member_that_reads_further_back_begins_as_it_was(reads, inputs, delays, own):
    before = whole()
    after = reading_more(before, {"AR": reads})
    found = member(after, "AR")
    assert found.mapping.inputs == inputs
    assert (found.recursion.lags.inputs, found.recursion.lags.output) == (delays, own)
    assert found.n_parameters > member(before, "AR").n_parameters
    assert_allclose(after.simulate(command()).values, before.simulate(command()).values, rtol=0.0, atol=1e-9)


def test_what_it_reads_anew_and_what_it_reads_further_back_may_come_together():
    before = whole()
    after = reading_more(before, {"BP": {"BP": (8,), "AR": (1,)}})
    found = member(after, "BP")
    assert found.mapping.inputs == ("STP", "AR")
    assert (found.recursion.lags.inputs, found.recursion.lags.output) == (((0, 1, 3), (1,)), (1, 2, 8))
    assert_allclose(after.simulate(command()).values, before.simulate(command()).values, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("reads", "said"),
    [
        pytest.param({"AR": {"AR": (2, 4)}}, "got: +AR 2$", id="its own lag"),
        pytest.param({"AR": {"BP": (5, 3)}}, "got: +BP 3$", id="a lag of a channel"),
    ],
)
def test_lags_that_it_reads_already_are_named(reads, said):
    with pytest.raises(ConfigError, match=f"(?sm)reads some of these lags already.*{said}"):
        reading_more(whole(), reads)


def test_the_whole_chooses_the_candidate_that_it_does_best_with():
    good, whole = models(), assembled(pipe(), models())
    run = whole.simulate_trace(trace())
    names = trace().channel_names
    values = np.column_stack([run[name] for name in names])
    truth = Trace(name="truth", sample_time=0.1, channels=trace().channels, values=values)
    candidates = {name: [network("STP -> BP", seed=9), good[name]] if name == "BP" else [good[name]] for name in good}
    choice = choose_together(pipe(), candidates, dict.fromkeys(good, 0), [truth], outputs=("BP", "AR"))
    assert choice.members == {"BP": 1, "BP9": 0, "AR": 0}
    assert choice.score == whole_score(whole, [truth], ("BP", "AR"))
