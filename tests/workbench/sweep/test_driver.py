"""The driver: the same trials and winner whatever comes in when, and nothing done twice."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.models import ARX
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.workbench.runner.store import digest
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.driver import Driver, as_trial
from sysid.workbench.sweep.store import TrialStore
from sysid.workbench.sweep.trial import FAILED, Bench, Job, gave_up
from sysid.workbench.sweep.workers import AbstractWorkers

SWEEP = {
    "kind": "sweep",
    "name": "s",
    "data": "d",
    "mapping": "u -> y",
    "structure": {
        "kind": "NARX",
        "input_delays": {"from": 1, "to": 4},
        "output_delays": 1,
        "neurons": {"from": 1, "to": 6},
    },
    "training": {"max_iterations": 40},
}
PRUNED = {"pruning": [{"iterations": 5, "record": 0.5, "keep": 0.5}, {"iterations": 20, "keep": 0.3}]}


def bench() -> Bench:
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    trace = Trace(name="a", sample_time=1.0, channels=channels, values=np.zeros((10, 2)))
    traces = TraceSet(name="d", traces=(trace,), roles={"a": Role.ESTIMATION}, source="test")
    return Bench(pipeline={"mapping": "u -> y"}, traces=traces, selection=())


class Crew(AbstractWorkers):
    """Answers from the job alone, in a random order: as many hands as ``n``, some quicker than others."""

    def __init__(self, n: int, seed: int, die_after: int = 10**9) -> None:
        self.n, self.rng, self.die_after = n, np.random.default_rng(seed), die_after
        self.held: list[tuple[Job, dict[str, Any]]] = []
        self.done: list[Job] = []

    @property
    def free(self) -> int:
        return self.n - len(self.held)

    def submit(self, job: Job, before: Mapping[str, Any] | None) -> None:
        assert (before is None) == (job.after is None)
        assert before is None or before["key"] == job.after
        self.held.append((job, answer(job, before)))

    def finished(self) -> list[tuple[Job, dict[str, Any]]]:
        if len(self.done) >= self.die_after:
            raise KeyboardInterrupt
        job, result = self.held.pop(int(self.rng.integers(len(self.held))))
        self.done.append(job)
        return [(job, result)]

    def give_up(self) -> None:
        """Nothing that it would go on with."""

    def close(self) -> None:
        """Nothing."""


def answer(job: Job, before: Mapping[str, Any] | None) -> dict[str, Any]:
    """A figure that depends on the point, the training, and what it began from."""
    terms = {**dataclasses.asdict(job), "key": "", "cost": 0, "before": before["mark"] if before else ""}
    mark = digest(terms)
    error = int(mark[:6], 16) / 2**24
    return {
        "key": job.key,
        "number": job.number,
        "structure": dict(job.structure),
        "status": "CONVERGED",
        "usable": int(mark[6:8], 16) > 30,
        "iterations": job.iterations or 0,
        "seconds": 1.0,
        "cpu_s": 1.0,
        "selection_free_run_mse": error,
        "mark": mark,
        "fit": {},
    }


class Stuck(Crew):
    """Does two jobs and comes to no end with any other."""

    gave_up = 0

    def finished(self) -> list[tuple[Job, dict[str, Any]]]:
        return super().finished() if len(self.done) < 2 else []

    def give_up(self) -> None:
        self.gave_up += 1
        self.held.clear()


def sweep(folder: Path, crew: Crew, **change: Any) -> tuple[list[dict[str, Any]], Driver]:
    config = check(SweepConfig, SWEEP | change, where="s.yaml")
    store = TrialStore(path=folder)
    with store.clock() as clock:
        driver = Driver(
            config=config, bench=bench(), store=store, workers=crew, clock=clock, step="s", tell=lambda _: None
        )
        trials = driver.run(config.space().points())
    return [trial.model_dump() for trial in trials], driver


def test_what_is_not_done_in_time_is_given_up_and_found_so_again(tmp_path: Path) -> None:
    config = check(SweepConfig, SWEEP, where="s.yaml")
    store, looks = TrialStore(path=tmp_path), iter(range(100))
    with store.clock() as clock:
        driver = Driver(
            config=config, bench=bench(), store=store, workers=Stuck(2, 0), clock=clock, step="s",
            tell=lambda _: None, late=lambda: next(looks) > 20,
        )  # fmt: skip
        trials = driver.run(config.space().points())
        again = dataclasses.replace(driver, workers=Crew(1, 0), late=lambda: False, last={})
        assert [one.status for one in again.run(config.space().points())] == [one.status for one in trials]
    assert isinstance(driver.workers, Stuck)
    assert driver.workers.gave_up == 1
    assert [one.status for one in trials].count(FAILED) == len(trials) - 2
    assert {one.reason for one in trials if one.status == FAILED} == {gave_up(driver.last[1])["reason"]}


class Fullest(Crew):
    """Keeps of how many points it had jobs whenever it was asked for results."""

    def __init__(self) -> None:
        super().__init__(9, 0)
        self.most = 0

    def finished(self) -> list[tuple[Job, dict[str, Any]]]:
        self.most = max(self.most, len(self.held))
        return super().finished()


def test_folds_that_are_done_ahead_wait_for_none_of_each_other_and_change_nothing(tmp_path: Path) -> None:
    """The slowest fit of each part had kept all other workers idle."""
    config, traces = check(SweepConfig, SWEEP, where="s.yaml"), bench().traces
    other = dataclasses.replace(traces, traces=(dataclasses.replace(traces.traces[0], sample_time=2.0),))
    folds = dataclasses.replace(bench(), folds=((traces, ()), (other, ())))
    points, found, most = config.space().points()[:3], list[list[dict[str, Any]]](), list[int]()
    for ahead in (False, True):
        store, crew = TrialStore(path=tmp_path / str(ahead)), Fullest()
        with store.clock() as clock:
            first = Driver(
                config=config, bench=folds, store=store, workers=crew, clock=clock, step="s", tell=lambda _: None
            )
            drivers = [first, dataclasses.replace(first, fold=1, last={})]
            if ahead:
                first.do_ahead([(one, points) for one in drivers])
            found.append([trial.model_dump() for one in drivers for trial in one.run(points)])
        assert len(crew.done) == 2 * len(points)
        most.append(crew.most)
    assert found[0] == found[1]
    assert most == [len(points), 2 * len(points)]


WAYS = {
    "in full": {},
    "with looks": PRUNED,
    "from smaller networks": {"warm_start": "smaller"},
    "from linear fits, with looks": {"warm_start": "linear", **PRUNED},
}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_the_number_of_workers_and_their_order_change_nothing(tmp_path: Path, way: dict[str, Any]) -> None:
    found = [sweep(tmp_path / str(n), Crew(n, seed), **way)[0] for seed, n in enumerate((1, 2, 4, 7))]
    assert len(found[0]) == 24
    assert all(trials == found[0] for trials in found[1:])


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_a_driver_that_dies_goes_on_and_does_nothing_twice(tmp_path: Path, way: dict[str, Any]) -> None:
    whole, _ = sweep(tmp_path / "whole", undisturbed := Crew(2, 0), **way)
    keys: list[str] = []
    for attempt in range(20):
        crew = Crew(2, attempt, die_after=5)
        try:
            found, _ = sweep(tmp_path / "killed", crew, **way)
        except KeyboardInterrupt:
            keys += [job.key for job in crew.done]
            continue
        keys += [job.key for job in crew.done]
        break
    assert found == whole
    assert len(keys) == len(set(keys)) == len(undisturbed.done)


def test_looks_drop_the_worse_part_and_train_the_rest_to_the_end(tmp_path: Path) -> None:
    crew = Crew(3, 0)
    trials, driver = sweep(tmp_path, crew, **PRUNED)
    dropped = {look: {t["number"] for t in trials if t["dropped_at"] == look} for look in (1, 2, None)}
    assert {look: len(numbers) for look, numbers in dropped.items()} == {1: 12, 2: 8, None: 4}
    assert {trial["iterations"] for trial in trials if trial["dropped_at"] is None} == {40}
    first = [answer(job, None) for job in crew.done if job.iterations == 5]
    ranked = sorted(first, key=lambda one: (not one["usable"], one["selection_free_run_mse"]))
    assert {one["number"] for one in ranked[12:]} == dropped[1]
    assert driver.done_now == 24 + 12 + 4


def test_where_a_tolerance_is_given_more_traces_within_it_come_first(tmp_path: Path) -> None:
    """The least mean hides a trace that fails; what cannot be used is last all the same."""
    _, driver = sweep(tmp_path, Crew(1, 0))
    shown = driver.config.choose.model_copy(update={"tolerance": 0.01})
    strict = dataclasses.replace(driver, config=driver.config.model_copy(update={"choose": shown}))
    known = [(2.0, [0.009, 0.009], True), (1.0, [0.001, 0.02], True), (0.5, [0.001, 0.001], False)]
    job = Job(key="k", number=1, structure=ARX(na=1, nb=(1,), nk=(1,)).to_dict(), training={})
    even, uneven, unusable = (
        as_trial(answer(job, None) | {"selection_free_run_mse": mse, "selection_rms_shares": shares, "usable": usable})
        for mse, shares, usable in known
    )
    assert driver.rank(uneven) < driver.rank(even) < driver.rank(unusable)
    assert strict.rank(even) < strict.rank(uneven) < strict.rank(unusable)
    assert strict.rank(even)[-1] == 2.0
    with pytest.raises(ConfigError, match="a tolerance counts selection traces"):
        check(SweepConfig, SWEEP | {"choose": {"on": "estimation", "tolerance": 0.01}}, where="s.yaml")


def test_a_job_goes_on_from_the_look_before_unless_the_record_grew(tmp_path: Path) -> None:
    crew = Crew(1, 0)
    sweep(tmp_path, crew, **PRUNED)
    by_key = {job.key: job for job in crew.done}
    for job in crew.done:
        if job.after is not None:
            assert job.resume == (by_key[job.after].record == job.record)
            assert by_key[job.after].number == job.number


def test_networks_with_the_same_delays_share_one_linear_fit(tmp_path: Path) -> None:
    crew = Crew(2, 0)
    sweep(tmp_path, crew, warm_start="linear")
    linear = [job for job in crew.done if job.structure["neurons"] == 0]
    assert len(linear) == 4
    assert {job.after for job in crew.done if job not in linear} == {job.key for job in linear}


def test_jobs_of_one_cost_need_no_order_of_their_own(tmp_path: Path) -> None:
    network = {
        "kind": "NARX",
        "input_delays": {"from": 1, "to": 8},
        "output_delays": {"from": 1, "to": 8},
        "neurons": 4,
    }
    found, _ = sweep(tmp_path, Crew(3, 1), structure=network, warm_start="linear")
    assert len(found) == 64


def test_a_network_grows_from_the_next_smaller_one(tmp_path: Path) -> None:
    crew = Crew(2, 0)
    sweep(tmp_path, crew, warm_start="smaller")
    by_key = {job.key: job for job in crew.done}
    for job in crew.done:
        smaller = by_key[job.after].structure["neurons"] if job.after else 0
        assert job.structure["neurons"] == smaller + 1


def test_a_torn_file_is_no_result(tmp_path: Path) -> None:
    whole, _ = sweep(tmp_path, Crew(1, 0))
    file = next(tmp_path.glob("*/*.json"))
    file.write_text(file.read_text(encoding="utf-8")[:50], encoding="utf-8")
    crew = Crew(1, 0)
    assert sweep(tmp_path, crew)[0] == whole
    assert len(crew.done) == 1


@pytest.mark.parametrize(
    "change",
    [{"seed": 1}, {"training": {"max_iterations": 41}}, {"training": {"max_iterations": 40, "loop": "open"}}],
    ids=["seed", "iterations", "loop"],
)
def test_other_conditions_are_other_trials(tmp_path: Path, change: dict[str, Any]) -> None:
    sweep(tmp_path, Crew(1, 0))
    crew = Crew(1, 0)
    sweep(tmp_path, crew, **change)
    assert len(crew.done) == 24
