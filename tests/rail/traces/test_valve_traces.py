"""Traces of single valves: the same train, another car."""

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.ingest import find_dataset
from sysid.ingest.datasets.description import read_description
from sysid.rail.traces.valve_traces import generate
from sysid.traces import Channel, Trace
from sysid.units import Reference

PIPE = Channel(name="BP", unit="psi", reference=Reference.GAUGE)


def made(recipe: dict[str, object], options: dict[str, object]) -> Trace:
    return generate(case="a", recipe=recipe, options=options, channels=(PIPE,), sample_time=0.1)


def test_the_front_hears_of_an_application_before_the_rear() -> None:
    command = [[0, 90], [2, 64.2], [10, 64.2]]
    front, rear = (made({"command": command, "node": node}, {"pairs": 20})["BP"] for node in (3, 41))
    assert np.flatnonzero(front < 88.0)[0] < np.flatnonzero(rear < 88.0)[0]


@pytest.mark.parametrize(
    ("recipe", "options"),
    [({"command": [[0, 90], [1, 90]]}, {"pairs": 2}), ({"command": [[0, 90], [1, 90]], "node": 3}, {"node": 3})],
    ids=["no node", "a node for all"],
)
def test_every_case_names_its_valve(recipe: dict[str, object], options: dict[str, object]) -> None:
    with pytest.raises(ConfigError, match="valve is not named"):
        made(recipe, options)


def test_no_valve_that_is_scored_was_fitted_or_chosen_on() -> None:
    cases = read_description(find_dataset("abdx-valves")).cases
    nodes: dict[str, set[int]] = {}
    for case in cases.values():
        assert case.recipe is not None
        nodes.setdefault(case.role.value, set()).add(case.recipe["node"])
    assert not nodes["validation"] & (nodes["estimation"] | nodes["selection"])
    assert not nodes["selection"] & nodes["estimation"]
