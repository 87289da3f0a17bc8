"""The page as PDF, printed by a browser: the only program that draws it as readers see it.

Almost every desk has a browser of the Chromium family, which prints without a window and needs no package of ours.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Final

from sysid.atomic import replacing
from sysid.errors import ConfigError

BROWSER_VARIABLE: Final = "SYSID_BROWSER"
"""Environment variable that names a browser which is nowhere on the path."""

NAMES: Final = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "msedge",
)

PLACES: Final = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    "C:/Program Files/Google/Chrome/Application/chrome.exe",
    "C:/Program Files (x86)/Microsoft/Edge/Application/msedge.exe",
)
"""Where installers put it on systems that do not use a path."""

LIMIT_S: Final = 180.0
"""Seconds that printing may take; a page of 3 MB takes some five."""


def find_browser() -> str | None:
    """A browser of the Chromium family: the one that is named, one on the path, or one where installers put it.

    Returns:
        The program; ``None`` if there is none.
    """
    named = os.environ.get(BROWSER_VARIABLE)
    if named:
        return named
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    return found or next((place for place in PLACES if Path(place).is_file()), None)


def write_pdf(page: Path, path: Path) -> Path:
    """Print a page.

    Args:
        page: The HTML file.
        path: The PDF to write.

    Returns:
        The PDF.

    Raises:
        ConfigError: If there is no browser, or it prints nothing.
    """
    browser = find_browser()
    if browser is None:
        raise ConfigError(
            "there is no browser to print with",
            expected=f"one of {', '.join(NAMES)} on the path",
            got="none of them",
            remedy=f"install Chromium, Chrome or Edge, or name its program in the environment as {BROWSER_VARIABLE}",
        )
    with replacing(path) as draft, tempfile.TemporaryDirectory(prefix="sysid-browser-") as profile:
        draft.unlink()
        command = [
            *(browser, "--headless", "--disable-gpu", "--no-first-run", f"--user-data-dir={profile}"),
            # Root in a container has no sandbox, and without it Chromium does not start; the page is our own.
            *(["--no-sandbox"] if _root() else []),
            *("--no-pdf-header-footer", f"--print-to-pdf={draft}", page.resolve().as_uri()),
        ]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)  # noqa: S603 - our own words
        except (OSError, subprocess.TimeoutExpired) as error:
            raise _not_printed(browser, str(error)) from error
        if not draft.is_file() or draft.read_bytes()[:5] != b"%PDF-":
            raise _not_printed(browser, (done.stderr.strip().splitlines() or ["nothing was written"])[-1])
    return path


def _root() -> bool:
    return hasattr(os, "geteuid") and os.geteuid() == 0


def _not_printed(browser: str, got: str) -> ConfigError:
    return ConfigError(
        "the browser did not print the page",
        where=browser,
        expected=f"a PDF within {LIMIT_S:.0f} s",
        got=got,
        remedy=f"open the HTML and print it by hand, or name another browser in the environment as {BROWSER_VARIABLE}",
    )
