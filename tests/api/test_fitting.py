"""The short way from Python: the same results as the long one, and none of it loaded before it is used."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import sysid
from sysid import api
from sysid.errors import ChannelError, ConfigError
from sysid.estimation import fit_arx, fit_narx
from sysid.export import read_bundle
from sysid.models import Mapping, Start, StartKind
from sysid.testing import first_order_record
from sysid.traces import Role, TraceSet
from sysid.validation import evaluate

ESTIMATED = Start(kind=StartKind.ESTIMATED)


@pytest.fixture(scope="module")
def traces() -> TraceSet:
    return sysid.load(first_order_record())


def test_the_words_are_there_and_lazy() -> None:
    assert set(api.__all__) <= set(dir(sysid))
    for word in api.__all__:
        assert getattr(sysid, word) is not None
    script = "import sys, sysid; print('numpy' in sys.modules); sysid.load; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["False", "True"]


def test_a_single_order_may_be_a_number() -> None:
    assert sysid.ARX(na=2, nb=2, nk=3) == sysid.ARX(na=2, nb=(2,), nk=(3,))


def test_a_list_with_commas_is_a_missing_channel_and_not_orders_that_do_not_match(traces: TraceSet) -> None:
    with pytest.raises(ChannelError, match="missing channel u, y") as refused:
        sysid.fit(traces, "u, y -> y", sysid.ARX(na=1, nb=(1, 1), nk=(1, 1)))
    assert "write u+y in a mapping" in str(refused.value.remedy)


def test_an_unknown_word_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'lod'"):
        _ = sysid.lod


def test_the_short_way_gives_what_the_long_one_gives(traces: TraceSet) -> None:
    orders = sysid.ARX(na=1, nb=(1,), nk=(1,))
    short = sysid.fit(traces, "u -> y", orders)
    long = fit_arx(traces.traces, Mapping.parse("u -> y"), orders, start=ESTIMATED)
    assert short.model.to_dict() == long.model.to_dict()
    network, training = sysid.NARX(input_delays=1, output_delays=1, neurons=2), sysid.Training(max_iterations=5)
    shorter = sysid.fit(traces, "u -> y", network, training)
    longer = fit_narx(traces.traces, Mapping.parse("u -> y"), network, training, start=ESTIMATED)
    assert shorter.model.to_dict() == longer.model.to_dict()
    compared = sysid.compare(traces, short, shorter, short)
    assert list(compared.evaluations) == ["ARX [1; 1; 1]", "NARX 1/1/2", "ARX [1; 1; 1] (3)"]
    figures = evaluate(long.model, traces, ESTIMATED).cases["record"].free_run
    assert compared.evaluations["ARX [1; 1; 1]"].cases["record"].free_run == figures
    assert f"{figures.nrmse_fit:.2f}" in str(compared).splitlines()[1]


def test_an_export_is_read_back(traces: TraceSet, tmp_path: Path) -> None:
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=(1,), nk=(1,)))
    sysid.save(fit, traces, tmp_path / "bundle", formats=("onnx",))
    assert read_bundle(tmp_path / "bundle").model.structure.label == "ARX [1; 1; 1]"


def test_without_a_trace_to_fit_it_says_so(traces: TraceSet) -> None:
    only = TraceSet(name="only", traces=traces.traces, roles={"record": Role.TEST})
    with pytest.raises(ConfigError, match="no trace is for estimation"):
        sysid.fit(only, "u -> y", sysid.ARX(na=1, nb=(1,), nk=(1,)))


def test_a_start_may_be_a_word_as_in_a_pipeline(traces: TraceSet) -> None:
    arx = sysid.ARX(na=1, nb=1, nk=1)
    fit = sysid.fit(traces, "u -> y", arx, start="first-sample")
    assert fit.start == Start(kind=StartKind.FIRST_SAMPLE)
    ((_, found),) = sysid.compare(traces, fit, start={"measured": 3}).evaluations.items()
    (case,) = found.cases.values()
    assert len(case.target) == len(traces.traces[0]) - 3
