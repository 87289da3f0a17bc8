"""Compiling is told once, and timed: what was compiled is kept, and no part of how long a thing takes."""

from collections import defaultdict

import numba
import pytest
from numba.core import event

from sysid import compilation
from sysid.compilation import compiled_s, listen, listener, tell_of_compiling


@pytest.fixture(autouse=True)
def told_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """What this process has compiled before is another's."""
    monkeypatch.setattr(compilation, "_told", [])
    monkeypatch.setattr(compilation, "_taken", [0.0])
    monkeypatch.setattr(
        event, "_registered", defaultdict(list)
    )  # the process's own listener, for as long as ours is asked


def test_who_waits_for_the_first_compilation_is_told_once() -> None:
    """The first command after an installation had compiled for half a minute without a word."""
    told: list[str] = []
    tell_of_compiling(lambda: told.append("compiling"))
    with event.install_listener("numba:compile", listener()):
        assert told == []
        numba.njit(lambda x: x + 1.0)(1.0)
        numba.njit(lambda x: x + 2.0)(1.0)
    assert told == ["compiling"]


def test_what_is_called_is_timed_within_what_calls_it(monkeypatch: pytest.MonkeyPatch) -> None:
    seconds = iter([10.0, 11.0, 15.0])  # the outer begins, the inner begins, the outer ends
    monkeypatch.setattr(compilation.time, "process_time", lambda: next(seconds))
    one = listener()
    one.on_start(None)
    one.on_start(None)
    one.on_end(None)
    one.on_end(None)
    assert compiled_s() == 5.0


def test_what_runs_again_is_not_compiled() -> None:
    double = numba.njit(lambda x: 2.0 * x)
    with event.install_listener("numba:compile", listener()):
        double(1.0)
        after = compiled_s()
        double(2.0)
    assert compiled_s() == after > 0.0


def test_a_process_has_one_listener() -> None:
    listen.cache_clear()
    listen()
    listen()
    assert [len(ones) for ones in event._registered.values()] == [1]
