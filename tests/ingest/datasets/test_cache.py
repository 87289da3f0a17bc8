"""The cache of generated traces: exact, and never trusted when damaged."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from sysid.ingest import TraceCache, content_key, default_cache_folder
from sysid.traces import Channel, Trace
from sysid.units import Reference

TRACE = Trace(
    name="A/B: ü",
    sample_time=0.1,
    start_time=-1.7,
    channels=(
        Channel(name="p", unit="psi", reference=Reference.GAUGE, description="pipe"),
        Channel(name="u", unit="1"),
    ),
    values=np.random.default_rng(3).normal(size=(30, 2)),
    usable=np.arange(30) % 7 != 0,
    provenance=("made", "for a test"),
)


def everything(trace: Trace) -> tuple[object, ...]:
    return (trace.digest, trace.name, trace.channels, trace.provenance, trace.usable is None)


def test_a_trace_comes_back_as_it_was(tmp_path: Path) -> None:
    cache = TraceCache(folder=tmp_path / "cache")
    assert cache.load("k") is None
    cache.store("k", TRACE)
    loaded = cache.load("k")
    assert loaded is not None
    assert everything(loaded) == everything(TRACE)
    assert sorted(path.name for path in (tmp_path / "cache" / "traces").iterdir()) == ["k.json", "k.npz"]


@given(
    arrays(
        np.float64,
        array_shapes(min_dims=2, max_dims=2, max_side=5),
        elements=st.floats(allow_nan=False, allow_infinity=False),
    )
)
def test_every_value_comes_back_bit_for_bit(tmp_path_factory: pytest.TempPathFactory, values: np.ndarray) -> None:
    channels = tuple(Channel(name=str(i), unit="1") for i in range(values.shape[1]))
    trace = Trace(name="x", sample_time=1.0, channels=channels, values=values)
    cache = TraceCache(folder=tmp_path_factory.mktemp("cache"))
    cache.store("k", trace)
    loaded = cache.load("k")
    assert loaded is not None
    assert loaded.values.tobytes() == trace.values.tobytes()


def flip_a_value(npz: Path, sidecar: Path) -> None:
    raw = bytearray(npz.read_bytes())
    raw[len(raw) // 2] ^= 1
    npz.write_bytes(bytes(raw))


def cut_short(npz: Path, sidecar: Path) -> None:
    npz.write_bytes(npz.read_bytes()[:100])


def change_the_sidecar(npz: Path, sidecar: Path) -> None:
    head = json.loads(sidecar.read_text())
    head["trace"]["sample_time"] = 0.2
    sidecar.write_text(json.dumps(head))


def pickle_instead(npz: Path, sidecar: Path) -> None:
    with npz.open("wb") as file:
        np.savez(file, values=np.array([{"a": 1}], dtype=object))


DAMAGES: dict[str, Callable[[Path, Path], object]] = {
    "a bit of the samples": flip_a_value,
    "samples cut short": cut_short,
    "samples missing": lambda npz, _: npz.unlink(),
    "sidecar missing": lambda _, sidecar: sidecar.unlink(),
    "sidecar changed": change_the_sidecar,
    "sidecar not JSON": lambda _, sidecar: sidecar.write_text("{"),
    "sidecar of another kind": lambda _, sidecar: sidecar.write_text("[1, 2]"),
    "sidecar without digest": lambda _, sidecar: sidecar.write_text("{}"),
    "a pickle in place of samples": pickle_instead,
    "empty files": lambda npz, sidecar: (npz.write_bytes(b""), sidecar.write_bytes(b"")),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_entry_is_not_trusted(tmp_path: Path, damage: Callable[[Path, Path], object]) -> None:
    cache = TraceCache(folder=tmp_path)
    cache.store("k", TRACE)
    damage(tmp_path / "traces" / "k.npz", tmp_path / "traces" / "k.json")
    assert cache.load("k") is None
    cache.store("k", TRACE)
    loaded = cache.load("k")
    assert loaded is not None
    assert everything(loaded) == everything(TRACE)


def test_a_folder_that_cannot_be_written_to_loses_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "file").write_text("in the way")
    TraceCache(folder=tmp_path / "file").store("k", TRACE)
    assert "was not cached" in caplog.text


def test_the_key_covers_content_not_order() -> None:
    assert content_key({"a": [1, 2.5], "b": {"c": "d", "e": None}}) == content_key(
        {"b": {"e": None, "c": "d"}, "a": [1, 2.5]}
    )
    keys = {content_key(c) for c in ({"a": 1}, {"a": 1.5}, {"a": "1"}, {"b": 1}, {"a": [1]}, {"a": None}, {})}
    assert len(keys) == 7


def test_the_folder_follows_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path))
    assert default_cache_folder() == tmp_path
    monkeypatch.delenv("SYSID_CACHE")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert default_cache_folder() == tmp_path / ".cache" / "sysid"
