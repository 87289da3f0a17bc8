"""What was compiled is compiled again when something that it calls has changed."""

from __future__ import annotations

import os
import time

from sysid.kernels import forget_what_is_older


def test_an_index_goes_that_is_older_than_a_file_of_the_room(tmp_path):
    inner = tmp_path / "neurons"
    for folder, file, seconds in (
        (tmp_path, "recursion.py", 100.0),
        (inner, "tanh.py", 200.0),
        (inner, "of_tomorrow.py", time.time() + 86400.0),
        (tmp_path / "__pycache__", "recursion.free_run.nbi", 150.0),
        (tmp_path / "__pycache__", "recursion.predict.nbi", 250.0),
        (inner / "__pycache__", "tanh.values.nbi", 150.0),
        (inner / "__pycache__", "tanh.cpython.pyc", 150.0),
    ):
        folder.mkdir(exist_ok=True)
        (folder / file).touch()
        os.utime(folder / file, (seconds, seconds))
    forget_what_is_older(tmp_path)
    left = sorted(file.name for file in tmp_path.rglob("__pycache__/*"))
    assert left == ["recursion.predict.nbi", "tanh.cpython.pyc"]


def test_callers_in_other_rooms_are_compiled_again_too(tmp_path):
    kernels, callers = tmp_path / "kernels", tmp_path / "rail" / "__pycache__"
    for folder, file, seconds in (
        (kernels, "recursion.py", 200.0), (callers, "bank.old.nbi", 150.0), (callers, "bank.new.nbi", 250.0)
    ):  # fmt: skip
        folder.mkdir(parents=True, exist_ok=True)
        (folder / file).touch()
        os.utime(folder / file, (seconds, seconds))
    forget_what_is_older(kernels, tmp_path)
    assert [file.name for file in callers.iterdir()] == ["bank.new.nbi"]


def test_a_room_without_compiled_functions_is_left_alone(tmp_path):
    forget_what_is_older(tmp_path)
    assert list(tmp_path.iterdir()) == []
