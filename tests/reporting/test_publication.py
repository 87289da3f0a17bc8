"""A published report: everything that a reader checks stands in it, and it is small."""

from __future__ import annotations

import errno
import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sysid.errors import ConfigError
from sysid.reporting import publish_run, read_results
from sysid.reporting.judging.results import JudgementResults, SubjectRecord, parse_judgement
from sysid.reporting.judging.tables import judgement_headline
from sysid.reporting.markdown import MARK
from sysid.reporting.records import RESULTS_FILE, DataSetRecord, write_record

PAIR = ("ARX", "NARX free run")


@pytest.fixture(scope="module")
def page(make_run: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The run's folder and the page."""

    def commit(document: dict[str, Any]) -> None:
        document["environment"]["commit"] = "9ffa098c3f1e6bb0c6f3f1d5c7f1a2b3c4d5e6f7"

    folder = make_run(tmp_path_factory.mktemp("run") / "tank", samples=400, names=PAIR, edit=commit)
    return folder, publish_run(folder, tmp_path_factory.mktemp("reports"))


def test_commit_seed_machine_date_and_both_commands_are_stated(page: tuple[Path, Path]) -> None:
    folder, path = page
    text, results = path.read_text(encoding="utf-8"), read_results(folder)
    assert path.name == "README.md"
    assert path.parent.name == results.pipeline
    for words in (
        f"| run | `{results.command}` |",
        f"| published | `sysid publish {folder} --as {results.pipeline}` |",
        f"| seed | {results.seed} |",
        f"| commit | {results.environment['commit']} |",
        f"| machine | {results.environment['cpu']}, ",
        results.data.digest,
    ):
        assert words in text
    assert re.search(r"\| date \| \d+ [A-Z][a-z]+ \d{4}, ", text)


def test_every_figure_that_is_named_lies_beside_it_and_stands_alone(page: tuple[Path, Path]) -> None:
    path = page[1]
    named = set(re.findall(r"\]\(([^)]+\.svg)\)", path.read_text(encoding="utf-8")))
    assert named
    assert {file.name for file in path.parent.glob("*.svg")} == named
    for name in named:
        root = ET.parse(path.parent / name).getroot()  # noqa: S314 - our own drawing
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert sum(file.stat().st_size for file in path.parent.iterdir()) < 700_000


def test_tables_have_as_many_cells_as_heads(page: tuple[Path, Path]) -> None:
    for block in re.findall(r"(?:^\|.*\|\n)+", page[1].read_text(encoding="utf-8"), flags=re.MULTILINE):
        rows = [re.split(r"(?<!\\)\|", row)[1:-1] for row in block.strip().splitlines()]
        assert {len(row) for row in rows} == {len(rows[0])}


def test_published_again_it_is_the_same_and_holds_nothing_older(page: tuple[Path, Path]) -> None:
    folder, path = page
    before = {file.name: file.read_bytes() for file in path.parent.iterdir()}
    (path.parent / "older.svg").write_text("<svg/>", encoding="utf-8")
    publish_run(folder, path.parent.parent)
    assert {file.name: file.read_bytes() for file in path.parent.iterdir()} == before
    assert [entry.name for entry in path.parent.parent.iterdir()] == [path.parent.name]


@pytest.mark.usefixtures("undrawn")
def test_a_folder_of_somebody_else_is_left_alone(page: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "README.md").write_text("# My own words\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="something else where the report would go"):
        publish_run(page[0], tmp_path, name="mine")
    assert (tmp_path / "mine" / "README.md").read_text(encoding="utf-8") == "# My own words\n"


def test_a_bundle_that_there_is_no_room_for_is_named_and_leaves_the_page_of_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bundle, page = tmp_path / "bundle", tmp_path / "reports" / "tank" / "README.md"
    for file in (bundle / "verify" / "worst.csv", page):
        file.parent.mkdir(parents=True)
        file.write_text(MARK)

    def full(source: object, target: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(source), None, str(target))

    parts = {"run_document": SimpleNamespace(results=SimpleNamespace(pipeline="tank")), "_frozen": [bundle]}
    for name, value in (parts | {"read_run": None, "run_scores": [], "_page": ""}).items():
        monkeypatch.setattr(f"sysid.reporting.publication.{name}", lambda *_, value=value, **__: value)
    monkeypatch.setattr("shutil.copyfile", full)
    with pytest.raises(OSError, match="No space") as error:
        publish_run(tmp_path, tmp_path / "reports", bundle=True)
    assert (error.value.errno, error.value.filename) == (errno.ENOSPC, str(page.parent))
    assert [file.name for file in page.parent.parent.rglob("*")] == ["tank", "README.md"]


def test_what_a_judge_said_is_published_in_the_same_way(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    judgement = parse_judgement(
        {
            "title": "Stops",
            "method": "By <little>.",
            "scenes": ["hill"],
            "quantities": {"late": {"name": "late", "unit": "m"}},
            "subjects": {"one": {"hill": {"differences": {"late": 1.25}}}},
        },
        where="test",
    )
    write_record(
        folder / RESULTS_FILE,
        JudgementResults(
            kind="stops",
            pipeline="stopping",
            command="sysid run stopping",
            created="2026-11-21T04:00:00+00:00",
            environment={"commit": "9ffa098", "cpu": "A", "cores": 2},
            data=DataSetRecord(name="of the judge stops"),
            subjects=[SubjectRecord(name="one", parts=["valve: fit a of run b"])],
            judgement=judgement,
        ),
    )
    text = publish_run(folder, tmp_path / "reports").read_text(encoding="utf-8")
    for words in (
        f"**{judgement_headline(judgement)}**",
        "By &lt;little>.",
        "- **one.** valve: fit a of run b",
        "| run | `sysid run stopping` |",
        f"| published | `sysid publish {folder} --as stopping` |",
        "| date | 21 November 2026, 04:00 UTC |",
        "| seed | none |",
        "| commit | 9ffa098 |",
        "| machine | A, 2 cores |",
        "| data | of the judge stops |",
        "| scenario | late (m) |\n| --- | --- |\n| hill | 1.25 |",
    ):
        assert words in text, words


def test_the_reports_of_this_repository_are_made_by_the_command() -> None:
    reports = Path(__file__).resolve().parents[2] / "reports"
    for folder in (entry for entry in reports.iterdir() if entry.is_dir() and entry.name != "published"):
        text = (folder / "README.md").read_text(encoding="utf-8")
        assert text.startswith(MARK)
        assert re.search(r"\| commit \| [0-9a-f]{40}", text)
