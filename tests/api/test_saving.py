"""Saved fits: their cards have figures, and they stand beside fits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sysid
from sysid.traces import Role

U = np.repeat([0.0, 1.0, -1.0, 0.5, 0.0], 40)
Y = np.convolve(U, 0.2 * 0.8 ** np.arange(60))[:200] + 0.01 * np.sin(17.0 * np.arange(200))
FRAME = pd.DataFrame({"u": U, "y": Y, "z": 2.0 * Y + 1.0})
ORDERS = sysid.ARX(na=1, nb=1, nk=0)


@pytest.fixture(scope="module")
def fit() -> sysid.Fit:
    traces = sysid.data(FRAME, inputs="u", outputs="y", sample_time=0.1, split=0.6)
    return sysid.fit(traces, "u -> y", ORDERS)


@pytest.fixture(scope="module")
def system() -> sysid.SystemFit:
    traces = sysid.data(FRAME, inputs="u", outputs=["y", "z"], sample_time=0.1, split=0.6)
    return sysid.fit(traces, "u -> y+z", ORDERS)


def card(folder: Path) -> str:
    return (folder / "MODEL_CARD.md").read_text("utf-8")


@pytest.mark.parametrize("name", ["fit", "system"])
def test_a_saved_fit_has_the_figures_of_its_comparison(name: str, request, tmp_path: Path) -> None:
    one = request.getfixturevalue(name)
    bundle = one.save(tmp_path / "b", formats=())
    expected = sysid.compare(one.traces, one).to_frame()
    for _, row in expected.iterrows():
        case = bundle.metadata["metrics"][row["case"]]
        found = case["outputs"][row["output"]] if "outputs" in case else case
        assert found["free_run"]["nrmse_fit"] == row["fit"]
        assert found["begins_at"] == one.traces[row["case"]].values.shape[0] // 5
    text = card(tmp_path / "b")
    assert "The initial state is estimated on the first 16 to 24 samples, which are not scored." in text
    assert bundle.metadata["cases_start"]["kind"] == "estimated"
    again = sysid.compare(one.traces, one, sysid.read_bundle(tmp_path / "b")).to_frame()
    half = len(again) // 2
    assert half == len(expected)
    np.testing.assert_array_equal(again["fit"][:half], again["fit"][half:])


def test_the_same_fit_gives_the_same_bytes(fit: sysid.Fit, tmp_path: Path) -> None:
    cards = []
    for name in ("a", "b"):
        fit.save(tmp_path / name, formats=())
        cards.append(card(tmp_path / name))
    assert cards[0] == cards[1]
    assert "Not measured when this bundle was written." in cards[0]


def test_further_records_are_scored_and_declare_nothing(fit: sysid.Fit, tmp_path: Path) -> None:
    further = sysid.data(FRAME[["u", "y"]] * 3.0, inputs="u", outputs="y", sample_time=0.1, name="more")
    bundle = fit.save(tmp_path / "b", further, formats=())
    assert [(name, case["role"]) for name, case in bundle.metadata["metrics"].items()] == [
        ("estimation", "estimation"), ("validation", "validation"), ("record", Role.VALIDATION.value)
    ]  # fmt: skip
    assert bundle.inputs[0]["range"] == [-1.0, 1.0]
    same = fit.save(tmp_path / "b", fit.traces, formats=())
    assert list(same.metadata["metrics"]) == ["estimation", "validation"]
    renamed = sysid.data(FRAME[["u", "y"]] * 2.0, inputs="u", outputs="y", sample_time=0.1, split=0.5)
    assert "validation (2)" in fit.save(tmp_path / "b", renamed, formats=()).metadata["metrics"]


def test_a_pair_of_the_samples_before_is_the_same_to_a_system_and_to_its_bundle(
    system: sysid.SystemFit, tmp_path: Path
) -> None:
    bundle = system.save(tmp_path / "b", formats=())
    pair = (U[:50], FRAME[["y", "z"]][:50])
    np.testing.assert_array_equal(system.simulate(U[50:], initial=pair), bundle.simulate(U[50:], initial=pair))


@pytest.mark.parametrize(
    ("formats", "has", "lacks"),
    [((), "`verify/` holds records", "verify.py"), (("c",), "compile `verify/verify.c`", "verify.py")],
)
def test_a_card_names_the_programs_that_are_there(
    fit: sysid.Fit, tmp_path: Path, formats: tuple[str, ...], has: str, lacks: str
) -> None:
    fit.save(tmp_path / "b", formats=formats)
    text = card(tmp_path / "b")
    assert has in text and lacks not in text


def test_a_card_without_figures_says_how_to_have_them(system: sysid.SystemFit, tmp_path: Path) -> None:
    from sysid.export import export_bundle

    traces = sysid.data(FRAME, inputs="u", outputs=[], sample_time=0.1)
    bundle = export_bundle(system.model, traces, tmp_path / "b", formats=[])
    assert bundle.metadata["metrics"] is None
    assert "`fit.save(folder, traces)`" in card(tmp_path / "b")
