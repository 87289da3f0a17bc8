"""Published figures: the digits as printed, looked up without mixing what must not be mixed."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.reporting import published_names, read_published

SERVICE = ("EST01", "VAL01", "VAL02", "VAL03", "VAL04")
COMBINED = (*SERVICE, "VAL05")


def _asked(mapping: str, run: str, quantity: str) -> dict[str, str]:
    return {"mapping": mapping, "run": run, "quantity": quantity}


# Table by table as printed, in the unit and scale of the table's heading.
PRINTED = [
    ("4.1", "lopes-2021", _asked("BP+AR -> BC", "one_step", "mse"), 1e-4, "0.2239 0.2729 0.0974 0.2410 0.4235"),
    ("4.1", "lopes-2021", _asked("BP+AR -> BC", "one_step", "run_time"), 1.0, "0.6859 0.6501 0.1195 0.1511 0.069"),
    ("5.1", "lopes-2021", _asked("BP+AR -> BC", "free_run", "mse"), 1e-3, "4.149 5.656 2.742 3.012 15.865"),
    ("5.1", "lopes-2021", _asked("BP+AR -> BC", "free_run", "run_time"), 1.0, "0.203 0.165 0.036 0.059 0.024"),
    ("5.4", "lopes-2021", _asked("STP -> BP", "free_run", "mse"), 1e-3, "6.500 8.571 4.996 6.412 8.423"),
    ("5.9", "lopes-2021", _asked("BP -> AR", "free_run", "mse"), 1e-3, "8.20 6.56 2.91 19.20 1.71"),
    (
        "7.1",
        "lopes-2021-combined",
        _asked("STP -> BP", "free_run", "mse"),
        1e-3,
        "17.604 18.620 20.010 6.493 25.505 22.953",
    ),
]


@pytest.mark.parametrize(
    ("source", "table", "question", "scale", "digits"),
    PRINTED,
    ids=[f"{row[1]}-table-{row[0]}-{row[2]['quantity']}" for row in PRINTED],
)
def test_yardsticks_are_the_printed_figures(
    source: str, table: str, question: dict[str, str], scale: float, digits: str
) -> None:
    published = read_published(table)
    cases = SERVICE if table == "lopes-2021" else COMBINED
    found = [published.find(**question, case=case) for case in cases]
    assert {figure.source for figure in found if figure} == {f"Table {source}"}
    assert [figure.value for figure in found if figure] == pytest.approx(
        [scale * float(text) for text in digits.split()], rel=1e-12
    )


def test_trailing_zeros_are_kept() -> None:
    figure = read_published("lopes-2021").find(mapping="BP+AR->BC", quantity="mse", run="one_step", case="VAL03")
    assert figure is not None
    assert (figure.digits, figure.unit, figure.label) == ("0.00002410", "psi^2", "NARX 4/4/20, open best accuracy")


def test_a_structure_or_variant_that_is_asked_for_comes_before_the_yardstick() -> None:
    published = read_published("lopes-2021")
    small = published.find(mapping="BP+AR->BC", quantity="mse", run="one_step", case="EST01", structure="NARX 1/1/5")
    assert small is not None
    assert (small.source, small.digits) == ("Table 4.2", "0.0005884")
    unretrained = published.find(
        mapping="STP->BP", quantity="mse", run="free_run", case="VAL04", loop="open", variant="closed"
    )
    assert unretrained is not None
    assert unretrained.digits == "0.041001"


@pytest.mark.parametrize(
    "question",
    [
        pytest.param({"run": "free_run", "case": "VAL05"}, id="case-not-published"),
        pytest.param({"run": "free_run", "case": "EST01", "unit": "kPa^2"}, id="another-unit"),
        pytest.param({"run": "free_run", "case": "EST01", "loop": "open"}, id="open-loop-trained-free-run"),
        pytest.param({"run": "free_run", "case": "EST01", "mapping": "AR+BP -> BC"}, id="another-mapping"),
        pytest.param({"run": "one_step", "case": "EST01", "loop": "closed"}, id="closed-loop-trained-one-step"),
    ],
)
def test_nothing_is_made_up(question: dict[str, str]) -> None:
    asked = {"mapping": "BP+AR -> BC", "quantity": "mse"} | question
    assert read_published("lopes-2021").find(**asked) is None  # type: ignore[arg-type]  # text only, by construction


@pytest.mark.parametrize("name", ["lopes-2021", "lopes-2021-combined"])
def test_there_is_one_yardstick_for_each_question(name: str) -> None:
    keys = [
        (figure.mapping, figure.run, figure.case, figure.signal, figure.quantity)
        for figure in read_published(name).figures
        if figure.yardstick
    ]
    assert keys
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize(("name", "count"), [("lopes-2021", 445), ("lopes-2021-combined", 573)])
def test_every_figure_says_where_it_is_printed_and_in_which_unit(name: str, count: int) -> None:
    published = read_published(name)
    assert len(published.figures) == count
    assert "Lopes" in published.reference
    for figure in published.figures:
        assert figure.source.startswith(("Table ", "Section "))
        assert figure.unit
        assert figure.run in {"", "one_step", "free_run"}
        assert figure.loop in {"", "open", "closed"}


def test_a_workspace_may_hold_tables_of_its_own(workspace: Path) -> None:
    assert set(published_names(workspace=workspace)) >= {"tanks", "lopes-2021"}
    figure = read_published("tanks", workspace=workspace).find(
        mapping="pump+valve -> level", quantity="mse", run="free_run", case="VAL01"
    )
    assert figure is not None
    assert figure.value == 0.002


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param("a,b\n1,2\n", "line 1", id="other-columns"),
        pytest.param("{head}T,m,,,,,,,mse,small,psi^2,,\n", "line 2", id="value-not-a-number"),
        pytest.param("{head}T,m,,\n", "13 fields", id="too-few-fields"),
        pytest.param('{head}"T', "CSV", id="open-quote"),
        pytest.param(None, "CSV", id="no-file"),
    ],
)
def test_a_damaged_table_is_refused_with_its_line(workspace: Path, text: str | None, words: str) -> None:
    path = workspace / "reports" / "published" / "tanks.csv"
    head = path.read_text().splitlines(keepends=True)[0]
    path.unlink()
    if text is not None:
        path.write_text(text.replace("{head}", head))
    with pytest.raises(ConfigError, match=words):
        read_published("tanks", workspace=workspace)
