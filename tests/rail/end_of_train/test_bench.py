"""The bench of an end-of-train device: a volume with leaks, and a train braked from both ends beside one end."""

import numpy as np
import pytest

from sysid.airbrake.consist import Consist
from sysid.errors import ConfigError
from sysid.rail.end_of_train.bench import LeakingBench, from_both_ends
from sysid.rail.end_of_train.tail_unit import SelfTest, TailSettings, self_test


@pytest.mark.parametrize(
    ("leak", "valve_leak", "outcome"),
    [
        (0.0, 0.0, SelfTest.HELD),
        (5.0, 0.0, SelfTest.HELD),  # what 49 CFR 232.205 lets a pipe lose
        (12.1, 0.0, SelfTest.FAIL_FIRST),  # 2 psi in 10 s
        (5.0, 7.1, SelfTest.FAIL_SECOND),
    ],
    ids=["tight", "as much as a train may", "leak", "valve does not hold"],
)
def test_the_self_test_tells_a_leak_from_a_valve(leak: float, valve_leak: float, outcome: SelfTest) -> None:
    bench = LeakingBench(leak=leak, valve_leak=valve_leak)
    assert self_test(bench) is outcome
    times, pressures = np.array([(at, psi) for at, _, psi in bench.readings]).T
    closed = leak / 60.0 * np.minimum(times, 12.0)
    opened = (leak + valve_leak) / 60.0 * np.maximum(times - 12.0, 0.0)
    np.testing.assert_allclose(pressures, 90.0 - closed - opened, atol=1e-12)


def test_a_bench_that_fills_by_itself_is_refused() -> None:
    with pytest.raises(ConfigError, match="not a test bench"):
        LeakingBench(leak=-1.0)


def test_an_emergency_opens_the_valve_for_15_s_within_a_second_of_the_order() -> None:
    found = from_both_ends(Consist(pairs=20), 0.0, seconds=40.0)
    assert 0.0 < found.opened - found.log[0][0].time <= 1.0
    assert found.open_for == pytest.approx(15.0)
    assert found.braked[0] < found.braked[1]


@pytest.mark.parametrize(
    ("handle", "off"),
    [
        (82.0, 0.01),
        # The first order is a minimum application, and the tail's own is 6 psi where the driver makes 5.8; on 20 pairs
        # the pipe is there before the next order corrects it.
        (84.2, 0.3),
    ],
    ids=["service", "minimum"],
)
def test_an_application_gives_every_cylinder_the_same_from_both_ends(handle: float, off: float) -> None:
    found = from_both_ends(Consist(pairs=20), handle, seconds=100.0)
    np.testing.assert_allclose(found.both[-1], found.one[-1], atol=off)


@pytest.mark.parametrize(("handle", "seconds"), [(90.0, 60.0), (-1.0, 60.0), (80.0, 2.0), (80.0, 5000.0)])
def test_what_is_no_application_is_refused(handle: float, seconds: float) -> None:
    with pytest.raises(ConfigError, match="not an application"):
        from_both_ends(Consist(pairs=1), handle, seconds=seconds)


def test_the_valve_is_as_wide_as_49_cfr_232_405_asks() -> None:
    inch = 0.0254
    hose = np.pi / 4.0 * (0.625 * inch) ** 2
    assert TailSettings().emergency_area == pytest.approx(hose, rel=0.005)
