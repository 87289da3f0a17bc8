"""Which columns of a file belong together, and when columns that look alike are one record after all."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.ingest import read_table
from sysid.ingest.readers.trees.roles import role_of

LONG, SHORT = np.arange(20.0), np.arange(12.0)


def records(tmp_path: Path, arrays: dict[str, Any]) -> dict[str, Any]:
    np.savez(tmp_path / "a.npz", **arrays)
    return {record.name: dict(record.options) for record in read_table(tmp_path / "a.npz").records}


@pytest.mark.parametrize(
    ("arrays", "expected"),
    [
        (
            {"uEst": LONG, "yEst": LONG, "uVal": SHORT, "yVal": SHORT},
            {"Est": {"u": "uEst", "y": "yEst"}, "Val": {"u": "uVal", "y": "yVal"}},
        ),
        ({"est_u": LONG, "val_u": LONG}, {"est": {"u": "est_u"}, "val": {"u": "val_u"}}),
        ({"utrain": LONG, "utest": SHORT}, {"train": {"u": "utrain"}, "test": {"u": "utest"}}),
        ({"ue": LONG, "uv": SHORT}, {"estimation": {"u": "ue"}, "validation": {"u": "uv"}}),
        ({"u1": LONG, "u2": SHORT}, {"record_1": {"u": "u1"}, "record_2": {"u": "u2"}}),
        (
            {"zEst": np.column_stack([LONG, LONG]), "zVal": np.column_stack([SHORT, SHORT])},
            {"Est": {"z_1": "zEst_1", "z_2": "zEst_2"}, "Val": {"z_1": "zVal_1", "z_2": "zVal_2"}},
        ),
        (
            {"ze": np.column_stack([LONG, LONG]), "zv": np.column_stack([LONG, LONG])},
            {"estimation": {"z_1": "ze_1", "z_2": "ze_2"}, "validation": {"z_1": "zv_1", "z_2": "zv_2"}},
        ),
        (
            {"t1e": LONG, "s2e": LONG, "i3se": LONG, "t1v": LONG, "s2v": LONG, "i3sv": LONG, "Ts": 0.01},
            {
                "estimation": {"t1": "t1e", "s2": "s2e", "i3s": "i3se"},
                "validation": {"t1": "t1v", "s2": "s2v", "i3s": "i3sv"},
            },
        ),
    ],
    ids=["uEst", "est_u", "utrain", "ue", "u1", "matrices", "ze", "three of both"],
)
def test_a_word_in_the_name_tells_records_apart(
    tmp_path: Path, arrays: dict[str, Any], expected: dict[str, dict[str, str]]
) -> None:
    assert {name: options["columns"] for name, options in records(tmp_path, arrays).items()} == expected


@pytest.mark.parametrize(
    "arrays",
    [
        {"u1": LONG, "u2": LONG, "y": LONG},
        {"value": LONG, "valve": LONG},
        {"u_est": LONG, "y_val": LONG},
        {"ue": LONG, "uv": LONG},
        {"ie": LONG, "iv": LONG, "te": LONG, "tv": LONG},
        {"u": LONG, "y": LONG, "extra": SHORT},
    ],
    ids=["numbers", "words in words", "other stems", "letters", "two with letters", "another length"],
)
def test_columns_that_only_look_alike_are_one_record(tmp_path: Path, arrays: dict[str, Any]) -> None:
    assert records(tmp_path, arrays) == {}


def groups(tmp_path: Path, **members: dict[str, Any]) -> list[object]:
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        for group, columns in members.items():
            for name, values in columns.items():
                file[f"{group}/{name}"] = values
    return [record.options["group"] for record in read_table(tmp_path / "a.h5").records]


def test_groups_with_the_same_columns_are_records_where_they_cannot_be_one(tmp_path: Path) -> None:
    same, short = {"p": LONG, "T": LONG}, {"p": SHORT, "T": SHORT}
    assert groups(tmp_path, front=same, rear=short) == ["front", "rear"]
    assert groups(tmp_path, run1=same, run2=same) == ["run1", "run2"]
    assert groups(tmp_path, front=same | {"t": LONG}, rear=same | {"t": LONG + 5.0}) == ["front", "rear"]


def test_groups_that_one_clock_stamped_are_places_of_one_record(tmp_path: Path) -> None:
    same = {"p": LONG, "T": LONG}
    assert groups(tmp_path, front=same, rear=same) == []
    assert groups(tmp_path, front=same | {"t": LONG}, rear=same | {"t": LONG}) == []
    assert groups(tmp_path, run1=same, run2={"p": LONG, "q": LONG}) == []


@pytest.mark.parametrize(
    ("name", "role"),
    [("id", "estimation"), ("run_val", "validation"), ("TestData", "test"), ("valve", None), ("record_1", None)],
)
def test_a_word_says_the_role(name: str, role: str | None) -> None:
    assert role_of(name) == role


def test_a_torque_is_no_clock_whatever_it_is_called(tmp_path: Path) -> None:
    """Held levels step back but now and then; they were taken for stamps, and sorted."""
    torque = np.repeat(np.random.default_rng(0).uniform(-3.0, 3.0, 40), 10)
    rows = "".join(f"{u},{2 * u}\n" for u in torque.tolist())
    (tmp_path / "rig.csv").write_text("t [N*m],y [rad/s]\n" + rows)
    table = read_table(tmp_path / "rig.csv")
    assert table.time is None
    np.testing.assert_array_equal(table.find("t").values, torque)


def test_a_temperature_is_no_clock(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", T=20.0 + np.sin(LONG), u=LONG)
    assert read_table(tmp_path / "a.npz").time is None
    np.savez(tmp_path / "a.npz", T=20.0 + np.sin(LONG), t=LONG)
    assert read_table(tmp_path / "a.npz").time == "t"
    np.savez(tmp_path / "a.npz", T=0.1 * LONG, u=LONG)
    assert read_table(tmp_path / "a.npz").time == "T"


def test_records_of_one_json_file_are_parsed_once_until_it_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from sysid.ingest.readers import json_tree

    parsed, plain = list[str](), json_tree._content

    def counted(text: str) -> Any:
        parsed.append(text)
        return plain(text)

    monkeypatch.setattr(json_tree, "_content", counted)
    file = tmp_path / "a.json"
    for last in (1, 2):
        file.write_text(json.dumps({"u": [1, 2, last], "padding": "x" * last}))
        for _ in range(3):
            assert read_table(file).find("u").values[-1] == last
        assert len(parsed) == last
