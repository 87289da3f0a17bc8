"""What trace sets say of the traces in them."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sysid.errors import TraceError
from sysid.traces import Channel, Role, Trace, TraceSet

TRACE = Trace(name="EST01", sample_time=0.1, channels=(Channel(name="BP", unit="psi"),), values=np.zeros((5, 1)))


def test_a_set_says_which_cases_it_has():
    traces = TraceSet(name="abdx", traces=(TRACE,))
    assert "EST01" in traces
    assert "VAL01" not in traces


@pytest.mark.parametrize(("start", "shares"), [(0, True), (30, True), (50, False)])
def test_a_case_that_has_samples_of_a_fitted_one_is_known(start: int, shares: bool) -> None:
    values = np.random.default_rng(0).standard_normal((80, 1))

    def cut(name: str, a: int, b: int) -> Trace:
        return Trace(
            name=name, sample_time=0.1, channels=TRACE.channels, values=values[a:b].copy(), start_time=round(0.1 * a, 9)
        )

    other = Trace(name="other", sample_time=0.1, channels=TRACE.channels, values=-values)
    roles = {"fitted": Role.ESTIMATION, "again": Role.SELECTION, "other": Role.TEST}
    traces = TraceSet(name="rig", traces=(cut("fitted", 0, 50), cut("again", start, 80), other), roles=roles)
    assert traces.shared == ((("again", "fitted"),) if shares else ())


@pytest.mark.parametrize(
    "change",
    [
        lambda roles: roles.__setitem__("A", Role.TEST),
        lambda roles: roles.__delitem__("A"),
        lambda roles: roles.update(A=Role.TEST),
        lambda roles: roles.__ior__({"A": Role.TEST}),
        lambda roles: roles.pop("A"),
        lambda roles: roles.popitem(),
        lambda roles: roles.setdefault("Z", Role.TEST),
        lambda roles: roles.clear(),
    ],
    ids=["set", "del", "update", "or", "pop", "popitem", "setdefault", "clear"],
)
def test_roles_stay_as_they_are_and_others_make_another_set(change: Callable[[Any], object]) -> None:
    """A trace that was scored could become one that is fitted, in a set that was digested and split already."""
    one = Trace(name="A", sample_time=0.1, channels=(Channel(name="u", unit="V"),), values=np.zeros((5, 1)))
    traces = TraceSet(name="set", traces=(one,), roles={"A": Role.ESTIMATION})
    before = traces.digest
    with pytest.raises(TraceError, match="stay as they are"):
        change(traces.roles)
    assert (traces.roles, traces.digest) == ({"A": Role.ESTIMATION}, before)
    other = replace(traces, roles=traces.roles | {"A": Role.TEST})
    assert other.roles == {"A": Role.TEST}
    for again in (pickle.loads(pickle.dumps(traces)), copy.deepcopy(traces)):  # noqa: S301 - our own
        assert again.digest == before
        assert type(again.roles) is type(traces.roles)
