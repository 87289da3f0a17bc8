"""Outputs of which one is measured more slowly than another: what it lacks is nothing to the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

import sysid
from sysid.ingest import read_trace, write_csv, write_parquet
from sysid.ingest.datasets.cache import TraceCache

N = 600
U = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, N // 5), 5)
FAST, SLOW = lfilter([0.0, 0.2], [1.0, -0.8], U), lfilter([0.0, 0.05], [1.0, -0.95], U)
SPARSE = np.where(np.arange(N) % 10 == 0, SLOW, np.nan)


@pytest.fixture(scope="module")
def traces() -> sysid.TraceSet:
    columns = {"u": U, "fast": FAST, "slow": SPARSE}
    return sysid.data(columns, inputs="u", outputs=["fast", "slow"], sample_time=0.1, repairs={"nan": "mask"})


def test_each_output_of_a_system_is_fitted_on_all_that_it_has(traces: sysid.TraceSet) -> None:
    fit = sysid.fit(traces, "u -> fast", sysid.ARX(na=1, nb=(1,), nk=(1,)))
    assert_allclose(fit.model.coefficients, [0.2, 0.8], atol=1e-9)
    assert not any("loses" in note for note in fit.notes)


def test_one_network_of_both_outputs_counts_them_apart(traces: sysid.TraceSet) -> None:
    training = sysid.Training(max_iterations=40, starts=1)
    fit = sysid.fit(traces, "u -> fast+slow", sysid.VectorNeuralStateSpace(states=2, neurons=0), training)
    run = fit.model.simulate(U[:, None])
    assert_allclose(run, np.column_stack([FAST, SLOW]), atol=1e-3)
    assert not any("loses" in note for note in fit.notes)


def test_a_model_that_cannot_tell_them_apart_says_what_is_lost(traces: sysid.TraceSet) -> None:
    half = SLOW.copy()
    half[200:400] = np.nan
    columns = {"u": U, "fast": FAST, "slow": half}
    record = sysid.data(columns, inputs="u", outputs=["fast", "slow"], sample_time=0.1, repairs={"nan": "mask"})
    fit = sysid.fit(record, "u -> fast+slow", sysid.VectorStateSpace(states=2))
    told = [note.split(":")[0] for note in fit.notes if "loses" in note]
    assert told == ["fast loses 33 % of its samples (200 of 600)"]


def test_a_mask_of_each_channel_is_kept_by_whatever_writes_a_trace(tmp_path: Path, traces: sysid.TraceSet) -> None:
    trace = traces.traces[0]
    store = TraceCache(folder=tmp_path)
    store.store("a", trace)
    kept = store.load("a")
    assert kept is not None
    written = [write_csv(trace, tmp_path / "a.csv"), write_parquet(trace, tmp_path / "a.parquet")]
    assert {one.digest for one in (kept, *map(read_trace, written))} == {trace.digest}
    changed = tmp_path / "changed.csv"
    changed.write_text(written[0].read_text().replace("fast", "quick"))
    assert np.array_equal(read_trace(changed).usable_of(["slow"]), trace.usable_of(["slow"]))
    assert read_trace(changed).usable_of(["quick"]).all()


def test_an_output_at_every_tenth_sample_is_scored_behind_its_own_beginning() -> None:
    """Samples that say how a run begins are counted among those that count, which reach ten times as far."""
    columns = {"u": U, "slow": SPARSE}
    parts = sysid.data(columns, inputs="u", outputs="slow", sample_time=0.1, repairs={"nan": "mask"}, split=(0.7, 0.3))
    structure = sysid.TransferFunction(poles=(1,), zeros=(0,), delays=(1,))
    fit = sysid.fit(parts, "u -> slow", structure)
    assert "100.00" in str(sysid.compare(parts, fit))
