"""The scorecard: what it prints is what published reports hold, and the README holds what it prints."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.reporting import publish_benchmarks, publish_run, read_results
from sysid.reporting.benchmarks.findings import Benchmark, Finding
from sysid.reporting.numbers import number
from sysid.reporting.scorecard import PLACE, main, place, scorecard
from sysid.reporting.scores import Score, read_scores
from tests.reporting.assembly.conftest import document, write_run
from tests.reporting.judging.conftest import leakage

pytestmark = pytest.mark.usefixtures("undrawn")

ROOT = Path(__file__).resolve().parents[2]
NAN = float("nan")


def rows(text: str) -> list[list[str]]:
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line]


@pytest.fixture
def report(make_run: Callable[..., Path], workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A published run with published figures, and the run beside it."""
    monkeypatch.chdir(workspace)
    run = make_run(
        tmp_path / "run", samples=200, names=("ARX", "NARX free run"), edit=lambda run: run.update(published="tanks")
    )
    return publish_run(run, tmp_path / "reports").parent


def test_ours_and_the_published_figures_stand_under_their_cases(report: Path, tmp_path: Path) -> None:
    fit = read_results(tmp_path / "run").best_fit
    assert fit is not None
    head, _, ours, published = rows(scorecard([report]))
    assert ours[0].startswith("**pump+valve → level** [10⁻³ psi²]: NARX 4/4/20, trained in closed loop")
    for case, record in fit.cases.items():
        assert ours[head.index(case)] == number(1e3 * record.free_run.mse)
    assert published[0] == "published (Table 1: NARX 4/4/20, best)"
    assert published[head.index("VAL01")] == number(1e3 * read_scores(report)[0].published["VAL01"])


def test_a_run_counts_as_its_published_report_does(report: Path, tmp_path: Path) -> None:
    assert scorecard([tmp_path / "run"]) == scorecard([report])


def test_runs_of_every_kind_have_their_rows(tmp_path: Path) -> None:
    whole = write_run(tmp_path / "whole", document())
    stops = tmp_path / "stops"
    stops.mkdir()
    run = {key: document()[key] for key in ("pipeline", "command", "created", "environment")}
    run |= {"schema_version": 2, "kind": "leak", "data": {"name": "x"}, "subjects": [], "judgement": leakage()}
    (stops / "results.json").write_text(json.dumps(run), encoding="utf-8")
    head, _, lower, published, good, poor = rows(scorecard([whole, stops]))
    assert head[1:] == ["A", "V", "slow", "fast"]
    assert lower[0] == "**pump → lower** [10⁻³ cm²]: 2 models as one, 40 parameters"
    assert lower[1:] == ["250", "300", "", ""]
    assert published == ["published (Table 1)", "", "400", "", ""]
    assert good[1:] == ["", "", number(500.0), number(1500.0)]
    assert poor[1:] == ["", "", number(9.0), ""]


def test_the_best_peer_is_the_one_with_the_least_geometric_mean_that_never_diverges(
    report: Path, tmp_path: Path
) -> None:
    peers = [
        Score(mapping="pump+valve -> level", unit="psi", model=model, mse={"EST01": 1.0, "VAL01": a, "VAL02": b})
        for model, a, b in (("lucky once", 1e-6, NAN), ("steady", 0.1, 0.4), ("worse", 1.0, 0.5))
    ]
    other = Score(mapping="pump+valve -> level", unit="bar", model="of another unit", mse={"VAL01": 1e-9})
    benchmark = Benchmark(title="Peers", command="peers", scores=[*peers, other])
    folder = publish_benchmarks("peers", tmp_path / "reports", [benchmark]).parent
    last = rows(scorecard([report, folder]))[-1]
    assert last[0] == "best of 3 peers: steady"
    assert last[2:4] == ["100", "400"]


def test_benchmarks_stand_beside_what_others_have_once_for_each_record(tmp_path: Path) -> None:
    findings = [
        Finding(what="Tanks, ARX [2; 2]", ours=0.59, unit="V", target=0.588, published="0.588 (linear; A et al. 2024)"),
        Finding(what="Tanks, n = 50", ours=0.276, unit="V", target=0.3, published="0.306", peer="0.285 V (tried)"),
        Finding(what="Tanks, n = 5", ours=0.27, unit="V", published="0.306; A et al. 2024"),
        Finding(
            what="Race: time of one to 1 m, divided by ours", ours=9.0, unit="x", target=3.0, at_least=True, peer="9 s"
        ),
        Finding(
            what="Race: time of two to 1 m, divided by ours", ours=4.0, unit="x", target=3.0, at_least=True, peer="4 s"
        ),
        Finding(what="Race: time of one to its own best", ours=8.0, unit="x", target=3.0, at_least=True, peer="9 s"),
        Finding(what="Race: time of two to its own best", ours=NAN, unit="x", target=3.0, at_least=True, peer="5 s"),
        Finding(what="without others", ours=1.0, target=2.0),
    ]
    benchmark = Benchmark(title="Public", command="public", findings=findings)
    folder = publish_benchmarks("public", tmp_path, [benchmark]).parent
    assert rows(scorecard([folder]))[2:] == [
        ["Tanks, n = 50", "0.276 V", "0.306", "0.285 V"],
        ["Race: time of two to 1 m, divided by ours", "4.00 x", "", "4 s"],
        ["Race: time of two to its own best", "none", "", "5 s"],
    ]


def test_it_goes_between_its_two_lines(report: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("Before\n<!-- scorecard: here -->\nold\n<!-- end of the scorecard -->\nAfter\n", encoding="utf-8")
    main([str(report), "--into", str(page)])
    text = page.read_text(encoding="utf-8")
    assert text.startswith("Before\n<!-- scorecard: here -->\n\n| free run")
    assert text.endswith("\n\n<!-- end of the scorecard -->\nAfter\n")
    assert "old" not in text
    assert place(scorecard([report]), page) == text
    page.write_text("Nothing\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="no place for the scorecard"):
        main([str(report), "--into", str(page)])


def test_a_report_without_figures_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="scores of the report cannot be read"):
        scorecard([tmp_path])


def test_the_readme_holds_what_the_reports_say(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    found = PLACE.search((ROOT / "README.md").read_text(encoding="utf-8"))
    assert found is not None
    words = shlex.split(found["command"])
    assert words[:3] == ["python", "-m", "sysid.reporting.scorecard"]
    folders = [Path(word) for word in words[3 : words.index("--into")]]
    assert place(scorecard(folders), ROOT / "README.md") == (ROOT / "README.md").read_text(encoding="utf-8")
