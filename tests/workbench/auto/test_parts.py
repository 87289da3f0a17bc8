"""What is fitted and what chooses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError
from sysid.models import Mapping, Start, StartKind
from sysid.models.contract.beginning import window
from sysid.traces import Role
from sysid.workbench.auto.parts import FOLDS, SEARCHED, SHORT, ends_held_out, part
from tests.workbench.auto.conftest import data, record

MAPPING = Mapping.parse("u -> y")
STARTS = (
    Start(kind=StartKind.ESTIMATED),
    Start(kind=StartKind.ESTIMATED, n_measured=7),
    Start(kind=StartKind.MEASURED, n_measured=12),
    Start(kind=StartKind.REST),
)


@given(n=st.integers(min_value=150, max_value=400), start=st.sampled_from(STARTS), traces=st.sampled_from([1, 2, 3]))
def test_every_sample_after_the_beginning_chooses_once_and_is_not_fitted_then(
    n: int, start: Start, traces: int
) -> None:
    names = "abc"[:traces]
    found = part(data(*(record(name, n) for name in names)), MAPPING, start)
    assert (len(found.folds), found.partial) == (FOLDS, True)
    for place in range(traces):
        masks = [(f.fitted.traces[place].usable_samples, f.chooses[place].usable_samples) for f in found.folds]
        both = np.flatnonzero(masks[0][0] & masks[0][1])
        assert np.array_equal(both, np.arange(len(both)))  # the beginning, of which the state is taken
        assert len(both) >= start.n_measured
        later = slice(len(both), None)
        assert all(np.array_equal(fitted[later], ~chooses[later]) for fitted, chooses in masks)
        assert np.array_equal(sum(chooses[later].astype(int) for _, chooses in masks), np.ones(n - len(both)))


@given(
    n=st.integers(min_value=150, max_value=600),
    steps=st.booleans(),
    masked=st.integers(min_value=0, max_value=60),
)
def test_no_sample_that_was_fitted_is_scored_where_a_part_chooses(n: int, steps: bool, masked: int) -> None:
    """Of a record of 200 samples a run was scored from sample 16 on, and all parts had fitted those up to 40."""
    one, usable = record("a", n), np.arange(n) >= masked
    values = one.values.copy()
    values[:, 0] = np.arange(n) >= 24 if steps else values[:, 0]
    found = part(data(replace(one, values=values, usable=usable)), MAPPING, STARTS[0])
    for fold in found.folds:
        fitted, chooses = (some[0].usable_samples for some in (fold.fitted.traces, fold.chooses))
        scored = chooses & (np.arange(n) >= window(1, chooses, values[:, :1]))
        assert not (scored & fitted).any()
        assert scored.sum() > n // 8


def test_masked_samples_stay_masked() -> None:
    usable = np.ones(300, dtype=bool)
    usable[100:140] = False
    found = part(data(replace(record("a", 300), usable=usable)), MAPPING, STARTS[0])
    for fold in found.folds:
        assert not fold.fitted.traces[0].usable_samples[100:140].any()
        assert not fold.chooses[0].usable_samples[100:140].any()


def test_declared_selection_traces_choose_and_nothing_is_held_out() -> None:
    estimation, chooses = record("a", 100), record("b", 100, seed=1)
    found = part(data(estimation, others={Role.SELECTION: chooses}), MAPPING, STARTS[0])
    (fold,) = found.folds
    assert fold.fitted.traces == (estimation,)
    assert fold.chooses == (chooses,)
    assert not found.partial


def test_of_many_traces_whole_ones_are_held_out() -> None:
    names = "abcdef"
    found = part(data(*(record(name, 60) for name in names)), MAPPING, STARTS[0])
    for fold in found.folds:
        kept, held = set(fold.fitted.names), {trace.name for trace in fold.chooses}
        assert (kept | held, kept & held) == (set(names), set())
    assert sorted(trace.name for fold in found.folds for trace in fold.chooses) == list(names)


def test_no_trace_that_only_scores_is_among_the_parts() -> None:
    test = record("test", 100, seed=1)
    found = part(data(record("a", 200), others={Role.TEST: test}), MAPPING, STARTS[0])
    assert all(trace.name != "test" for fold in found.folds for trace in (*fold.fitted, *fold.chooses))


def test_a_long_record_is_searched_by_a_part_and_fitted_whole() -> None:
    long = part(data(record("a", SHORT + 1)), MAPPING, STARTS[0])
    assert (len(long.folds), long.partial) == (1, True)
    in_turn = part(data(record("a", SHORT + 1)), MAPPING, STARTS[0], in_turn=True)
    assert len(in_turn.folds) == FOLDS
    assert "all of them in turn" in in_turn.told[0]
    declared = {Role.SELECTION: record("b", 100, seed=1)}
    longer = part(data(record("a", 2 * SEARCHED), others=declared), MAPPING, STARTS[0])
    assert len(longer.folds[0].fitted.traces[0]) == SEARCHED
    many = part(data(*(record(name, SEARCHED // 4) for name in "cdefghij"), others=declared), MAPPING, STARTS[0])
    assert many.folds[0].fitted.names == ("c", "e", "h", "j")
    assert {len(one) for one in many.folds[0].fitted} == {SEARCHED // 4}
    assert "4 of the 8 traces" in many.told[-1]
    assert (longer.partial, longer.cut, long.cut) == (True, True, False)


def test_a_short_search_looks_at_less_where_selection_traces_choose() -> None:
    """Networks come to some iterations then; the chosen one is trained on, with all that is fitted."""
    declared = {Role.SELECTION: record("b", 100, seed=1)}
    known = data(*(record(name, 4000) for name in "cdefghijkl"), others=declared)
    for seconds, traces in ((10.0, 2), (100.0, 5), (1000.0, 10), (None, 10)):
        found = part(known, MAPPING, STARTS[0], seconds)
        assert sum(map(len, found.folds[0].fitted)) == 4000 * traces
        assert found.trained_on
    held_out = part(data(record("a", 3 * 8_000)), MAPPING, STARTS[0], 10.0)
    assert sum(map(len, held_out.folds[0].fitted)) == 3 * 8_000


def test_records_without_noise_are_searched_by_a_third_of_that() -> None:
    """A few tell what a structure is worth, and leave time for more of them; the chosen one still sees all."""
    declared = {Role.SELECTION: record("b", 100, seed=1)}
    known = data(*(record(name, 4000) for name in "cdefghijkl"), others=declared)
    for seconds, samples in ((10.0, 8_000), (180.0, 12_000), (None, SEARCHED // 3)):
        found = part(known, MAPPING, STARTS[0], seconds, exact=True)
        assert sum(map(len, found.folds[0].fitted)) == pytest.approx(samples, abs=10)
        assert found.trained_on


def test_too_short_a_record_says_what_to_do() -> None:
    with pytest.raises(ConfigError, match="too short for a search") as caught:
        part(data(record("a", 30)), MAPPING, STARTS[0])
    assert "declare" in str(caught.value) or "longer" in str(caught.value)


def test_an_order_search_chooses_on_the_ends() -> None:
    fitted, chooses = ends_held_out([record("a", 100)])
    assert (len(fitted[0]), len(chooses[0])) == (75, 25)
    assert chooses[0].start_time == pytest.approx(7.5)
