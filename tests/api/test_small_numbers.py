"""Numbers and arrays of NumPy's small types are what they are at every door of Python: nothing runs over."""

from __future__ import annotations

import datetime
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy
from numpy.testing import assert_array_equal

import sysid
from sysid.errors import ConfigError
from sysid.sklearn import DynamicRegressor

U = np.repeat(np.random.default_rng(0).integers(0, 120, 30), 10)
Y = np.round(scipy.signal.lfilter([0.0, 0.2], [1.0, -0.8], 2.0 * U)).astype(int)
UNASKED = sysid.StabilityOptions(count=0)
ARX = sysid.ARX(na=1, nb=1, nk=1)


def _fit(u: Any, y: Any, structure: Any = ARX) -> Any:
    return sysid.fit(sysid.data((u, y), sample_time=1.0), "u -> y", structure, stability=UNASKED)


@pytest.mark.parametrize("structure", [ARX, sysid.TransferFunction(poles=1, zeros=0, delays=1)], ids=["ARX", "TF"])
@pytest.mark.parametrize("kind", ["int8", "uint8", "list", "Int8", "bool"])
def test_small_integers_are_numbers_like_all_others(kind: str, structure: Any) -> None:
    u: Any = {"list": U.tolist(), "Int8": pd.Series(U, dtype="Int8", name="u"), "bool": U > 60}.get(kind)
    u = U.astype(kind) if u is None else u
    y = pd.Series(Y, dtype="UInt8", name="y") if kind == "Int8" else Y.astype(np.uint8)
    plain = np.asarray(u, dtype=float)
    small, usual = _fit(u, y, structure), _fit(plain, Y.astype(float), structure)
    assert_array_equal(small.simulate(u), usual.simulate(plain))
    if kind != "Int8" and structure is ARX:
        pairs = (
            small.simulate(u[50:], initial=(u[:50], y[:50])),
            usual.simulate(plain[50:], initial=(plain[:50], Y[:50])),
        )
        assert_array_equal(*pairs)
        assert_array_equal(small.model.predict(np.asarray(u)[:, None], y), small.model.predict(plain[:, None], Y * 1.0))


def test_a_regressor_takes_them_too() -> None:
    small = DynamicRegressor(ARX).fit(U.astype(np.int8)[:, None], Y.astype(np.uint8))
    usual = DynamicRegressor(ARX).fit(U.astype(float)[:, None], Y.astype(float))
    assert_array_equal(small.predict(U.astype(np.int8)[:, None]), usual.predict(U.astype(float)[:, None]))


def test_options_are_read_whatever_their_type_and_depth() -> None:
    """A number out of a frame or an array of NumPy is none of Python's own."""
    few, real = np.int16, np.float32
    grey = sysid.GreyBox(
        equations="y[k+1] = a*y + share(u)", parameters={"a": {"start": real(0.5), "low": few(0)}},
        tables={"share": np.array([[0, 0], [100, 1]], np.int8)},
    )  # fmt: skip
    assert grey == sysid.GreyBox(
        equations="y[k+1] = a*y + share(u)", parameters={"a": {"start": 0.5, "low": 0}},
        tables={"share": [[0, 0], [100, 1]]},
    )  # fmt: skip
    limits = {"input_delays": 1, "output_delays": few(1), "neurons": np.int8(2)}
    assert sysid.NARX(**limits, limits=(few(0), few(130))) == sysid.NARX(**limits, limits=(0, 130))
    assert sysid.data((U, Y), sample_time=few(1), split=real(0.75)).names == ("estimation", "validation")
    drawn = sysid.excite("prbs", samples=few(60), sample_time=few(1), low=few(0), high=np.uint8(200), clock=few(4))
    assert_array_equal(drawn.values, sysid.excite("prbs", samples=60, sample_time=1, low=0, high=200, clock=4).values)
    fit = _fit(U, Y)
    assert repr(sysid.step(fit, seconds=np.int8(20))) == repr(sysid.step(fit, seconds=20))


def test_lengths_of_time_may_be_durations_and_are_no_text() -> None:
    """An experiment of two days was refused with a traceback, and a sample time of "1h" was to be corrected to what?"""
    hour, day = datetime.timedelta(hours=1), pd.Timedelta(days=1)
    u = sysid.excite("prbs", duration=2 * day, sample_time=hour)
    assert (len(u.values), u.plan.sample_time) == (48, 3600.0)
    traces = sysid.data((np.arange(48.0) % 5, np.arange(48.0) % 7), sample_time=hour)
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=1))
    assert fit.step(seconds=day).time[-1] == 86400.0
    hours: Any = "1h"
    for call in (
        lambda: sysid.excite("prbs", samples=10, sample_time=hours),
        lambda: sysid.data((np.arange(9.0), np.arange(9.0)), sample_time=hours),
        lambda: fit.step(seconds=hours),
    ):
        with pytest.raises(ConfigError, match="not a length of time") as refused:
            call()
        assert "datetime.timedelta(hours=1)" in str(refused.value.remedy)
