"""Printing: which browser is taken, and what is said where there is none or it fails."""

from __future__ import annotations

import shutil
import stat
from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.reporting import pdf


@pytest.fixture
def page(tmp_path: Path) -> Path:
    path = tmp_path / "page.html"
    path.write_text("<!DOCTYPE html><title>a</title>", encoding="utf-8")
    return path


def script(folder: Path, body: str) -> str:
    """A stand-in for a browser."""
    file = folder / "browser"
    file.write_text(f"#!/bin/sh\n{body}\n", encoding="utf-8")
    file.chmod(file.stat().st_mode | stat.S_IXUSR)
    return str(file)


def test_the_browser_that_is_named_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(pdf.BROWSER_VARIABLE, "/opt/mine/chrome")
    assert pdf.find_browser() == "/opt/mine/chrome"


def test_without_a_browser_it_says_what_to_install(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(pdf.BROWSER_VARIABLE, raising=False)
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setattr(pdf, "PLACES", ())
    with pytest.raises(ConfigError, match=r"(?s)no browser to print with.*install Chromium, Chrome or Edge"):
        pdf.write_pdf(page, tmp_path / "page.pdf")
    assert not (tmp_path / "page.pdf").exists()


@pytest.mark.parametrize(
    ("body", "got"),
    [
        pytest.param("echo 'no display' >&2; exit 1", "no display", id="fails"),
        pytest.param("exit 0", "nothing was written", id="writes-nothing"),
    ],
)
def test_a_browser_that_prints_nothing_is_named_with_its_last_words(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, body: str, got: str
) -> None:
    monkeypatch.setenv(pdf.BROWSER_VARIABLE, script(tmp_path, body))
    with pytest.raises(ConfigError, match=rf"(?s)did not print the page.*{got}.*print it by hand"):
        pdf.write_pdf(page, tmp_path / "page.pdf")
    assert not (tmp_path / "page.pdf").exists()


def test_what_is_printed_takes_its_place(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    body = """
    for word in "$@"; do
        case "$word" in --print-to-pdf=*) printf "%%PDF-1.4" > "${word#--print-to-pdf=}";; esac
    done
    """
    monkeypatch.setenv(pdf.BROWSER_VARIABLE, script(tmp_path, body))
    assert pdf.write_pdf(page, tmp_path / "page.pdf").read_bytes() == b"%PDF-1.4"
