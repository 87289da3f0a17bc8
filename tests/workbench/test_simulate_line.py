"""``sysid simulate RUN --command FILE --positions 1:50``: every position of a line in one file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from sysid.errors import ConfigError
from sysid.ingest import read_trace
from sysid.traces import Channel
from sysid.units import Reference
from sysid.workbench.assembly.interpolation import StoredInterpolation
from sysid.workbench.assembly.runner import read_interpolation
from sysid.workbench.cli import app
from sysid.workbench.commands.simulate import Wish
from sysid.workbench.commands.simulate_line import parse_positions, simulate_line_command
from tests.models.test_interpolation import line

HANDLE = Channel(name="STP", unit="psi", reference=Reference.GAUGE)
CYLINDER = Channel(name="BC", unit="psi", reference=Reference.GAUGE)
ROWS = [[0, 90], [20, 80], [60, 90], [100, 90]]


@pytest.fixture
def run_folder(tmp_path: Path) -> Path:
    """What a finished run leaves, and a command beside it."""
    folder = tmp_path / "runs" / "train"
    folder.mkdir(parents=True)
    stored = StoredInterpolation(line=line(), inputs=(HANDLE,), outputs=(CYLINDER,), ranges={"STP": (64.2, 90.0)})
    (folder / "line.json").write_text(json.dumps(stored.to_dict()), encoding="utf-8")
    command = {"command": ROWS, "time_unit": "ds", "unit": "psi"}
    (tmp_path / "command.json").write_text(json.dumps(command), encoding="utf-8")
    return folder


def test_every_position_is_written_and_some_are_drawn(run_folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "train.csv"
    words = ["simulate", str(run_folder), "--command", str(tmp_path / "command.json"), "--positions", "1:49:4,50"]
    done = CliRunner().invoke(app, [*words, "--out", str(out)], catch_exceptions=False)
    assert done.exit_code == 0
    assert "100 samples of BC at 14 positions" in done.output.replace("\n", " ")
    assert (tmp_path / "train.png").stat().st_size > 1000
    positions = [*range(1, 50, 4), 50]
    channels = (
        HANDLE,
        *(Channel(name=f"BC{position}", unit="psi", reference=Reference.GAUGE) for position in positions),
    )
    written = read_trace(out, channels=channels, sample_time=0.1)
    handle = np.repeat([90.0, 80.0, 90.0], [20, 40, 40])
    assert_allclose(written["STP"], handle)
    expected = line().simulate(handle[:, None], [float(position) for position in positions])["BC"]
    assert_allclose(written.columns([f"BC{position}" for position in positions]).T, expected, atol=1e-6)


def test_a_command_beyond_what_was_fitted_is_told_of(run_folder: Path, tmp_path: Path) -> None:
    words = ["simulate", str(run_folder), "--command", str(tmp_path / "command.json"), "--positions", "1"]
    told = "STP is beyond 64.2 to 90 psi in 40 % of the samples: nothing there was fitted"
    within = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "a.csv")], catch_exceptions=False)
    assert told not in within.output.replace("\n", " ")
    rows = {"command": [[0, 90], [20, 0], [60, 90], [100, 90]], "time_unit": "ds", "unit": "psi"}
    (tmp_path / "command.json").write_text(json.dumps(rows), encoding="utf-8")
    beyond = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "b.csv")], catch_exceptions=False)
    assert told in beyond.output.replace("\n", " ")


def test_what_fitted_a_line_is_stored_with_it_and_old_lines_know_nothing_of_it(run_folder: Path) -> None:
    file = run_folder / "line.json"
    assert read_interpolation(run_folder).ranges == {"STP": (64.2, 90.0)}
    fields = json.loads(file.read_text(encoding="utf-8"))
    del fields["channels"]["inputs"][0]["range"]
    file.write_text(json.dumps(fields), encoding="utf-8")
    assert read_interpolation(run_folder).ranges == {}


def test_a_command_in_kilopascal_is_converted(run_folder: Path, tmp_path: Path) -> None:
    rows = "time [s],STP [kPa]\n" + "\n".join(f"{t / 10},{p * 6.894757293168}" for t, p in ROWS)
    (tmp_path / "command.csv").write_text(rows, encoding="utf-8")
    for name in ("command.csv", "command.json"):
        simulate_line_command(
            Wish(
                bundle=run_folder,
                inputs=None,
                command=tmp_path / name,
                out=tmp_path / f"{Path(name).suffix[1:]}.parquet",
            ),
            "17",
        )
    channels = (Channel(name="BC17", unit="psi", reference=Reference.GAUGE),)
    one, other = (
        read_trace(tmp_path / f"{name}.parquet", channels=channels, sample_time=0.1)["BC17"] for name in ("csv", "json")
    )
    assert_allclose(one, other, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "positions"),
    [
        pytest.param("1:4", [1.0, 2.0, 3.0, 4.0], id="a range"),
        pytest.param("1:10:3", [1.0, 4.0, 7.0, 10.0], id="a range with a step"),
        pytest.param("1, 7.5,50", [1.0, 7.5, 50.0], id="a list"),
        pytest.param("3:3", [3.0], id="one position"),
        pytest.param("1:2:0.25", [1.0, 1.25, 1.5, 1.75, 2.0], id="between whole numbers"),
    ],
)
def test_positions_are_read(text, positions):
    assert parse_positions(text) == positions


@pytest.mark.parametrize("text", ["", "1,", "4:1", "1:4:0", "a", "1:2:3:4", "1,1", "1:9999999:0.1", "-1:4", "nan"])
def test_positions_that_cannot_be_meant_are_refused(text):
    with pytest.raises(ConfigError, match="the positions cannot be read"):
        parse_positions(text)


def test_a_run_without_a_line_is_refused(tmp_path: Path) -> None:
    (tmp_path / "command.json").write_text(json.dumps({"command": ROWS}), encoding="utf-8")
    with pytest.raises(ConfigError, match="the run has no line"):
        simulate_line_command(
            Wish(bundle=tmp_path, command=tmp_path / "command.json", out=tmp_path / "out.csv"), "1:50"
        )


@pytest.mark.parametrize(
    ("command", "options", "got"),
    [
        pytest.param(None, {}, "no command", id="no command"),
        pytest.param(Path("c.json"), {"inputs": Path("u.csv")}, "inputs u.csv", id="inputs too"),
        pytest.param(Path("c.json"), {"initial": 0.0}, "--initial 0.0", id="an initial value"),
    ],
)
def test_a_line_is_simulated_from_a_command_alone(tmp_path: Path, command, options, got) -> None:
    with pytest.raises(ConfigError, match="not how a line is simulated") as caught:
        simulate_line_command(Wish(bundle=tmp_path, command=command, out=tmp_path / "out.csv", **options), "1:50")
    assert got in str(caught.value)


def test_a_picture_of_another_kind_is_refused(run_folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no picture of this kind"):
        simulate_line_command(
            Wish(
                bundle=run_folder,
                inputs=None,
                command=tmp_path / "command.json",
                out=tmp_path / "o.csv",
                plot=tmp_path / "o.bmp",
            ),
            "2",
        )
    assert not (tmp_path / "o.csv").exists()


def test_a_stored_line_that_lost_its_channels_is_refused(run_folder: Path) -> None:
    fields = json.loads((run_folder / "line.json").read_text(encoding="utf-8"))
    assert read_interpolation(run_folder).outputs == (CYLINDER,)
    del fields["channels"]["inputs"]
    (run_folder / "line.json").write_text(json.dumps(fields), encoding="utf-8")
    with pytest.raises(ConfigError, match="lacks its channels"):
        read_interpolation(run_folder)
