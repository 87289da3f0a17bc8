"""A browser to look at pages with: one that is installed, or the one that playwright has downloaded."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from sysid.reporting.pdf import find_browser
from sysid.workbench.cli import run_cli

playwright_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

FOLDER = Path(__file__).resolve().parents[2] / "build" / "browser"
"""Where screenshots are kept: with the output of the tests, and out of the repository."""


@pytest.fixture(scope="session")
def browser() -> Iterator[object]:
    """A headless browser; without any to be had the tests are skipped, and say what would make them run."""
    with playwright_api.sync_playwright() as playwright:
        try:
            # Rendering in the page's own process: containers seldom allow the sandbox, and the pages are ours.
            program = find_browser() or playwright.chromium.executable_path
            started = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        except playwright_api.Error as error:
            pytest.skip(f"no browser ({str(error).splitlines()[0]}): install one, or run `playwright install chromium`")
        yield started
        started.close()


@pytest.fixture(scope="session")
def program(browser) -> str:
    """The browser as a program."""
    return find_browser() or str(browser.browser_type.executable_path)


def new_context(browser) -> object:
    """A visitor who accepts downloads, with pages as wide as a desk's screen."""
    context = browser.new_context(viewport={"width": 1600, "height": 1000}, accept_downloads=True)
    # The whole suite may run beside it on two cores.
    context.set_default_timeout(90_000)
    return context


@pytest.fixture
def page(browser) -> Iterator[object]:
    """The page of somebody who was never here."""
    with closing(new_context(browser)) as context:
        yield context.new_page()


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


@pytest.fixture(scope="session")
def tracked_workspace(browser, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A new user's workspace after their first run: three fits, the best of them exported."""
    workspace = tmp_path_factory.mktemp("seen") / "mine"
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        assert run_cli(["init", str(workspace)]) == 0
        patch.chdir(workspace)
        assert run_cli(["run", "tank"]) == 0
    return workspace
