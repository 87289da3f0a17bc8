"""The pages of the documentation: their Python runs, their links lead somewhere, their names exist."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob("docs/*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"])
BLOCK = re.compile(r"^```python[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]+)\)")
NAME = re.compile(r"`(sysid(?:\.\w+)+)")


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_python_on_the_page_is_python(page: Path) -> None:
    for block in BLOCK.findall(page.read_text(encoding="utf-8")):
        ast.parse(block)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_to_files_that_are_there(page: Path) -> None:
    targets = [link for link in LINK.findall(page.read_text(encoding="utf-8")) if "://" not in link]
    assert [link for link in targets if not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_names_on_the_page_exist(page: Path) -> None:
    for dotted in NAME.findall(page.read_text(encoding="utf-8")):
        found: object = importlib.import_module("sysid")
        path = "sysid"
        for part in dotted.split(".")[1:]:
            path = f"{path}.{part}"
            found = getattr(found, part, None) or importlib.import_module(path)
        assert found is not None, dotted


def test_matlab_s_workflow_runs_as_the_page_tells_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "from-matlab.md").read_text(encoding="utf-8")
    (block,) = BLOCK.findall(page)
    names: dict[str, object] = {}
    exec(compile(block, "from-matlab.md", "exec"), names)  # noqa: S102 - our own page
    told = capsys.readouterr().out
    assert told.splitlines()[0].split() == ["free", "run,", "fit", "in", "percent", "record"]
    assert float(told.splitlines()[-1].split()[-1]) == 100.0


@pytest.mark.parametrize("word", ["narxnet", "closeloop", "trainbr", "tfest", "arx", "compare", "resid", "genFunction"])
def test_matlab_s_words_are_on_the_page(word: str) -> None:
    assert f"`{word}" in (ROOT / "docs" / "from-matlab.md").read_text(encoding="utf-8")
