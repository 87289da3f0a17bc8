"""A surrogate as a table in, a table out: begun as its model is begun, and refused where it would be wrong."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sysid.export import EXPORTERS, Surrogate
from sysid.export.heeded import heeded
from sysid.export.manifest import describe
from sysid.models import NARX, AbstractModel, Cascade, Start
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.units import Reference
from sysid.workbench.tracking.served_table import Table, rests
from tests.export.cascades import build_committee, build_limited
from tests.export.grey_boxes import GREY_BOXES
from tests.export.single_models import build_arx, build_narx

SOURCES: dict[str, Callable[[], AbstractModel | Cascade]] = {
    "ARX": lambda: build_arx(na=3, nb=(2, 3), nk=(0, 5)),
    "NARX": lambda: build_narx(NARX(input_delays=[[0], [1, 2, 4]], output_delays="1:2", neurons=3)),
    "every kind, limits and levels": build_limited,
    "declared states": GREY_BOXES["declared states"],
}


def inputs(surrogate: Surrogate, n_samples: int = 60) -> np.ndarray:
    return np.random.default_rng(4).uniform(20.0, 80.0, (n_samples, len(surrogate.inputs)))


def opened(source: AbstractModel | Cascade, folder: Path) -> tuple[Surrogate, Table, pd.DataFrame]:
    """A surrogate, its table, and inputs as one."""
    surrogate = Surrogate.of(source)
    EXPORTERS["onnx"].write(surrogate, folder)
    u = inputs(surrogate)
    channels = tuple(Channel(name=p.name, unit=p.unit, reference=Reference.GAUGE) for p in surrogate.inputs)
    trace = Trace(name="A", sample_time=0.1, channels=channels, values=u)
    traces = TraceSet(name="rig", traces=(trace,), roles={"A": Role.ESTIMATION}, source="Made for a test.")
    about = describe(surrogate, {}, traces, start=Start(), metrics=None, provenance={})
    (folder / "model.json").write_text(json.dumps(about), encoding="utf-8")
    return surrogate, Table(folder), pd.DataFrame(u, columns=[channel.label for channel in channels])


@pytest.mark.parametrize("name", SOURCES)
def test_it_begins_and_runs_as_its_model(name: str, tmp_path: Path) -> None:
    surrogate, table, frame = opened(SOURCES[name](), tmp_path)
    found = table.predict(frame)
    u = frame.to_numpy()
    np.testing.assert_allclose(found.to_numpy()[:, :-1], surrogate.simulate(u), rtol=0.0, atol=1e-9)
    assert list(found.columns) == [f"{port.name} [{port.unit}]" for port in surrogate.outputs] + ["flags"]
    assert list(found.attrs["units"].values()) == [port.unit for port in surrogate.outputs]
    first = table.predict(frame[:25])
    rest = table.predict(frame[25:], {"state": first.attrs["state"]})
    pd.testing.assert_frame_equal(pd.concat([first, rest]), found)


@pytest.mark.parametrize(
    "index",
    [
        pd.date_range("2026-11-26", periods=60, freq="100ms", tz="Europe/Berlin"),
        pd.timedelta_range("3s", periods=60, freq="100ms"),
        pd.Index(np.round(7.0 + 0.1 * np.arange(60) + 0.004, 2), name="time [s]"),
        pd.Index([f"row {i}" for i in range(60)]),
    ],
    ids=["stamps", "durations", "seconds", "words"],
)
def test_an_index_is_kept(index: pd.Index, tmp_path: Path) -> None:
    surrogate, table, frame = opened(SOURCES["ARX"](), tmp_path)
    found = table.predict(frame.set_axis(index))
    assert found.index.equals(index)
    np.testing.assert_allclose(found.iloc[:, 0], surrogate.simulate(frame.to_numpy())[:, 0], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    "index",
    [
        pd.date_range("2026-11-26", periods=60, freq="50ms"),
        pd.timedelta_range("0s", periods=60, freq="1s"),
        pd.Index(np.arange(60) * 0.12),
        pd.Index([0.0, np.nan, *(0.1 * np.arange(2, 60))]),
        pd.Index(np.delete(0.1 * np.arange(61), 30)),
    ],
    ids=["stamps", "durations", "seconds", "not a number", "a gap"],
)
def test_an_index_of_another_sample_time_is_refused(index: pd.Index, tmp_path: Path) -> None:
    _, table, frame = opened(SOURCES["ARX"](), tmp_path)
    with pytest.raises(ValueError, match=r"expected a row every 0\.1 s"):
        table.predict(frame.set_axis(index))


def test_an_output_may_stand_elsewhere_before_the_first_row(tmp_path: Path) -> None:
    surrogate, table, frame = opened(SOURCES["NARX"](), tmp_path)
    found = table.predict(frame, {"BC_at_rest": 30.0, "state": []})
    expected = surrogate.simulate(frame.to_numpy(), np.array([30.0]))
    np.testing.assert_allclose(found.to_numpy()[:, :1], expected, rtol=0.0, atol=1e-9)


def test_all_members_of_a_mean_stand_where_it_is_said_to_stand(tmp_path: Path) -> None:
    whole = build_committee(2, mean=True)
    surrogate, table, frame = opened(whole, tmp_path)
    found = table.predict(frame, {"BC_at_rest": 41.0})
    expected = whole.simulate(frame.to_numpy(), rest={"BC": 41.0})
    names = [port.name for port in surrogate.outputs]
    assert expected["BC_2"][0] != whole.simulate(frame.to_numpy())["BC_2"][0]
    np.testing.assert_allclose(found.to_numpy()[:, names.index("BC_2")], expected["BC_2"], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("source", "params", "match"),
    [
        ("NARX", {"state": [1.0]}, r"state: expected 6 numbers.*got 1 numbers"),
        ("NARX", {"state": [0.0] * 6, "BC_at_rest": 3.0}, r"no level at rest beside it.*BC = 3"),
        ("NARX", {"BC_at_rest": np.inf}, r"BC_at_rest: expected a finite number, got inf"),
        ("declared states", {"BC_at_rest": 3.0}, r"BC_at_rest: this surrogate has no such parameter; expected state$"),
    ],
)
def test_a_beginning_that_cannot_be_is_refused(source: str, params: dict, match: str, tmp_path: Path) -> None:
    _, table, frame = opened(SOURCES[source](), tmp_path)
    with pytest.raises(ValueError, match=match):
        table.predict(frame, params)


@pytest.mark.parametrize("name", [*SOURCES, "committee"])
def test_a_level_is_offered_where_a_state_heeds_it(name: str, tmp_path: Path) -> None:
    source = SOURCES[name]() if name in SOURCES else build_committee(2, mean=True)
    surrogate, table, _ = opened(source, tmp_path)
    levels = table.about["initialisation"]["levels"]
    says = zip(surrogate.outputs, heeded(surrogate), strict=True)
    own = [f"{port.name}_at_rest" for port, yes in says if yes and not isinstance(levels[port.name], str)]
    assert list(rests(table.about)) == own


def test_states_that_have_to_be_searched_for_are_asked_for(tmp_path: Path) -> None:
    surrogate, table, frame = opened(GREY_BOXES["two outputs"](), tmp_path)
    u = frame.to_numpy()
    np.testing.assert_allclose(table.predict(frame).iloc[:, :2], surrogate.simulate(u), rtol=0.0, atol=1e-9)
    with pytest.raises(ValueError, match="has to be searched for"):
        table.predict(frame[1:])
    given = table.predict(frame[1:], {"state": surrogate.at_rest(u[1]).tolist()})
    np.testing.assert_allclose(given.iloc[:, :2], surrogate.simulate(u[1:]), rtol=0.0, atol=1e-9)


def test_a_column_that_lacks_is_named(tmp_path: Path) -> None:
    _, table, frame = opened(SOURCES["ARX"](), tmp_path)
    with pytest.raises(ValueError, match=r"expected the columns BP \[psi gauge\], AR \[psi gauge\]; AR .* lacks"):
        table.predict(frame.iloc[:, :1])
