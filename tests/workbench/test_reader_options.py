"""The options of the readers on the command line: those of the model, and nothing typed twice."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.ingest import FileOptions, load_dataset
from sysid.workbench.cli import run_cli
from sysid.workbench.commands.reader_options import files_from, reader_options, take_options

VALVE = "t;valve;u [V]\n" + "".join(f"{k};{'auf' if k % 4 > 1 else 'weg'};{k},5\n" for k in range(20))


def test_every_option_of_the_model_can_be_typed() -> None:
    places = {option.place[0] for option in reader_options().values()}
    assert places == set(FileOptions.model_fields) - {"columns", "units", "references"}
    assert all(option.told for option in reader_options().values())


@pytest.mark.parametrize(
    ("words", "files"),
    [
        (["--separator", ";", "--decimal=,"], {"separator": ";", "decimal": ","}),
        (["--separator", "tab"], {"separator": "\t"}),
        (["--no-header", "--skip-lines", "3"], {"header": False, "skip_lines": 3}),
        (["--time", "clock", "--time-unit", "ms"], {"time": {"column": "clock", "unit": "ms"}}),
        (["--time", "clock [ms]"], {"time": "clock [ms]"}),
        (["--zone", "Europe/Berlin"], {"time": {"zone": "Europe/Berlin"}}),
        (["--states", "OFF=0", "--states", "ON=1"], {"states": {"OFF": 0.0, "ON": 1.0}}),
        (["--states", "{valve: {shut: 0, 'half open': 0.5}}"], {"states": {"valve": {"shut": 0, "half open": 0.5}}}),
        (["--names", "t", "--names", "u"], {"names": ("t", "u")}),
        (["--names", "[t, u]"], {"names": ("t", "u")}),
        (["--missing", "---"], {"missing": ("---",)}),
        (["--states", "T[1]=0", "--states", "a: b=1"], {"states": {"T[1]": 0.0, "a: b": 1.0}}),
        (["--long-names", "tag", "--long-values", "value"], {"long": {"names": "tag", "values": "value"}}),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_is_typed_is_what_the_yaml_would_say(words: list[str], files: dict[str, object]) -> None:
    given, rest = take_options(["log.csv", *words, "--propose", "x.yaml"])
    assert rest == ["log.csv", "--propose", "x.yaml"]
    assert files_from(given) == FileOptions.model_validate(files)


def test_the_remedy_of_a_file_is_an_option_that_helps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bytes.csv").write_bytes(bytes(range(1, 256)) * 9)
    assert run_cli(["ingest", str(tmp_path / "bytes.csv")]) == 2
    assert "--encoding cp932" in capsys.readouterr().err


def test_a_value_that_cannot_be_is_refused_by_its_name() -> None:
    with pytest.raises(ConfigError, match=r"(?s)decimal.*command line.*'\.' or ','"):
        files_from(take_options(["--decimal", "x"])[0])
    with pytest.raises(ConfigError, match="--separator needs a value"):
        take_options(["--separator"])


def test_the_proposal_keeps_what_was_typed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text(VALVE)
    words = ["--states", "weg=0", "--states", "auf=1", "--time-unit", "min"]
    assert run_cli(["ingest", "log.csv", *words, "--propose", "dataset.yaml"]) == 0
    trace = load_dataset(tmp_path / "dataset.yaml").traces[0]
    assert trace.sample_time == 60.0
    assert trace["valve"].tolist() == [float(k % 4 > 1) for k in range(20)]


def test_a_data_set_has_its_options_in_its_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["ingest", "dryer", "--decimal", ","]) == 2
    assert "only a file is read with options of the command line" in capsys.readouterr().err


def test_the_help_names_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["ingest", "--help"]) == 0
    shown = capsys.readouterr().out
    assert all(flag in shown for flag in ("--separator", "--no-header", "--zone", "--states"))
