"""Words of the release before are read, with a word about the new one."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.field_checks import FieldError, check
from sysid.workbench.assembly.stage_config import RoundConfig
from sysid.workbench.cli import run_cli
from sysid.workbench.fields import JointConfig, TrainingConfig
from sysid.workbench.old_words import ASSEMBLY, JOINT_TRAINING, TRAINING, OldWordWarning, with_new_words

RENAMED = [
    *((TrainingConfig, old, new, 3) for old, new in TRAINING.items() if old != "leave_out"),
    (TrainingConfig, "leave_out", "input_subsets", (("w",),)),
    *((JointConfig, old, new, 3) for old, new in JOINT_TRAINING.items()),
    (RoundConfig, "everywhere", "share_weights", True),
]


@pytest.mark.parametrize(("model", "old", "new", "value"), RENAMED, ids=[old for _, old, _, _ in RENAMED])
def test_an_old_word_is_read_and_told(model: type, old: str, new: str, value: object) -> None:
    more = {"starts": 3} if new == "input_subsets" else {}
    with pytest.warns(OldWordWarning, match=f"{old} is called {new} now"):
        read = check(model, {old: value, **more}, where="text")
    assert getattr(read, new) == value


def test_an_old_value_is_read_and_told() -> None:
    with pytest.warns(OldWordWarning, match="levels and rates is called incremental now"):
        assert check(TrainingConfig, {"basis": "levels and rates"}, where="text").basis == "incremental"


def test_every_part_of_an_assembly_has_its_new_word() -> None:
    with pytest.warns(OldWordWarning):
        assert with_new_words(dict.fromkeys(ASSEMBLY), ASSEMBLY) == dict.fromkeys(ASSEMBLY.values())


def test_a_field_under_both_names_is_refused() -> None:
    with pytest.raises(FieldError, match="under its old name too"):
        with_new_words({"prelude": 1, "pretraining": 2}, TRAINING)


def test_new_words_are_read_in_silence(recwarn: pytest.WarningsRecorder) -> None:
    check(TrainingConfig, {"pretraining": 10}, where="text")
    assert not [one for one in recwarn if one.category is OldWordWarning]


def test_a_word_that_is_neither_is_refused() -> None:
    with pytest.raises(ConfigError):
        check(TrainingConfig, {"preludes": 10}, where="text")


def test_the_command_line_says_it_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_cli(["init", "."]) == 0
    pipeline = tmp_path / "pipelines" / "tank.yaml"
    text = pipeline.read_text(encoding="utf-8")
    assert "training: {" in text
    pipeline.write_text(text.replace("training: {", "training: {prelude: 0, ", 1), encoding="utf-8")
    capsys.readouterr()
    assert run_cli(["run", "tank", "--dry-run"]) == 0
    said = capsys.readouterr().err
    assert said.startswith("note: prelude is called pretraining now; the next release no longer reads the old word")
    assert said.count("note:") == 1
