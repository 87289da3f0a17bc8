"""A published benchmark: the verdict first, each figure beside its target, and a report that grows by benchmarks."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.reporting import publish_benchmarks
from sysid.reporting.benchmarks.findings import FINDINGS_FILE, Benchmark, Finding, read_findings
from sysid.reporting.scores import Score

NAN = float("nan")
FINDINGS = [
    Finding(what="free run", ours=2.5, unit="ms", target=5.0, published="9 ms (Table 2)"),
    Finding(what="error", ours=0.59, unit="V", target=0.588, peer="0.60 V", note="order 2 -> 3"),
    Finding(what="time of a peer by ours", ours=48.0, unit="x", target=60.0, at_least=True, bound=True),
    Finding(what="size", ours=12.0, unit="kB"),
]


def benchmark(command: str = "python -m tests.benchmarks speed", **more: object) -> Benchmark:
    fields: dict[str, object] = {
        "title": "Speed of everything",
        "protocol": "Medians of seven.",
        "command": command,
        "created": "2026-11-21T04:00:00+00:00",
        "environment": {"cpu": "A", "cores": 2, "sysid": "0.1.0", "commit": "9ffa098", "packages": {"numpy": "2.4"}},
        "load": 0.25,
        "data": {"tank.csv": "ef23"},
        "findings": FINDINGS,
        "printed": "free run 2.5 ms\n",
    }
    return Benchmark.model_validate(fields | more)


@pytest.mark.parametrize(
    ("finding", "met"),
    [
        pytest.param(Finding(what="a", ours=1.0, target=2.0), True, id="at-most-and-below"),
        pytest.param(Finding(what="a", ours=2.0, target=2.0), True, id="at-most-and-equal"),
        pytest.param(Finding(what="a", ours=3.0, target=2.0), False, id="at-most-and-above"),
        pytest.param(Finding(what="a", ours=3.0, target=2.0, at_least=True), True, id="at-least-and-above"),
        pytest.param(Finding(what="a", ours=1.0, target=2.0, at_least=True), False, id="at-least-and-below"),
        pytest.param(Finding(what="a", ours=1.0, target=2.0, at_least=True, bound=True), None, id="bound-that-is-open"),
        pytest.param(Finding(what="a", ours=3.0, target=2.0, at_least=True, bound=True), True, id="bound-that-decides"),
        pytest.param(Finding(what="a", ours=NAN, target=2.0), False, id="no-figure"),
        pytest.param(Finding(what="a", ours=1.0), None, id="no-target"),
    ],
)
def test_a_target_is_reached_missed_or_open(finding: Finding, met: bool | None) -> None:
    assert finding.met is met


def test_the_verdict_comes_first_and_names_what_was_missed(tmp_path: Path) -> None:
    text = publish_benchmarks("run-time", tmp_path, [benchmark()]).read_text(encoding="utf-8")
    head = text[: text.index("| machine |")]
    assert "# Run time" in head
    assert "**1 of 3 targets is reached, 1 is missed, 1 could not be decided.**" in head
    assert "- **Missed.** error: 0.590 V against at most 0.588 V." in head
    assert "- **Open.** time of a peer by ours: more than 48.0 x against at least 60.0 x." in head


def test_what_it_ran_on_and_how_is_stated(tmp_path: Path) -> None:
    text = publish_benchmarks("run-time", tmp_path, [benchmark()]).read_text(encoding="utf-8")
    for words in (
        "| machine | A, 2 cores |",
        "| versions | sysid 0.1.0, numpy 2.4 |",
        "## Speed of everything",
        "| error | 0.590 V | at most 0.588 V | **missed** |  | 0.60 V | order 2 → 3 |",
        "| run | `python -m tests.benchmarks speed` |",
        "| date | 21 November 2026, 04:00 UTC |",
        "| commit | 9ffa098 |",
        "| load | 0.2 when it began |",
        "| data: tank.csv | SHA-256 ef23 |",
        "Medians of seven.",
        "```text\nfree run 2.5 ms\n```",
    ):
        assert words in text, words
    for block in re.findall(r"(?:^\|.*\|\n)+", text, flags=re.MULTILINE):
        assert len({len(re.split(r"(?<!\\)\|", row)) for row in block.strip().splitlines()}) == 1


def test_a_column_that_nobody_fills_is_left_out(tmp_path: Path) -> None:
    page = publish_benchmarks("sizes", tmp_path, [benchmark(findings=FINDINGS[3:])])
    assert "| figure | ours |\n| --- | --- |\n| size | 12.0 kB |" in page.read_text(encoding="utf-8")


def test_a_report_grows_and_a_benchmark_that_is_run_again_takes_its_own_place(tmp_path: Path) -> None:
    second = [Finding(what="another", ours=1.0)]
    publish_benchmarks("all", tmp_path, [benchmark("first"), benchmark("second", findings=second)])
    publish_benchmarks("all", tmp_path, [benchmark("first", title="Anew"), benchmark("third", findings=[])])
    kept = read_findings(tmp_path / "all").benchmarks
    assert [(one.command, one.title) for one in kept] == [
        ("first", "Anew"),
        ("second", "Speed of everything"),
        ("third", "Speed of everything"),
    ]
    assert kept[1].findings == second


def test_a_figure_that_another_command_found_again_stands_once(tmp_path: Path) -> None:
    scores = [Score(mapping="u -> y", unit="V", model=model, mse={"test": 1.0}) for model in ("a peer", "another")]
    older = [benchmark("all", scores=scores), benchmark("some", findings=FINDINGS[:1])]
    publish_benchmarks("all", tmp_path, older)
    publish_benchmarks("all", tmp_path, [benchmark("last", findings=FINDINGS[:2], scores=scores[:1])])
    kept = read_findings(tmp_path / "all").benchmarks
    assert [(one.command, one.findings, one.scores) for one in kept] == [
        ("all", FINDINGS[2:], scores[1:]),
        ("last", FINDINGS[:2], scores[:1]),
    ]


def test_damaged_figures_and_a_folder_of_somebody_else_are_refused(tmp_path: Path) -> None:
    page = publish_benchmarks("all", tmp_path, [benchmark()])
    (page.parent / FINDINGS_FILE).write_text("{", encoding="utf-8")
    with pytest.raises(ConfigError, match="figures of the benchmark cannot be read"):
        publish_benchmarks("all", tmp_path, [benchmark()])
    page.write_text("# Mine\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="something else where the report would go"):
        publish_benchmarks("all", tmp_path, [benchmark()])
