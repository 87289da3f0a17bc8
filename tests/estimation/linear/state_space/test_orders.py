"""How many states a record shows, without a fit."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.errors import ChannelError
from sysid.estimation import state_orders
from sysid.models import Mapping
from tests.estimation.linear.state_space.test_state_space import ONE, record, two_outputs


def test_as_many_correlations_stand_out_as_there_are_states() -> None:
    found = state_orders([two_outputs(0), two_outputs(1)], Mapping.parse("a+b -> y+z"))
    assert found.chosen == 3
    assert found.correlations[2] > 2.0 * found.correlations[3]
    assert (np.diff(found.correlations) <= 0.0).all()
    assert found.notes == ()


def test_a_choice_at_the_end_of_what_was_looked_at_says_so() -> None:
    assert "allow more" in state_orders([record(0)], ONE, most=1).notes[0]


def test_a_channel_that_is_missing_is_named() -> None:
    with pytest.raises(ChannelError):
        state_orders([record(0)], Mapping.parse("u9 -> y"))
