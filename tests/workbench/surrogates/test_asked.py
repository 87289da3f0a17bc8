"""The contract of the doors to a surrogate: what is said on the command line and from Python comes to the same."""

from __future__ import annotations

import inspect
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import sysid
from sysid.errors import ConfigError
from sysid.references.sources import Source
from sysid.workbench.cli import run_cli
from sysid.workbench.command_line.surrogates import surrogate as command
from sysid.workbench.commands.surrogate import _command
from sysid.workbench.surrogates import asked
from sysid.workbench.surrogates.asked import wish_of

PROGRAM = "solver --in {inputs} --out {outputs}"
SAID: tuple[list[str], dict[str, Any]] = (
    [
        *("--range", "u [V]=0:2", "--parameter", "tau=1:3", "--output", "y [bar gauge]"),
        *("--sample-time", "0.5", "--duration", "20"),
    ],
    {
        **{"ranges": {"u [V]": (0, 2)}, "parameters": {"tau": (1, 3)}, "outputs": ["y [bar gauge]"]},
        **{"sample_time": 0.5, "duration": 20.0},
    },
)
ASKED: dict[str, tuple[str, list[str], dict[str, Any]]] = {
    "a function": ("lag.py:lag", *SAID),
    "a module's": ("package.module:function", *SAID),
    "a program": (PROGRAM, *SAID),
    "an FMU": ("slow.fmu", ["--range", "u=0:2", "--minutes", "5"], {"ranges": {"u": [0.0, 2.0]}, "minutes": 5.0}),
    "a table": ("lag.yaml", ["--duration", "20", "--seed", "3"], {"duration": 20.0, "seed": 3}),
    "workers": ("lag.yaml", ["--workers", "1"], {"workers": 1}),
    "a pipeline": ("runs.yaml", ["--proof", "30", "--rounds", "2"], {"proof": 30, "rounds": 2}),
    "another folder": ("runs.yaml", ["--out", "there"], {"folder": "there"}),
}
REFUSED = {
    "no function": ("lag.py", [], {}, "named without its function"),
    "a typing error": ("lag.py:lga", [], {}, "has no function lga"),
    "no reference": ("solver {inputs}", [], {}, "names no reference"),
    "nothing beside it": ("lag.py:lag", [], {}, "does not say all that an experiment needs"),
    "said beside a pipeline": ("runs.yaml", *SAID, "a pipeline says its ports and times itself"),
    "said twice": ("lag.yaml", *SAID, "stands in the file too"),
    "two ranges of one": (
        "lag.py:lag", ["--range", "u=0:1", "--range", "u [V]=0:2"], {"ranges": {"u": (0, 1), "u [V]": (0, 2)}},
        "--range u is said twice",
    ),
    "no such pipeline": ("nothing", [], {}, "there is no pipeline named nothing"),
    "no time": ("runs.yaml", ["--minutes", "inf"], {"minutes": float("inf")}, "there is no such time"),
}  # fmt: skip


GUESSED = """\
# u: -1 to 1 is a guess, by its start of 1; --range u=LOW:HIGH says it
# v: 0 to 4 is a guess, by its start of 2; --range v=LOW:HIGH says it
kind: experiment
reference: {inputs: {u: {range: [-1, 1]}, v: {range: [0, 3]}}}
"""


@pytest.fixture(autouse=True)
def _place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lag.py").write_text("def lag(time, u, p):\n    return u\n", encoding="utf-8")
    (tmp_path / "lag.yaml").write_text(
        "reference: {python: lag.py:lag, inputs: {u: {range: [0, 2]}}}\n", encoding="utf-8"
    )
    (tmp_path / "runs.yaml").write_text("kind: experiment\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """What reaches the experiments; none is run."""
    found: list[dict[str, Any]] = []

    def written(source: Source, wish: object, folder: Path, **more: object) -> tuple[Path, list[str]]:
        found.append({"source": source, "wish": wish, "folder": folder, **more})
        file = folder / "experiment.yaml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(GUESSED, encoding="utf-8")
        return file, ["u: 0 to 2, as was said"]

    def make(pipeline: Path, folder: Path, **more: object) -> None:
        ours = {name: value for name, value in more.items() if name not in {"perform", "began", "say", "watch"}}
        found.append({"pipeline": pipeline, "folder": folder, **ours})
        raise ConfigError("far enough", where="here", expected="", got="", remedy="")

    monkeypatch.setattr(asked, "written", written)
    monkeypatch.setattr(asked, "make_surrogate", make)
    return found


@pytest.mark.parametrize("what", ASKED)
def test_the_same_is_run_at_every_door(what: str, begun: list[dict[str, Any]]) -> None:
    source, words, options = ASKED[what]
    assert run_cli(["surrogate", source, "--no-tracking", *words]) != 0
    typed, begun[:] = list(begun), []
    with pytest.raises(ConfigError, match="far enough"):
        sysid.surrogate(source, **options)
    assert typed == begun
    assert len(begun) == (1 if source == "runs.yaml" else 2)


@pytest.mark.parametrize("what", REFUSED)
def test_the_same_is_refused_at_every_door(what: str, capsys: pytest.CaptureFixture[str]) -> None:
    source, words, options, said = REFUSED[what]
    assert run_cli(["surrogate", source, "--no-tracking", *words]) != 0
    typed = "".join(capsys.readouterr().err.split())
    with pytest.raises(ConfigError, match=said) as caught:
        sysid.surrogate(source, **options)
    for part in (caught.value.what, caught.value.expected, caught.value.got, caught.value.remedy):
        assert "".join(str(part).split()) in typed


def test_python_has_every_option_of_the_command() -> None:
    typed, called = (set(inspect.signature(door).parameters) for door in (command, sysid.surrogate))
    other = {"span": "ranges", "parameter": "parameters", "output": "outputs", "out": "folder"}
    # Tracking is the command's; a budget of iterations is for tests, which are to come to the same everywhere.
    assert {other.get(name, name) for name in typed - {"no_tracking"}} == called - {"iterations"}


def test_what_was_proposed_is_told_from_python_too_and_what_was_guessed_at_the_end(
    begun: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = asked.Made(bundle=Path(), fmu=None, report=Path(), proof=SimpleNamespace(), notes=[], pipeline=Path())  # type: ignore[arg-type]
    monkeypatch.setattr(asked, "make_surrogate", lambda *_, **__: made)
    found = sysid.surrogate("lag.py:lag")
    assert found.proposed == ("u: 0 to 2, as was said",)
    # The range of v was written otherwise since.
    assert found.notes == ["u: -1 to 1 is a guess, by its start of 1; --range u=LOW:HIGH says it"]
    assert begun[0]["folder"] == Path("runs/surrogate-lag")


def test_a_function_itself_is_no_name_of_one() -> None:
    with pytest.raises(ConfigError, match="is named, not given") as caught:
        sysid.surrogate(lambda time, inputs, parameters: inputs)  # type: ignore[arg-type] # noqa: ARG005
    assert "file.py:function" in str(caught.value.remedy)


@pytest.mark.parametrize("span", [(3, 1), (0,), ("a", "b"), (0.0, float("inf")), 5])
def test_a_range_from_python_that_is_none_is_refused(span: Any) -> None:
    with pytest.raises(ConfigError, match="is not a range"):
        sysid.surrogate("lag.py:lag", ranges={"u": span})


@pytest.mark.parametrize("text", ["u", "u=3:1", "=1:2", "u=a:b"])
def test_a_range_as_typed_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="is not a range"):
        asked.wish_of(asked.pairs([text], "--range"), [], [], sample_time=None, duration=None)


def test_a_report_has_the_whole_command_that_makes_it_again() -> None:
    """It left out ranges, parameters and outputs, and was refused as it stood."""
    wish = wish_of([("u [V]", (0.0, 2.5))], [("tau", (1, 3))], ["y [mm]"], sample_time=0.5, duration=60.0)
    told = _command("lag.py:lag", wish, {"--minutes": "5", "--proof": 1000, "--rounds": None, "--out": Path("a b")})
    assert told == (
        "sysid surrogate lag.py:lag --range 'u [V]=0:2.5' --parameter tau=1:3 --output 'y [mm]' --sample-time 0.5 "
        "--duration 60.0 --minutes 5 --proof 1000 --out 'a b'"
    )
