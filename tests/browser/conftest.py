"""A browser to look at pages with: one that is installed, or the one that playwright has downloaded."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

playwright_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
FOLDER = Path(__file__).resolve().parents[2] / "build" / "browser"
"""Where screenshots are kept: with the output of the tests, and out of the repository."""


def browser_path() -> str | None:
    """An installed browser of the Chromium family; ``SYSID_BROWSER`` names one that is nowhere on the path."""
    named = os.environ.get("SYSID_BROWSER")
    return named or next((found for name in NAMES if (found := shutil.which(name))), None)


@pytest.fixture(scope="session")
def browser() -> Iterator[object]:
    """A headless browser; without any to be had the tests are skipped, and say what would make them run."""
    with playwright_api.sync_playwright() as playwright:
        try:
            # Rendering in the page's own process: containers seldom allow the sandbox, and the pages are ours.
            started = playwright.chromium.launch(executable_path=browser_path(), args=["--no-sandbox"])
        except playwright_api.Error as error:
            pytest.skip(f"no browser ({str(error).splitlines()[0]}): install one, or run `playwright install chromium`")
        yield started
        started.close()


@pytest.fixture
def page(browser, request: pytest.FixtureRequest) -> Iterator[object]:
    """A fresh page that accepts downloads, as wide as a desk's screen."""
    context = browser.new_context(viewport={"width": 1600, "height": 1000}, accept_downloads=True)
    # The whole suite may run beside it on two cores.
    context.set_default_timeout(90_000)
    yield context.new_page()
    context.close()


@pytest.fixture
def picture(page, request: pytest.FixtureRequest) -> Callable[..., Path]:
    """Keeps what the page shows under a name, in ``build/browser/<test>/``."""
    folder = FOLDER / request.node.name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)

    def take(name: str, *, of: object = page) -> Path:
        path = folder / f"{name}.png"
        of.screenshot(path=path)
        return path

    return take
