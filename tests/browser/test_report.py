"""Reports in a browser without a network: they ask for nothing, everybody can read them, and they print."""

from __future__ import annotations

from pathlib import Path

import html5lib
import pytest

from sysid.reporting import write_comparison, write_pdf, write_report
from sysid.reporting.pdf import BROWSER_VARIABLE

axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module", params=["report", "comparison"])
def report(request: pytest.FixtureRequest, tracked_workspace: Path) -> Path:
    """A page of each kind."""
    run = tracked_workspace / "runs" / "tank"
    return write_report(run) if request.param == "report" else write_comparison(run, run)


def test_it_opens_offline_and_asks_for_nothing(page, report: Path, picture) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    complaints: list[str] = []
    page.on("console", lambda message: complaints.append(message.text))
    page.context.set_offline(True)
    page.goto(report.as_uri())
    page.wait_for_load_state("networkidle")
    picture("page")
    assert [url for url in asked if not url.startswith("data:")] == [report.as_uri()]
    assert complaints == []
    drawn = "svg => !svg.getClientRects().length || svg.getBBox().width > 100"  # what is not shown has no size
    assert page.evaluate(f"[...document.querySelectorAll('figure svg')].every({drawn})")
    assert not page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth")


def test_axe_finds_nothing(page, report: Path) -> None:
    page.goto(report.as_uri())
    found = axe.Axe().run(page).response
    assert len(found["passes"]) > 10, "axe looked at the page"
    assert [(entry["id"], entry["nodes"][0]["html"]) for entry in found["violations"]] == []


def test_it_is_html_5_by_the_letter(report: Path) -> None:
    document = html5lib.HTMLParser(strict=True).parse(report.read_text(encoding="utf-8"))
    assert document is not None
    assert report.stat().st_size < 3_000_000


def test_it_prints(program, report: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BROWSER_VARIABLE, program)
    pdf = write_pdf(report, tmp_path / "report.pdf")
    assert pdf.read_bytes().startswith(b"%PDF-")
    assert pdf.stat().st_size > 20_000
    assert [file.name for file in tmp_path.iterdir()] == ["report.pdf"]
