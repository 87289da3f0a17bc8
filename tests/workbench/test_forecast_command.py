"""``sysid forecast`` and ``bundle.forecast``: what a fit's own ``forecast`` says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.errors import ConfigError
from sysid.ingest import read_trace, write_trace
from sysid.traces import TraceSet
from sysid.workbench.cli import run_cli

T = 0.1


def _traces() -> TraceSet:
    """A plant of two outputs, whose noise is coloured."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1, 1, 60), 5)
    noise = lfilter([0.3], [1.0, -0.95], rng.standard_normal((2, 300)))
    y = np.column_stack(
        [lfilter([0.0, 0.2], [1.0, -0.8], u) + noise[0], lfilter([0.0, 0.5], [1.0, -0.5], u) + noise[1]]
    )
    return sysid.data((u, y), sample_time=T, units={"u": "V"})


@pytest.fixture(scope="module")
def traces() -> TraceSet:
    return _traces()


@pytest.fixture(scope="module")
def fit(traces: TraceSet) -> sysid.Fit:
    return sysid.fit(traces, "u -> y1", sysid.BJ(nb=1, nc=1, nd=1, nf=1, nk=1))


@pytest.fixture(scope="module")
def bundle(fit: sysid.Fit, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fit.save(tmp_path_factory.mktemp("saved") / "bundle", formats=()).folder


def test_a_bundle_forecasts_as_its_fit_does_from_any_form_of_the_past(
    traces: TraceSet, fit: sysid.Fit, bundle: Path
) -> None:
    record = traces.traces[0]
    past, u = record[:200], record[200:]
    pair = (past["u"], past["y1"])
    expected = fit.forecast(u, initial=pair)
    assert not np.allclose(expected[:3], fit.simulate(u, initial=pair)[:3])
    for before in (past, sysid.data({"u": past["u"], "y1": past["y1"]}, sample_time=T, units={"u": "V"})):
        np.testing.assert_array_equal(fit.forecast(u, initial=before), expected)
        np.testing.assert_allclose(sysid.read_bundle(bundle).forecast(u, initial=before), expected, atol=1e-9)


def test_the_command_writes_what_is_expected_after_the_last_measured_sample(
    traces: TraceSet, fit: sysid.Fit, bundle: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = traces.traces[0]
    write_trace(record[:200], tmp_path / "past.csv")
    write_trace(record[200:], tmp_path / "next.csv")
    assert run_cli(["forecast", str(bundle), str(tmp_path / "past.csv"), str(tmp_path / "next.csv")]) == 0
    assert "100 samples of y1" in " ".join(capsys.readouterr().out.split())
    written = read_trace(tmp_path / "next.forecast.csv")
    assert written.channel_names == ("u", "y1")
    expected = fit.forecast(record[200:], initial=record[:200])
    np.testing.assert_allclose(written["y1"], expected, atol=1e-9)


@pytest.mark.parametrize(("first", "code"), [(200, 0), (201, 2), (190, 2)])
@pytest.mark.parametrize("dated", [False, True])
def test_inputs_to_come_have_to_follow_where_their_stamps_say_when_they_are(
    traces: TraceSet,
    bundle: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    *,
    first: int,
    code: int,
    dated: bool,
) -> None:
    record = traces.traces[0]
    stamp = (lambda k: f"2024-10-27T02:00:{k / 10:04.1f}") if dated else (lambda k: f"{k / 10:.1f}")
    for name, rows in (("past", range(190, 200)), ("next", range(first, first + 9))):
        shift = 190 if dated else 0
        lines = [f"{stamp(k - shift)},{record['u'][k]},{record['y1'][k]}" for k in rows]
        (tmp_path / f"{name}.csv").write_text("\n".join([f"time{'' if dated else ' [s]'},u [V],y1 [1]", *lines]))
    assert run_cli(["forecast", str(bundle), str(tmp_path / "past.csv"), str(tmp_path / "next.csv")]) == code
    assert ("do not follow" in capsys.readouterr().err) == (code == 2)


def test_a_past_of_another_sample_time_or_without_its_output_is_refused(
    traces: TraceSet, bundle: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = traces.traces[0]
    write_trace(record[200:], tmp_path / "next.csv")
    other = sysid.data({"u": record["u"], "y1": record["y1"]}, sample_time=2 * T, units={"u": "V"}).traces[0]
    write_trace(other, tmp_path / "slow.csv")
    assert run_cli(["forecast", str(bundle), str(tmp_path / "slow.csv"), str(tmp_path / "next.csv")]) == 2
    assert "0.2" in capsys.readouterr().err
    with pytest.raises(ConfigError, match="another distance"):
        sysid.read_bundle(bundle).forecast(record[200:], initial=other)
    (tmp_path / "inputs.csv").write_text("time [s],u [V]\n0,1\n0.1,1\n0.2,0\n", encoding="utf-8")
    assert run_cli(["forecast", str(bundle), str(tmp_path / "inputs.csv"), str(tmp_path / "next.csv")]) == 2
    assert "y1" in capsys.readouterr().err


def test_a_model_an_output_is_forecast_from_one_record(traces: TraceSet, tmp_path: Path) -> None:
    record = traces.traces[0]
    whole = sysid.fit(traces, "u -> y1+y2", sysid.OE(nb=1, nf=1, nk=1))
    expected = whole.forecast(record[200:], initial=record[:200])
    saved = whole.save(tmp_path / "whole", formats=())
    assert expected.shape == (100, 2)
    np.testing.assert_allclose(saved.forecast(record[200:], initial=record[:200]), expected, atol=1e-9)


def test_a_run_and_estimates_take_a_data_set_of_one_record_and_a_mapping_in_words(
    traces: TraceSet, fit: sysid.Fit
) -> None:
    record, arx = traces.traces[0], sysid.ARX(na=1, nb=1, nk=1)
    np.testing.assert_array_equal(fit.simulate(traces), fit.simulate(record))
    np.testing.assert_array_equal(fit.predict(traces, traces), fit.predict(record, record))
    one = sysid.models.Mapping.of("u -> y1")
    for given in (traces, record, [record]):
        found = sysid.estimation.fit_iv4(given, "u -> y1", arx)
        expected = sysid.estimation.fit_iv4((record,), one, arx)
        np.testing.assert_array_equal(found.uncertainty.values, expected.uncertainty.values)
        assert sysid.estimation.state_orders(given, "u -> y1+y2").chosen >= 1
