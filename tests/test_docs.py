"""The pages of the documentation: their Python runs, their links lead somewhere, their names exist."""

from __future__ import annotations

import ast
import importlib
import os
import re
import runpy
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.parse import unquote

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob("docs/**/*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"])
BLOCK = re.compile(r"^```python[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"^```python (\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
CELL = re.compile(r"^```\{code-cell\} ipython3\n(?::\w[^\n]*\n)*(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]*)(#[^)\s]+)?\)")
SITE_LINK = re.compile(r'(?:href|src)="(?!\w+:|//)([^"#?]+)')
HEADING = re.compile(r"^#{1,3} (.+)$", re.MULTILINE)
FENCED = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
NAME = re.compile(r"`(sysid(?:\.\w+)+)")


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_python_on_the_page_is_python(page: Path) -> None:
    for block in BLOCK.findall(page.read_text(encoding="utf-8")):
        ast.parse(block)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_to_files_that_are_there(page: Path) -> None:
    targets = [link for link, _ in LINK.findall(page.read_text(encoding="utf-8")) if "://" not in link]
    assert [link for link in targets if not (page.parent / link).exists()] == []


def anchors_of(page: Path) -> set[str]:
    """What its headings are called in an address, as GitHub and the site call them."""
    headings = HEADING.findall(FENCED.sub("", page.read_text(encoding="utf-8")))
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_into_a_page_lead_to_its_headings(page: Path) -> None:
    links = LINK.findall(FENCED.sub("", page.read_text(encoding="utf-8")))
    into = [(page.parent / link if link else page, anchor) for link, anchor in links if anchor and "://" not in link]
    assert [(name, at) for name, at in into if name.suffix == ".md" and at[1:] not in anchors_of(name)] == []


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


LONG = {"sweep", "fmu-surrogate"}
"""Notebooks that run a whole pipeline, with its report, or compile an FMU twice."""
GALLERY = [
    pytest.param(page, id=name_of(page), marks=[pytest.mark.slow] if page.stem in LONG else [])
    for page in sorted(ROOT.glob("docs/gallery/*.md"))
]


@pytest.mark.parametrize("page", GALLERY)
def test_a_notebook_of_the_gallery_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.chdir(page.parent)
    names: dict[str, object] = {}
    for cell in CELL.findall(page.read_text(encoding="utf-8")):
        exec(compile(cell, page.name, "exec"), names)  # noqa: S102 - our own page


def blocks_of(page: str) -> list[tuple[str, str]]:
    return NAMED.findall((ROOT / "docs" / page).read_text(encoding="utf-8"))


@pytest.mark.parametrize(("name", "block"), blocks_of("python.md"), ids=[name for name, _ in blocks_of("python.md")])
def test_an_example_of_the_python_page_runs_in_a_few_lines(
    name: str, block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert len([line for line in block.splitlines() if line.strip()]) <= 9, "eight lines, and what is imported"
    exec(compile(block, name, "exec"), {})  # noqa: S102 - our own page
    assert (tmp_path / Path(name).stem / "model.json").is_file()


NEIGHBOURS = {"from-sysidentpy.md", "from-jax-sysid.md"}
TASKS = [page for page in PAGES if page.parent.name == "how" or page.name in NEIGHBOURS]


@pytest.mark.parametrize(
    ("name", "block"), [pytest.param(*pair, id=pair[0]) for page in TASKS for pair in blocks_of(str(page))]
)
def test_an_example_of_a_task_runs(
    name: str, block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(block, name, "exec"), {})  # noqa: S102 - our own page
    assert capsys.readouterr().out.strip()


def test_the_example_of_linear_models_runs(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, object] = {}
    for name, block in blocks_of("linear-models.md"):
        exec(compile(block, name, "exec"), names)  # noqa: S102 - our own page
    told = capsys.readouterr().out.splitlines()
    assert [line.split("  ")[0] for line in told[1:3]] == ["SS 3", "BJ [2; 1; 1; 2; 1]"]
    assert all(float(line.split()[-1]) > 80.0 for line in told[1:3])
    low, high = ast.literal_eval(told[-1])["B(u, 1)"]
    assert low < 0.1 < high < 0.12


def test_the_examples_of_composites_run_one_after_the_other(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, object] = {}
    for name, block in blocks_of("composites.md"):
        exec(compile(block, name, "exec"), names)  # noqa: S102 - our own page
    told = capsys.readouterr().out.splitlines()
    assert [line.split("  ")[0] for line in told[:3]] == ["each alone", "chosen together", "trained end to end"]
    assert float(told[3].split()[-2]) < 0.2
    assert told[-3].startswith("0 diverge")
    assert told[-2].startswith("in doubt: ")
    assert 0.0 < float(told[-1].removeprefix("they are ").split()[0]) < 0.2


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    """But for the pages of highlighted source, a third of the time, which no page of ours is made from."""
    extensions = runpy.run_path(str(ROOT / "docs" / "conf.py"))["extensions"]
    kept = ",".join(name for name in extensions if name != "sphinx.ext.viewcode")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "-D", f"extensions={kept}"]
    command += ["-d", str(tmp_path / "trees"), str(ROOT / "docs"), str(tmp_path / "html")]
    environment = {**os.environ, "SYSID_NOTEBOOKS": "off"}
    done = subprocess.run(command, check=False, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "html" / "gallery" / "tanks.html").is_file()
    names = ("get-started", "measured/linear-models", "search")
    pages = "".join((tmp_path / "html" / f"{name}.html").read_text(encoding="utf-8") for name in names)
    ours = runpy.run_path(str(ROOT / "docs" / "conf.py"))["ACCESSIBLE"].values()
    assert [one for one in ours if one not in pages] == [], "what axe-core finds is put right in the theme's own words"
    assert lost_links(tmp_path / "html") == []
    assert 'href="reports/service-cascade-grown/README.html"' in (tmp_path / "html" / "brake.html").read_text("utf-8")


def lost_links(site: Path) -> list[str]:
    """Links and pictures of a built site that lead to no file of it."""
    found = ((page, to) for page in site.rglob("*.html") for to in SITE_LINK.findall(page.read_text(encoding="utf-8")))
    return [f"{page.relative_to(site)}: {to}" for page, to in found if not (page.parent / unquote(to)).exists()]


@pytest.mark.parametrize("word", ["narxnet", "closeloop", "trainbr", "tfest", "arx", "compare", "resid", "genFunction"])
def test_matlab_s_words_are_on_the_page(word: str) -> None:
    assert f"`{word}" in (ROOT / "docs" / "from-matlab.md").read_text(encoding="utf-8")


def test_every_field_of_the_yaml_has_an_example(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT / "docs" / "reference")
    (cell,) = CELL.findall(Path("pipelines.md").read_text(encoding="utf-8"))
    names: dict[str, object] = {}
    exec(compile(cell, "pipelines.md", "exec"), names)  # noqa: S102 - our own page
    fields = [line.split(" | ") for part in names["text"] for line in part.splitlines() if line.startswith("| `")]
    assert len(fields) > 300
    assert [field[0] for field in fields if not field[3].strip()] == []
