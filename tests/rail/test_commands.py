"""``sysid rail``: the examples of its page say what comes out, files are written, dry runs do nothing."""

from __future__ import annotations

import importlib.metadata
import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command
from typer.testing import CliRunner

from sysid.errors import SysidError
from sysid.rail.commands import app
from sysid.workbench import cli

ROOT = Path(__file__).parents[2]
LINES = ROOT / "datasets" / "rail-example"
CREST, TRAIN = str(LINES / "crest.yaml"), str(LINES / "heavy-haul-101.yaml")
DRIVE = ["drive", str(LINES / "card-a-b.csv"), str(LINES / "commuter.yaml"), "--section", "A", "--stop", "1000"]


def run(words: list[str]) -> str:
    result = CliRunner().invoke(app, words, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def examples() -> list[tuple[str, str]]:
    page = (ROOT / "docs" / "rail.md").read_text(encoding="utf-8")
    blocks = "".join(re.findall(r"```console\n(.*?)```", page, flags=re.S))
    return [
        (command, told) for command, told in re.findall(r"^\$ sysid rail (.*)\n((?:[^$].*\n)+)", blocks, flags=re.M)
    ]


@pytest.mark.parametrize(("command", "told"), examples(), ids=lambda text: text[:7])
def test_the_page_says_what_the_commands_say(command: str, told: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert run(shlex.split(command)) == told


def test_the_page_has_an_example_of_each_command() -> None:
    assert {command.split()[0] for command, _ in examples()} == {
        one.callback.__name__ for one in app.registered_commands
    }


def test_a_table_and_a_picture_are_written(tmp_path: Path) -> None:
    told = run(["terrain", CREST, TRAIN, "--pattern", "median", "--out", str(tmp_path / "out")])
    rows = np.genfromtxt(tmp_path / "out" / "terrain.csv", delimiter=",", names=True)
    at = rows["position_m"][np.argmax(rows["correlation"])]
    assert abs(at) <= 25.0
    assert f"strongest at {at:8.0f} m" in told
    assert (tmp_path / "out" / "terrain.svg").read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.parametrize(("line", "kind"), [("crest.yaml", "draft"), ("sag.yaml", "buff")])
def test_the_force_told_is_the_largest_of_the_whole_passage(line: str, kind: str) -> None:
    """50 wagons pull down on either side: with the leading end at the apex, where it was looked at, nothing does."""
    told = re.search(rf"coupler 50 {kind} (\d+) kN at 4\d\d m", run(["terrain", str(LINES / line), TRAIN]))
    assert told
    assert float(told[1]) == pytest.approx(50 * 120.0 * 9.80665 * 0.008, rel=0.02)


def test_a_line_with_curves_says_the_quadrant_and_the_lateral_force(tmp_path: Path) -> None:
    bent = tmp_path / "bent.yaml"
    bent.write_text("name: bent\ngrade: [[-4000, 8], [0, -8]]\ncurve: [[-2000, 500]]\n", encoding="utf-8")
    assert re.search(
        r"crest with significant curvature; at a crawl L/V \+0\.\d+ at vehicle \d+", run(["terrain", str(bent), TRAIN])
    )


STOPS = ["stops", "--friction", "0.7"]


def test_a_record_of_the_plant_teaches_before_the_first_stop(tmp_path: Path) -> None:
    def errors(words: list[str]) -> list[float]:
        return [abs(float(one)) for one in re.findall(r"mean error +([+-][\d.]+) %", run(words))]

    record, out = str(tmp_path / "slow.csv"), tmp_path / "out"
    nominal = errors([*STOPS, "--count", "3", "--record", record, "--out", str(out)])
    assert nominal[0] > 10.0
    assert nominal[2] < 0.1 * nominal[0]
    assert errors([*STOPS, "--count", "1", "--trace", record])[0] < 0.3 * nominal[0]
    rows = np.genfromtxt(out / "stops.csv", delimiter=",", names=True)
    assert np.ptp(rows["modifier"]) > 0.1
    assert (out / "stops.svg").is_file()


EOT = ["eot", "--pairs", "2", "--seconds", "20"]


def test_the_end_of_a_train_is_written_with_its_times(tmp_path: Path) -> None:
    run([*EOT, "--out", str(tmp_path)])
    rows = np.genfromtxt(tmp_path / "eot.csv", delimiter=",", names=True)
    assert rows["last_both_psi"][-1] == pytest.approx(rows["last_one_psi"][-1], abs=0.1)
    assert (tmp_path / "eot.svg").is_file()


@pytest.mark.parametrize(
    "words", [["terrain", CREST, TRAIN], DRIVE, EOT, STOPS], ids=["terrain", "drive", "eot", "stops"]
)
def test_a_dry_run_does_nothing(words: list[str], tmp_path: Path) -> None:
    assert "nothing is done" in run([*words, "--dry-run", "--out", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["terrain", CREST, TRAIN, "--step", "0"], "step is out of range"),
        (["terrain", str(LINES / "card-a-b.csv"), TRAIN], "several sections"),
        ([*DRIVE, "--point", "1200"], "the run cannot be made"),
        ([*DRIVE[:4], "Z", *DRIVE[5:]], "no section Z"),
        (["drive", str(LINES / "crest.yaml"), *DRIVE[2:]], "no track card"),
        (["stops", "--friction", "9"], "not such stops"),
        (["eot", "--leak", "-1"], "not a test bench"),
        (["terrain", CREST, TRAIN, "--look-ahead", "nan"], "too far ahead"),
        (["terrain", CREST, TRAIN, "--section", "A"], "no sections"),
        (["eot", "--pairs", "100000"], "a train needs wagons"),
        (["eot", "--handle", "90", "--dry-run"], "not an application"),
        (["stops", "--count", "0", "--dry-run"], "not such stops"),
    ],
    ids=["step", "section", "point", "unknown section", "no card", "friction", "leak", "look ahead", "no sections",
         "wagons", "dry eot", "dry stops"],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_words(words: list[str], said: str) -> None:
    with pytest.raises(SysidError, match=said):
        CliRunner().invoke(app, words, catch_exceptions=False)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([*EOT, "--handle", "89.5"], "valve never open; 0 orders\nboth ends cylinders have no pressure"),
        ([*DRIVE, "--longest", "20"], "is at 156.02 m after 20.0 s"),
        ([*STOPS, "--dry-run", "--record", "slow.csv"], "it would write slow.csv"),
    ],
    ids=["no application", "still moving", "dry record"],
)
def test_what_did_not_happen_is_not_told(words: list[str], said: str) -> None:
    assert said in run(words)


def test_a_line_with_posts_in_kilometres_is_refused(tmp_path: Path) -> None:
    line = tmp_path / "km.yaml"
    line.write_text("name: km\ngrade: [[0, 5], [0.1, -20], [0.7, 20], [0.9, -5]]\n", encoding="utf-8")
    with pytest.raises(SysidError, match="no longer than a wagon"):
        CliRunner().invoke(app, ["terrain", str(line), TRAIN], catch_exceptions=False)


def test_a_card_without_rows_is_refused_by_that(tmp_path: Path) -> None:
    (tmp_path / "card.csv").write_text("section,distance_km,code,value\n", encoding="utf-8")
    with pytest.raises(SysidError, match="no rows"):
        CliRunner().invoke(app, ["terrain", str(tmp_path / "card.csv"), TRAIN], catch_exceptions=False)


def test_a_card_with_distances_in_metres_is_refused(tmp_path: Path) -> None:
    card = tmp_path / "m.csv"
    card.write_text("section,distance_km,code,value\nA,0,GRADE,5\nA,700,GRADE,-5\n", encoding="utf-8")
    with pytest.raises(SysidError, match="longer than any line"):
        CliRunner().invoke(app, ["terrain", str(card), TRAIN], catch_exceptions=False)


def test_the_command_line_finds_what_a_field_brings(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
    entries = [
        importlib.metadata.EntryPoint(name=name, value=value, group="sysid.commands")
        for name, value in declared["sysid.commands"].items()
    ]
    monkeypatch.setattr("sysid.plugins.entry_points", lambda _: entries)
    monkeypatch.setattr(cli.app, "registered_groups", list(cli.app.registered_groups))
    assert cli.run_cli(["rail", "terrain", CREST, TRAIN, "--dry-run"]) == 0
    assert "nothing is done" in capsys.readouterr().out


def test_every_help_text_is_printed_as_it_is_written() -> None:
    """What stands in brackets is taken for markup and left out, where it is not escaped."""
    parameters = get_command(app).commands["stops"].params  # type: ignore[attr-defined]
    written = next(one.help for one in parameters if one.name == "trace")
    for command in ("terrain", "drive", "eot", "stops"):
        printed = " ".join(CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "400"}).output.split())
        for one in get_command(app).commands[command].params:  # type: ignore[attr-defined]
            assert one.help.replace("\\[", "[") in printed
    assert "[mA]" in written


def test_a_single_vehicle_has_no_coupler_and_is_driven_all_the_same(tmp_path: Path) -> None:
    engine = tmp_path / "light.yaml"
    engine.write_text(
        "name: light engine\nvehicles: [{name: locomotive, mass: 100000, length: 20, axles: 4, power: {}}]\n"
    )
    told = run(["terrain", CREST, str(engine), "--step", "5"])
    assert "crest " in told
    assert "coupler" not in told
    assert "is at" in run(["drive", DRIVE[1], str(engine), *DRIVE[3:], "--longest", "5"])


@pytest.mark.parametrize(("seconds", "told"), [(12, True), (40, False)])
def test_cylinders_that_still_rise_at_the_end_are_told(seconds: int, told: bool) -> None:
    """Nine tenths of what they have by then is a time that means nothing."""
    said = run(["eot", "--pairs", "5", "--handle", "0", "--seconds", str(seconds)])
    assert (f"at {seconds} s cylinders still rise, the valve is open" in said) is told


@pytest.mark.parametrize(
    ("mass", "grade", "said"),
    [
        (40e3, 150, "is at -10.*\nnote: it rolls back, and the run ends there"),
        (400e3, 8, "changes of notch"),
        (
            400e3,
            9,
            "stands at -?0.00 m after .*\nnote: it stands 1000 m before the stop: its traction does not start it",
        ),
    ],
    ids=["rolls back", "a heavy train that starts is slow at first", "too heavy"],
)
def test_a_train_that_its_traction_does_not_move_is_told(tmp_path: Path, mass: float, grade: int, said: str) -> None:
    """The first had run backwards for ten minutes and was told to stand, as was the second before it began."""
    card, train = tmp_path / "card.csv", tmp_path / "train.yaml"
    card.write_text(f"section,distance_km,code,value\nA,0,GRADE,{grade}\nA,0,SPEED LIM,70\n", encoding="utf-8")
    text = (LINES / "commuter.yaml").read_text(encoding="utf-8").replace("mass: 40000", f"mass: {mass:g}")
    train.write_text(text, encoding="utf-8")
    told = run(["drive", str(card), str(train), *DRIVE[3:], "--longest", "60"])
    assert re.search(said, told)
    assert ("stands" in told) == ("stands" in said)


@pytest.mark.parametrize(("point", "told"), [(990.0, True), (700.0, False)])
def test_a_stop_that_is_missed_is_told(point: float, told: bool) -> None:
    said = run([*DRIVE, "--point", str(point)])
    assert ("past the stop: begin the automatic stop earlier (--point)" in said) is told
