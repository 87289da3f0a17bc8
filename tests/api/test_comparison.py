"""Models side by side: the table, the frame, the picture."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.api.comparison import Comparison
from sysid.errors import ConfigError
from sysid.estimation import Status

U = np.repeat([0.0, 1.0, -1.0, 0.5, 0.0], 20)
Y = np.convolve(U, 0.2 * 0.8 ** np.arange(40))[:100]


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    traces = sysid.data((U, Y), sample_time=0.1, split=0.6, units={"y": "cm"})
    fits = [sysid.fit(traces, "u -> y", sysid.ARX(na=na, nb=1, nk=0)) for na in (1, 0)]
    return sysid.compare(traces, *fits)


def test_the_frame_has_a_row_for_each_model_and_case(comparison: Comparison) -> None:
    frame = comparison.to_frame()
    assert list(frame["case"]) == ["estimation", "validation"] * 2
    assert set(frame["unit"]) == {"cm"} and set(frame["output"]) == {"y"}
    assert frame["fit"].max() == pytest.approx(100.0, abs=1e-6)
    np.testing.assert_allclose(frame["rmse"] ** 2, frame["mse"])


def test_the_table_shows_the_figures_of_the_frame(comparison: Comparison) -> None:
    first = comparison.to_frame()["fit"][0]
    assert f"{first:.2f}" in str(comparison).splitlines()[1]
    assert repr(comparison) == str(comparison)
    assert comparison._repr_html_().startswith("<pre>free run")


def test_every_model_is_drawn_over_the_measurement(comparison: Comparison) -> None:
    figure = comparison.plot()
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["y, estimation", "y, validation"]
    assert [len(axes.get_lines()) for axes in figure.axes] == [3, 3]


def test_nothing_compared_is_an_empty_table() -> None:
    empty = Comparison(evaluations={})
    assert str(empty) == "free run, fit in percent"
    assert empty.to_frame().empty
    assert empty.plot().axes


def test_fits_are_compared_one_by_one_or_in_a_list_and_nothing_else_is(comparison: Comparison) -> None:
    traces = sysid.data((U, Y), sample_time=0.1, split=0.6)
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=0))
    assert list(sysid.compare(traces, [fit]).evaluations) == list(sysid.compare(traces, fit).evaluations)
    for strange, named in (((fit.model,), "ARXModel"), ((), "none"), (([],), "none")):
        with pytest.raises(ConfigError, match=f"got: +{named}"):
            sysid.compare(traces, *strange)


def test_a_fit_that_cannot_be_used_is_told_below_the_table(comparison: Comparison) -> None:
    traces = sysid.data((U, Y), sample_time=0.1, split=0.6)
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=0))
    runs_away = dataclasses.replace(fit, status=Status.UNSTABLE)
    assert f"{fit.model.label}: {Status.UNSTABLE.value}" in str(sysid.compare(traces, runs_away)).splitlines()
    assert "leaves its bounds" not in str(sysid.compare(traces, fit))


def test_records_that_do_not_begin_as_declared_are_told_once_each() -> None:
    """What was in motion was scored from rest without a word, and models ranked by how soon they forget."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 5)
    y = lfilter([0.0, 0.1], [1.0, -0.9], u) + 4.0 * 0.9 ** np.arange(300)
    still = lfilter([0.0, 0.1], [1.0, -0.9], np.r_[np.zeros(20), u[20:]])
    traces = sysid.data([(u, y), (np.r_[np.zeros(20), u[20:]], still)], sample_time=0.1, split=["estimation"] * 2)
    fits = [sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=nb, nk=1), rest_output=0.0) for nb in (1, 2)]
    first, second = traces.names
    assert [note.split(" does not")[0] for note in sysid.compare(traces, fits, start="rest").notes] == [first]
    assert "write start: estimated" in str(sysid.compare(traces, fits, start="rest"))
    assert not sysid.compare(traces, fits).notes, second
