"""The runner on steps of its own: what is made, what is found, what is kept, what is told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from sysid.errors import ConfigError
from sysid.workbench.runner.dry_run import DryRun
from sysid.workbench.runner.events import Event, StepDone, Warned
from sysid.workbench.runner.run import Run
from sysid.workbench.runner.steps import Done, NotKnownError, Step, Work
from sysid.workbench.runner.store import RunFolder, read_json, write_json


class Bench:
    """A run folder, and steps that count how often they are made."""

    def __init__(self, folder: Path) -> None:
        self.store, self.made, self.told = RunFolder(path=folder), list[str](), list[Event]()

    def run(self, *, fresh: bool = False) -> Run:
        self.made.clear()
        self.told.clear()
        return Run(store=self.store, command="", fresh=fresh, watchers=(self.told.append,), environment={})

    def step(self, name: str, value: int, **more: Any) -> Step[int]:
        file = self.store.path / f"{name}.json"

        def make(_: Work) -> int:
            self.made.append(name)
            return value

        def write(made: int) -> list[Path]:
            write_json(file, made)
            return [file]

        options = {"key": lambda: f"key of {name} {value}", "make": make, "write": write} | more
        return Step(name=name, title=f"Making {name}", read=lambda _: read_json(file), **options)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_a_step_is_made_once_and_found_again(bench: Bench) -> None:
    assert (bench.run().do(bench.step("one", 1)).value, bench.made) == (1, ["one"])
    done = bench.run().do(bench.step("one", 1))
    assert (done.value, done.stored, bench.made) == (1, True, [])
    assert [event.stored for event in bench.told if isinstance(event, StepDone)] == [True]


def test_what_it_depends_on_or_fresh_make_it_again(bench: Bench) -> None:
    bench.run().do(bench.step("one", 1))
    assert bench.run().do(bench.step("one", 2)).value == 2
    assert bench.made == ["one"]
    assert not bench.run(fresh=True).do(bench.step("one", 2)).stored


def test_without_a_key_it_is_made_every_time(bench: Bench) -> None:
    for _ in range(2):
        assert not bench.run().do(bench.step("one", 1, key=None)).stored
        assert bench.made == ["one"]


def test_what_is_not_final_is_used_and_not_kept_nor_is_what_takes_it(bench: Bench) -> None:
    for _ in range(2):
        run = bench.run()
        first = run.do(bench.step("one", 1, final=lambda _: False))
        second = run.do(bench.step("two", 2, after=[first]))
        assert (first.value, second.value, second.final) == (1, 2, False)
        assert bench.made == ["one", "two"]


def test_what_is_about_another_result_is_made_again_with_it(bench: Bench) -> None:
    def both(run: Run) -> Done[int]:
        return run.do(bench.step("figures", 2, of=run.do(bench.step("fit", 1))))

    both(bench.run())
    assert both(bench.run()).stored
    (bench.store.path / "fit.json").unlink()
    assert not both(bench.run()).stored
    assert bench.made == ["fit", "figures"]


def test_many_small_steps_are_told_as_one(bench: Bench) -> None:
    bench.run().do(bench.step("one", 1))
    run = bench.run()
    assert [one.value for one in run.do_all("Making", [bench.step("one", 1), bench.step("two", 2)])] == [1, 2]
    (told,) = [event for event in bench.told if isinstance(event, StepDone)]
    assert (told.step, told.stored, told.detail) == ("Making", False, "2 steps, 1 of them stored")


def test_an_error_says_what_was_being_done(bench: Bench) -> None:
    def refuse(_: Work) -> int:
        raise ConfigError("no")

    with pytest.raises(ConfigError) as caught:
        bench.run().do(bench.step("one", 1, make=refuse))
    assert caught.value.__notes__ == ["making one"]


def test_a_dry_run_makes_nothing_and_knows_how_long_it_took(bench: Bench) -> None:
    bench.run().do(bench.step("one", 1, amount=lambda: {"samples": 5}))
    run = DryRun(store=bench.store, command="", environment={})
    assert run.do(bench.step("one", 1)).value == 1
    changed = run.do(bench.step("one", 3, amount=lambda: {"samples": 5}))
    assert run.planned["one"].basis == "as last time"
    run.do(bench.step("one", 3, amount=lambda: {"samples": 6}))
    assert run.planned["one"].seconds is None
    with pytest.raises(NotKnownError):
        _ = changed.value
    # A step whose key follows from that is looked at all the same.
    run.do(bench.step("two", 2, key=lambda: str(changed.value)))
    assert list(run.planned) == ["one", "two"]
    assert bench.made == ["one"]


def test_a_checkpoint_that_cannot_be_written_costs_nobody_the_result(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError("no space")

    def make(work: Work) -> int:
        watch = work.watch()
        watch.checkpoints.flush()
        watch.checkpoints.flush()
        return 1

    monkeypatch.setattr(RunFolder, "keep_checkpoint", refuse)
    assert bench.run().do(bench.step("one", 1, make=make)).value == 1
    assert [type(event) for event in bench.told].count(Warned) == 1


def test_times_are_told_and_not_decided_by(bench: Bench) -> None:
    (bench.store.path / ".steps").mkdir()
    (bench.store.path / ".steps" / "times.json").write_text("{", encoding="utf-8")
    bench.run().do(bench.step("one", 1))
    assert set(json.loads((bench.store.path / ".steps" / "times.json").read_text(encoding="utf-8"))) == {"one"}
