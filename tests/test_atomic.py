"""Files that are there whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from pathlib import Path

import pytest

from sysid.atomic import LEFT_S, clear_drafts, replacing, replacing_folder


def test_a_file_takes_its_place_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "new" / "a.txt"
    with replacing(path) as draft:
        draft.write_text("whole")
        assert not path.exists()
        assert draft.suffix == ".txt"
    assert path.read_text() == "whole"
    assert [file.name for file in path.parent.iterdir()] == ["a.txt"]


def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), replacing(path) as draft:
        draft.write_text("half")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["a.txt"]


def test_the_file_has_the_usual_permissions(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("x")
    with replacing(tmp_path / "ours") as draft:
        draft.write_text("x")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode


def aged(path: Path) -> Path:
    """Made so long ago that whoever made it is gone."""
    os.utime(path, (time.time() - 2 * LEFT_S,) * 2)
    return path


def test_a_folder_takes_the_place_of_another_whole(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "a"
    for text in ("old", "new"):
        with replacing_folder(folder) as draft:
            (draft / f"{text}.txt").write_text(text)
        assert [file.name for file in folder.iterdir()] == [f"{text}.txt"]
    assert [file.name for file in folder.parent.iterdir()] == ["a"]


def test_a_folder_that_cannot_take_its_place_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "a"
    folder.mkdir()
    (folder / "old.txt").write_text("old")
    rename = Path.rename

    def refused(self: Path, target: Path) -> Path:
        if self.name == "new":
            raise OSError(28, "No space left on device", str(self))
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", refused)
    with pytest.raises(OSError, match="No space") as error, replacing_folder(folder) as draft:
        (draft / "new.txt").write_text("new")
    assert error.value.filename == str(folder)
    assert [file.name for file in tmp_path.rglob("*")] == ["a", "old.txt"]


def test_what_killed_processes_left_goes_and_what_is_being_written_stays(tmp_path: Path) -> None:
    inner = tmp_path / "fits" / "arx"
    inner.mkdir(parents=True)
    drafts = [Path(tempfile.mkstemp(prefix=".fit.", suffix=".json", dir=inner)[1]) for _ in range(2)]
    kept = [inner / ".hidden.json", inner / "fit.json", tmp_path / ".gitignore", drafts[0]]
    for file in (*kept[:3], drafts[1]):
        file.touch()
        aged(file)
    clear_drafts(tmp_path)
    assert [file for file in kept if file.exists()] == kept
    assert not drafts[1].exists()
    left, begun, other = (Path(tempfile.mkdtemp(prefix=of, dir=tmp_path)) for of in (".a.", ".a.", ".b."))
    for folder in (left, other):
        (folder / "new").mkdir()
        aged(folder)
    with replacing_folder(tmp_path / "a"):
        pass
    assert (left.exists(), begun.exists(), other.exists()) == (False, True, True)


@pytest.mark.parametrize("inside", [True, False], ids=["a folder", "a file"])
def test_a_copy_that_fails_names_what_was_to_be_written(
    inside: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, target = tmp_path / "source.txt", tmp_path / "a"
    source.write_text("whole")

    def full(_: object, place: Path) -> None:
        raise OSError(28, "No space left on device", str(source), None, str(place))

    monkeypatch.setattr("shutil.copyfile", full)
    with (
        pytest.raises(OSError, match="No space") as error,
        (replacing_folder if inside else replacing)(target) as draft,
    ):
        shutil.copyfile(source, draft / "b.txt" if inside else draft)
    assert str(error.value).endswith(f": {str(target)!r}")
    assert [file.name for file in tmp_path.iterdir()] == ["source.txt"]
