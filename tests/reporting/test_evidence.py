"""The sections that show why a model may be believed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

from sysid.errors import ConfigError
from sysid.estimation import FitResult, fit_arx
from sysid.models import ARX, Mapping
from sysid.models.blocks.curve_values import CurvePoints
from sysid.reporting import read_results, write_report
from sysid.reporting.curves import read_curves
from sysid.reporting.figures.linear_figures import bode_figure, pole_zero_figure, step_figure
from sysid.reporting.figures.residual_figure import residual_figure
from sysid.reporting.frequency import FrequencyUnit
from sysid.reporting.linear.computing import bode_of, step_of
from sysid.reporting.linear_views import linear_views
from sysid.reporting.parts import Picture
from sysid.reporting.residuals import read_residuals
from sysid.reporting.sections.evidence import _models, evidence_sections
from sysid.reporting.tables import Table
from sysid.traces import Trace
from sysid.validation import analyse_residuals
from sysid.workbench.fits.record import write_curves
from tests.estimation.linear_systems import steps, trace_of

LINEARITY = {
    "answer": "NETWORK",
    "text": "Linear is not enough <here>.",
    "rows": [
        {
            "amplitude": "full",
            "cases": ["VAL01", "VAL02"],
            "linear": "ARX",
            "linear_fit": 61.25,
            "network": "NARX free run",
            "network_fit": 98.5,
        }
    ],
}


def arx() -> tuple[FitResult, Trace]:
    rng = np.random.default_rng(0)
    u = steps(800, 2, rng)
    y = signal.lfilter([0.0, 1.0], [1.0, -1.5, 0.7], u[:, 0]) + signal.lfilter([0.0, 0.5], [1.0, -1.5, 0.7], u[:, 1])
    noisy = trace_of(u, y + signal.lfilter([1.0], [1.0, -1.5, 0.7], 0.1 * rng.normal(size=800)))
    orders = ARX(na=2, nb=(2, 1), nk=(1, 1), intercept=True)
    return fit_arx([noisy], Mapping.parse("u1+u2 -> y"), orders, rest_output=0.0), noisy


@pytest.fixture
def run(make_run: Callable[..., Path], tmp_path: Path) -> Path:
    """A run of an ARX model and a network, with a verdict, a stored model and its residuals."""

    def edit(document: dict[str, Any]) -> None:
        document["linearity"] = LINEARITY

    folder = make_run(tmp_path / "run", samples=200, names=("ARX", "NARX free run"), edit=edit)
    fit, trace = arx()
    analysis = analyse_residuals(fit.model, [trace]).to_dict()
    groups = {
        "estimation": {"cases": ["EST01"], "analysis": analysis, "reason": ""},
        "unseen": {"cases": ["VAL01"], "analysis": None, "reason": "too short"},
    }
    (folder / "fits" / "arx" / "fit.json").write_text(json.dumps(fit.to_dict()))
    (folder / "fits" / "arx" / "residuals.json").write_text(json.dumps({"groups": groups}))
    return folder


def test_the_sections_show_what_the_run_stored(run: Path) -> None:
    enough, left, response = evidence_sections(run, read_results(run))
    assert (enough.anchor, left.anchor, response.anchor) == ("linearity", "residuals", "frequency-response")
    text, table = enough.parts
    assert text == LINEARITY["text"]
    assert isinstance(table, Table)
    assert [cell.value for cell in table.rows[0] if cell.value is not None] == [61.25, 98.5]
    rows = left.parts[0].rows
    assert rows[0][4].text == "white"
    assert rows[0][5].text == "independent"
    assert rows[1][2].text == "not analysed"
    assert rows[1][2].below == "too short"
    picture = left.parts[1]
    assert isinstance(picture, Picture)
    assert "White at 99 %" in picture.caption
    assert "Independent of every past input" in picture.caption
    *pictures, poles = response.parts
    assert [part.caption.partition(":")[0] for part in pictures] == ["ARX, ARX [2; 2 2; 1 1]", "ARX", "ARX"]
    assert isinstance(poles, Table)
    (pair,) = poles.rows
    low, high = (float(end) for end in pair[2].below.strip("()").split(" to "))
    assert low < abs(np.log(0.75 + 0.3708j)) < high  # of z^2 - 1.5 z + 0.7, every second


def test_one_model_of_several_outputs_is_drawn_once(run: Path) -> None:
    """It was drawn for each of its outputs, with all pairs every time, under the name of one output."""
    fit = read_results(run).fits[0]
    parts = [
        fit.model_copy(update={"name": f"SS, {y}", "slug": f"ss-{y}", "system": "SS", "model_slug": "ss"}) for y in "ab"
    ]
    own = [
        fit.model_copy(update={"name": f"TF, {y}", "slug": f"tf-{y}", "system": "TF", "model_slug": f"tf-{y}"})
        for y in "ab"
    ]
    assert [(one.name, one.slug) for one in _models([*parts, *own])] == [
        ("SS", "ss"), ("TF, a", "tf-a"), ("TF, b", "tf-b"),
    ]  # fmt: skip


def test_a_linear_model_that_no_input_moves_has_no_frequency_response(run: Path) -> None:
    _, trace = arx()
    fit = fit_arx([trace], Mapping.parse("u1+u2 -> y"), ARX(na=1, nb=(0, 0), nk=(1, 1)), rest_output=0.0)
    (run / "fits" / "arx" / "fit.json").write_text(json.dumps(fit.to_dict()))
    assert [one.anchor for one in evidence_sections(run, read_results(run))] == ["linearity", "residuals"]


@pytest.mark.usefixtures("undrawn")
def test_they_are_on_the_page_escaped_and_listed(run: Path) -> None:
    page = write_report(run).read_text(encoding="utf-8")
    for title in ("Is linear enough?", "Residuals", "Frequency response"):
        assert f">{title}</a>" in page
        assert f">{title}</h2>" in page
    assert "Linear is not enough &lt;here&gt;." in page


def test_static_curves_are_shown_with_what_they_stand_for(run: Path) -> None:
    x = np.linspace(-1.0, 1.0, 9)
    curve = CurvePoints(
        title="u: saturation", before="u [V]", behind="into the block, scaled",
        x=x, y=np.clip(x, -0.5, 0.5), edges=np.array([-1.0, 0.0, 1.0]), counts=np.array([5.0, 4.0]),
    )  # fmt: skip
    write_curves(run / "fits" / "arx", {"curves": [curve.to_dict()]})
    (section,) = [one for one in evidence_sections(run, read_results(run)) if one.anchor == "curves"]
    (shown,) = section.parts
    assert isinstance(shown, Picture)
    assert "Beyond the samples a curve is a guess." in shown.caption
    (read,) = read_curves(run / "fits" / "arx")
    assert read.to_dict() == curve.to_dict()
    write_curves(run / "fits" / "arx", None)  # another structure came in its place
    assert read_curves(run / "fits" / "arx") == []


def test_a_run_that_stored_none_has_none(run_folder: Path) -> None:
    assert evidence_sections(run_folder, read_results(run_folder)) == []


@pytest.mark.parametrize("name", ["fit.json", "residuals.json", "curves.json"])
@pytest.mark.parametrize(
    "content",
    [
        "",
        "[]",
        '{"groups": 1, "model": 2}',
        '{"curves": [{"title": "", "before": "", "behind": "", "x": [1], "y": [], "edges": [0], "counts": []}]}',
    ],
    ids=["empty", "a list", "wrong types", "a point without a value"],
)
def test_damage_is_refused_with_the_file(run: Path, name: str, content: str) -> None:
    (run / "fits" / "arx" / name).write_text(content)
    with pytest.raises(ConfigError, match=r"cannot be read|are damaged") as refusal:
        evidence_sections(run, read_results(run))
    assert refusal.value.where == run / "fits" / "arx" / name


def test_the_residual_picture_marks_what_lies_outside_its_bounds(run: Path) -> None:
    analysis = read_residuals(run / "fits" / "arx")["estimation"].analysis
    assert analysis is not None
    figure = residual_figure({"estimation": analysis})
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["with itself", "with u1", "with u2"]
    for axes, correlation in zip(figure.axes, (analysis.whiteness, *analysis.inputs), strict=True):
        _, inside, outside = axes.lines
        assert np.all(np.abs(inside.get_ydata()) <= correlation.bound)
        assert np.all(np.abs(outside.get_ydata()) > correlation.bound)
        assert len(inside.get_ydata()) + len(outside.get_ydata()) == len(correlation.values)


def test_pictures_of_an_arx_model_are_those_of_its_transfer_function() -> None:
    fit, _ = arx()
    system = fit.model.to_control()
    bode = bode_figure(bode_of([(fit.model, fit.uncertainty)], points=50), FrequencyUnit.RADIANS)
    for j in range(2):
        frequency, gain = bode.axes[j].lines[0].get_data()
        expected = np.abs(system[0, j](np.exp(1j * np.asarray(frequency) * fit.model.sample_time)))
        np.testing.assert_allclose(gain, expected, rtol=1e-9)
    poles = pole_zero_figure(linear_views(fit.model, fit.uncertainty)).axes[0].lines[1].get_xdata()
    np.testing.assert_allclose(np.sort(poles), np.sort(fit.model.poles.real))
    step = step_figure(step_of([(fit.model, fit.uncertainty)], samples=100)).axes[0]
    band = step.collections[0].get_paths()[0].vertices[:, 1]
    final = step.lines[0].get_ydata()[-1]
    assert final == pytest.approx(system[0, 0](1.0).real, rel=1e-3)
    assert band.max() > final
