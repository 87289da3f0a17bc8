"""A bundle run over inputs or a command, and what is said of it."""

from __future__ import annotations

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError
from sysid.export import Flag, export_bundle, simulate_bundle
from sysid.traces import Channel, Trace
from sysid.units import Reference


@pytest.fixture(scope="module")
def whole(limited, command, tmp_path_factory):
    return export_bundle(limited, command, tmp_path_factory.mktemp("s") / "b", formats=[])


@pytest.fixture(scope="module")
def single(fit, traces, start, tmp_path_factory):
    return export_bundle(fit, traces, tmp_path_factory.mktemp("s") / "b", start=start, formats=[])


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "full.csv"
    path.write_text("time [ds],STP [kPa],FLOW [psi]\n0,482.6,10\n100,344.7,20\n300,0,0\n")
    return path


def test_a_command_gives_every_channel_of_the_cascade(whole, limited, file):
    for given in (whole, whole.folder, str(whole.folder)):
        found = simulate_bundle(given, file)
        u = found.trace.columns(limited.inputs)
        assert (len(found.trace), found.inputs, found.outputs) == (300, limited.inputs, limited.outputs)
        np.testing.assert_allclose(u[:, 0], np.repeat([482.6, 344.7], [100, 200]) / 6.894757293168361)
        np.testing.assert_array_equal(found.trace.columns(limited.outputs), limited.simulate(u).values[:, 2:])


def test_limits_and_ranges_are_reported(whole, limited, file):
    found = simulate_bundle(whole, file)
    at_limit = (found.flags & Flag.AT_LIMIT) > 0
    assert at_limit.any()
    (sentence,) = [
        one for one in found.sentences if "held at one of its limits, declared or found in the records" in one
    ]
    assert sentence.endswith(": " + "; ".join(one.sentence for one in found.held))
    # Which limit, and how long: counted by hand from the channels themselves.
    limits = {(one.output, one.upper): one for one in found.held}
    for name, limit in limited.limits.items():
        for upper, value in ((False, limit.low), (True, limit.high)):
            there = (
                None
                if value is None
                else found.trace[name] == (found.trace[value] if isinstance(value, str) else value)
            )
            if there is not None and there.any():
                one = limits.pop((name, upper))
                assert one.share == pytest.approx(float(np.mean(there)))
                assert one.limit == (value if isinstance(value, str) else f"{value:g} psi")
    assert not limits, "nothing else is reached"
    assert len(found.trace) == len(found.flags)


def test_a_trace_gives_what_the_model_gives(single, fit, traces):
    found = simulate_bundle(single, traces["VAL01"])
    np.testing.assert_array_equal(found.trace["BC"], fit.model.simulate(traces["VAL01"].columns(("BP", "AR"))))


def test_the_output_may_begin_elsewhere(single, traces):
    found = simulate_bundle(single, traces["VAL01"], initial=30.0)
    assert found.trace["BC"][0] != simulate_bundle(single, traces["VAL01"]).trace["BC"][0]


def test_several_outputs_have_no_single_beginning(whole, file):
    with pytest.raises(ConfigError, match="cannot all begin"):
        simulate_bundle(whole, file, initial=1.0)


def test_another_sample_time_is_refused(single):
    channels = tuple(Channel(name=name, unit="psi", reference=Reference.GAUGE) for name in ("BP", "AR"))
    trace = Trace(name="fast", sample_time=0.01, channels=channels, values=np.ones((5, 2)))
    with pytest.raises(ConfigError, match="another sample time"):
        simulate_bundle(single, trace)


def test_an_end_of_the_range_in_another_unit_is_in_the_range(tmp_path, recwarn):
    """700 mV are 0.7000000000000001 V; by such roundings 7.5 % of a record's own inputs were told to be outside."""
    u = np.repeat(np.round(np.random.default_rng(1).uniform(-0.7, 0.7, 40), 1), 10)
    assert (0.001 * (1000.0 * u) > u.max()).any()
    y = np.convolve(u, 0.2 * 0.8 ** np.arange(100))[:400]
    traces = sysid.data({"u": u, "y": y}, inputs="u", outputs="y", sample_time=0.1, units={"u": "V"})
    bundle = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=0)).save(tmp_path / "b", formats=())
    rows = [f"{0.1 * k},{1000.0 * value:.1f}" for k, value in enumerate(u)]
    (tmp_path / "mv.csv").write_text("\n".join(["time [s],u [mV]", *rows]), encoding="utf-8")
    (tmp_path / "far.csv").write_text("\n".join(["time [s],u [mV]", "0,700.1", *rows[1:]]), encoding="utf-8")
    assert not (simulate_bundle(bundle, tmp_path / "mv.csv").flags & Flag.OUTSIDE_RANGE).any()
    assert (simulate_bundle(bundle, tmp_path / "far.csv").flags & Flag.OUTSIDE_RANGE).sum() == 1
    bundle.simulate(0.001 * (1000.0 * u))
    assert not recwarn.list
