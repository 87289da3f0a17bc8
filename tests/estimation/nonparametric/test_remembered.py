"""What was estimated once is not estimated again, and nothing else is taken for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sysid
from sysid.errors import TraceError
from sysid.estimation.nonparametric import remembered
from sysid.estimation.nonparametric.impulse import estimate_impulse_response
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse
from sysid.estimation.nonparametric.memory import Memory
from sysid.models import Mapping
from sysid.traces import Channel, Trace

MAPPING = Mapping.parse("u -> y")


def record(**fields: object) -> Trace:
    rng = np.random.default_rng(5)
    u = rng.choice([-1.0, 1.0], 90)
    values = np.column_stack([u, np.append(0.0, 0.5 * u[:-1]) + np.linspace(0.0, 2.0, 90), u])
    channels = tuple(Channel(name=name, unit="V") for name in "uyx")
    return replace(Trace(name="a", sample_time=0.5, channels=channels, values=values), **fields)


@pytest.fixture
def estimates(monkeypatch: pytest.MonkeyPatch) -> list[Trace]:
    """The first record of each estimate that is made; nothing is remembered before."""
    made = list[Trace]()

    def counted(traces: list[Trace], *args: object, **options: int) -> ImpulseResponse:
        made.append(traces[0])
        return estimate_impulse_response(traces, *args, **options)

    monkeypatch.setattr(remembered, "estimate_impulse_response", counted)
    monkeypatch.setattr(remembered, "_memory", Memory[ImpulseResponse](remembered.MOST))
    return made


def test_the_same_samples_are_asked_once_and_answered_as_by_the_estimate(estimates: list[Trace]) -> None:
    first, again = (remembered.remembered_response([record()], MAPPING, longest=8) for _ in range(2))
    assert again is first and len(estimates) == 1
    alone = estimate_impulse_response([record()], MAPPING, longest=8)
    np.testing.assert_array_equal(first.values, alone.values)
    np.testing.assert_array_equal(first.covariance, alone.covariance)
    with pytest.raises(ValueError, match="read-only"):
        first.values[:] = 0.0


def test_what_no_response_depends_on_is_no_other_record(estimates: list[Trace]) -> None:
    values = record().values.copy()
    values[:, 2] = 7.0
    for one in (record(), record(values=values), record(provenance=("repaired",), start_time=3.0)):
        remembered.remembered_response([one], MAPPING, longest=8)
    assert len(estimates) == 1


def test_anything_else_is_another_question(estimates: list[Trace]) -> None:
    values, usable, volts = record().values.copy(), np.arange(90) != 40, record().channels
    values[50, 1] += 1e-9
    others = [
        record(),
        record(values=values),
        record(usable=usable),
        record(weights=usable.astype(np.float64)),
        record(sample_time=0.25),
        record(channels=(volts[0], replace(volts[1], unit="bar"), volts[2])),
    ]
    for one in others:
        remembered.remembered_response([one], MAPPING, longest=8)
    remembered.remembered_response([record()], MAPPING, longest=9)
    remembered.remembered_response([record()], Mapping.parse("x -> y"), longest=8)
    remembered.remembered_response([record(), record(name="b")], MAPPING, longest=8)
    # A sample of no weight is as one that is not usable.
    assert len(estimates) == len(others) - 1 + 3


def test_what_was_asked_last_is_kept_no_more_than_said_and_no_error(
    estimates: list[Trace], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(remembered, "_memory", Memory[ImpulseResponse](2))
    for longest, estimated in ((4, 1), (5, 2), (4, 2), (6, 3), (4, 3), (5, 4)):
        remembered.remembered_response([record()], MAPPING, longest=longest)
        assert len(estimates) == estimated
    assert len(remembered._memory) == 2
    still = record().values * [0.0, 1.0, 1.0]
    for _ in range(2):
        with pytest.raises(TraceError, match="never changes"):
            remembered.remembered_response([record(values=still)], MAPPING, longest=4)
    assert len(estimates) == 6


def test_fits_of_the_same_record_estimate_its_response_once(estimates: list[Trace]) -> None:
    u, y = record().values[:, :2].T
    for na in (1, 2):
        data = sysid.data((u, y), sample_time=0.5)
        sysid.fit(data, "u -> y", sysid.ARX(na=na, nb=1, nk=1), stability=sysid.StabilityOptions(count=0))
    assert len(estimates) == 1
