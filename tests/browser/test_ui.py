"""MLflow's pages on the real server, as somebody sees them who compares fits."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from contextlib import closing
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from sysid.workbench.commands.ui import APP
from tests.browser.conftest import new_context

pytestmark = pytest.mark.browser

MAPPING = "pump -> level"
RUNS = ("ARX [2; 2; 1] · open", "NARX 2/2/5 · open", "NARX 2/2/5 · closed")
BEST, PARENT = "NARX 2/2/5 · closed", "network, open loop"
COLUMNS = ("mean_free_run_mse", "worst_free_run_mse", "mean_nrmse_fit", "mean_run_time_s", "parameters")
CASE = "VAL"
PICTURES = """[...new Map(
    [...document.querySelectorAll("img")]
        .filter(image => image.naturalWidth > 200 && image.checkVisibility())
        .map(image => [image.src, image])
).values()]"""
"""Pictures of a fit, as told from icons; MLflow holds each of them twice, once for a preview."""


@pytest.fixture(scope="module")
def address(tracked_workspace: Path) -> Iterator[str]:
    """Where ``sysid ui`` says that fits are compared."""
    command = [str(Path(sys.executable).with_name("sysid")), "ui", "--no-browser", "--port", "5210"]
    process = subprocess.Popen(command, cwd=tracked_workspace, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    with process.stdout:
        told = ""
        while not told:
            line = process.stdout.readline()
            assert line, "the server ended before it told its address"
            told = line.partition("Compare fits at ")[2].strip()
        yield told
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=30) == 0


@pytest.fixture(scope="module")
def visitor(browser, address) -> Iterator[object]:
    """One visitor for all of these tests, who leaves before the server ends.

    MLflow's ten megabytes of programs are loaded and translated once.
    """
    with closing(new_context(browser)) as context:
        yield context


@pytest.fixture
def page(visitor) -> Iterator[object]:
    with closing(visitor.new_page()) as page:
        yield page


def open_runs(page, address: str, shown: str = RUNS[0]) -> None:
    """The page that ``sysid ui`` opens, MLflow's assistant put away, which covers a quarter of it at first."""
    page.goto(address)
    page.get_by_text(shown).first.wait_for()
    close = page.get_by_role("button", name="Close").first
    if close.is_visible():
        close.click()


def test_the_page_that_opens_lists_the_fits_best_first_with_the_columns_that_matter(page, address, picture) -> None:
    open_runs(page, address)
    names = [row.inner_text() for row in page.get_by_role("link", name=re.compile(f" · {MAPPING}")).all()]
    picture("runs")
    assert names[0] == f"{BEST} · {MAPPING}"
    assert set(names) == {f"{run} · {MAPPING}" for run in RUNS}
    heads = [(head.bounding_box(), head.inner_text().strip()) for head in page.get_by_role("columnheader").all()]
    placed = sorted((box["x"], text) for box, text in heads if box is not None and text in COLUMNS)
    assert tuple(dict.fromkeys(text for _, text in placed)) == COLUMNS
    figures = [
        float(text) for text in page.locator("[role=gridcell][col-id='metrics.`mean_free_run_mse`']").all_inner_texts()
    ]
    assert len(figures) == 3
    assert figures == sorted(figures)


def test_the_bare_address_leads_to_the_fits_and_nothing_covers_them(page, address, picture) -> None:
    if not entry_points(group="mlflow.app", name=APP):
        pytest.skip("installed before it had the entry point for MLflow: make setup")
    page.goto(address.partition("#")[0])
    page.get_by_text(RUNS[0]).first.wait_for()
    picture("bare address")
    view = page.get_by_role("button", name="Fits, best first").first.bounding_box()
    assert view["x"] > 1300, "the assistant stands beside the fits"
    assert not page.get_by_text("Information about UI telemetry").first.is_visible()
    figures = page.locator("[role=gridcell][col-id='metrics.`mean_free_run_mse`']").all_inner_texts()
    assert all(len(text.replace(".", "").lstrip("0")) <= 4 for text in figures), figures


def compare(page, address: str, count: int) -> None:
    """MLflow's comparison of the first fits of its list."""
    open_runs(page, address)
    boxes = [box for box in page.locator(".ag-row input[type=checkbox]").all() if box.is_visible()]
    for box in boxes[:count]:
        box.check()
    page.get_by_role("button", name="Compare", exact=True).click()
    page.get_by_text(f"Comparing {count} Runs from 1 Experiment").wait_for()
    page.locator(".js-plotly-plot .parcoords").first.wait_for()


def test_a_comparison_of_all_kinds_of_fits_leads_to_their_outputs_over_the_target(page, address, picture) -> None:
    if not entry_points(group="mlflow.app", name=APP):
        pytest.skip("installed before it had the entry point for MLflow: make setup")
    compare(page, address, len(RUNS))
    bar = page.get_by_role("navigation", name="Outputs over the target")
    bar.wait_for()
    picture("comparison")
    assert not page.get_by_text("unknown", exact=True).first.is_visible(), "an axis that only some of them have"
    bar.get_by_role("link", name=CASE, exact=True).click()
    lines = ".js-plotly-plot .scatterlayer .trace path.js-line"
    page.wait_for_function(f"document.querySelectorAll('{lines}').length >= {2 * len(RUNS)}")
    picture("outputs over the target")
    assert page.get_by_text(f"target/{CASE} vs output/{CASE}").first.is_visible()
    widths = page.evaluate(f"[...document.querySelectorAll('{lines}')].map(line => line.getBBox().width)")
    assert min(widths) > 300, "time is the record's: all samples at one moment are one stroke"
    assert bar.count() == 0


def test_two_fits_are_compared_with_their_pictures_side_by_side(page, address, picture) -> None:
    compare(page, address, 2)
    picture("comparison")
    assert not page.get_by_text("unknown", exact=True).first.is_visible(), "an axis that only one of them has"
    assert page.get_by_text("cm²").first.is_visible(), "the unit of the errors"
    page.get_by_text(f"target and output - {CASE}.png").first.click()
    page.wait_for_function(f"{PICTURES}.length === 2")
    page.get_by_text(f"target and output - {CASE}.png").first.scroll_into_view_if_needed()
    picture("pictures")
    left, right = page.evaluate(f"{PICTURES}.map(image => image.getBoundingClientRect().toJSON())")
    assert abs(left["top"] - right["top"]) < 5.0
    assert left["right"] <= right["left"]


def test_charts_plot_at_once_and_show_the_pictures_of_every_fit(page, address, picture) -> None:
    open_runs(page, address.replace("viewState", "compareRunsMode=CHART&viewState"), shown="at a glance")
    page.locator(".js-plotly-plot .bars path, .js-plotly-plot .point").first.wait_for()
    picture("charts")
    search = page.get_by_placeholder("Search metric charts")
    search.fill(f"target and output/{CASE}")
    page.wait_for_function(f"{PICTURES}.length >= {len(RUNS)}")
    picture("pictures")
    search.fill(f"output/{CASE}")
    page.wait_for_function(f"document.querySelectorAll('.js-plotly-plot .scatterlayer .trace').length >= {len(RUNS)}")
    picture("outputs over the target")
    search.fill("learning")
    page.locator(".js-plotly-plot .scatterlayer path").first.wait_for()
    picture("learning")


def test_the_bundle_is_downloaded_from_the_fit_that_also_links_to_its_parent(
    page, address, picture, tracked_workspace, tmp_path
) -> None:
    open_runs(page, address)
    page.get_by_role("link", name=BEST).first.click()
    page.get_by_text("Description", exact=True).wait_for()
    picture("fit")
    assert page.get_by_text("tank (").first.is_visible(), "the data set and its digest"
    assert page.get_by_role("link", name=f"started from {PARENT}").is_visible()
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="bundle", exact=True).click()
    files = opened.value
    files.get_by_text("MODEL_CARD.md").wait_for()
    files.get_by_text("narx-2-2-5-closed-pump-level.zip").first.click()
    download = files.locator("button[data-component-id*=artifactview]").first
    download.wait_for()
    picture("bundle", of=files)
    with files.expect_download() as waiting:
        download.click()
    waiting.value.save_as(tmp_path / "bundle.zip")
    with zipfile.ZipFile(tmp_path / "bundle.zip") as packed:
        assert packed.testzip() is None
        assert {"model.json", "step.onnx", "sequence.onnx"} <= set(packed.namelist())
        model = (tracked_workspace / "runs" / "tank" / "bundle" / "model.json").read_bytes()
        assert packed.read("model.json") == model
