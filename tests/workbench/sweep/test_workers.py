"""Workers that are killed: their jobs are done again, and a driver takes its workers along."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.workbench.sweep.trial import FAILED, Bench, Job, run_job
from sysid.workbench.sweep.workers import InThisProcess, LocalWorkers

CHANNELS = tuple(Channel(name=name, unit="V") for name in ("u", "y"))
PIPELINE = {
    "name": "s",
    "data": "d",
    "mapping": "u -> y",
    "fits": [{"name": "a", "structure": {"kind": "ARX", "na": 1, "nb": [1], "nk": [1]}}],
}


def bench(n: int = 300) -> Bench:
    rng = np.random.default_rng(0)
    traces = []
    for name in ("est", "val", "sel"):
        u = np.repeat(rng.uniform(-1.0, 1.0, n // 20), 20)
        y = np.zeros(n)
        for t in range(1, n):
            y[t] = 0.9 * y[t - 1] + 0.2 * np.tanh(u[t - 1])
        traces.append(Trace(name=name, sample_time=0.1, channels=CHANNELS, values=np.stack([u, y], axis=1)))
    roles = {"est": Role.ESTIMATION, "val": Role.VALIDATION}
    return Bench(
        pipeline=PIPELINE,
        traces=TraceSet(name="d", traces=tuple(traces[:2]), roles=roles, source="test"),
        selection=(traces[2],),
    )


def job(number: int, **change: Any) -> Job:
    fields: dict[str, Any] = {
        "key": f"key {number}",
        "number": number,
        "structure": {"kind": "NARX", "input_delays": 1, "output_delays": 1, "neurons": number},
        "training": {"seed": number, "max_iterations": 8},
        "iterations": 8,
    }
    return Job(**(fields | change))


def without_clocks(outcome: dict[str, Any]) -> dict[str, Any]:
    """What a job's result says that does not depend on how long it took."""
    kept = {key: outcome[key] for key in ("key", "status", "selection_free_run_mse", "log_evidence", "operations")}
    return kept | {"theta": outcome["fit"]["model"]["theta"]}


@pytest.fixture
def crew() -> Iterator[LocalWorkers]:
    """Two workers."""
    workers = LocalWorkers(bench(), 2)
    yield workers
    workers.close()


def collect(workers: Any, n: int) -> dict[int, dict[str, Any]]:
    found: dict[int, dict[str, Any]] = {}
    deadline = time.monotonic() + 300
    while len(found) < n and time.monotonic() < deadline:
        found |= {one.number: result for one, result in workers.finished()}
    return found


def test_a_job_that_is_given_up_leaves_its_worker_free_for_another(crew: LocalWorkers) -> None:
    crew.submit(job(20, training={"seed": 0, "max_iterations": 10**6}, iterations=10**6), None)
    assert crew.free == 1
    crew.give_up()
    assert crew.free == 2
    crew.submit(job(1), None)
    assert collect(crew, 1)[1]["status"] != FAILED


@pytest.mark.slow
def test_a_killed_workers_job_is_done_again_with_the_same_result(crew: LocalWorkers) -> None:
    # Both workers stand, however long the machine takes to start them.
    crew.submit(job(2), None)
    crew.submit(job(3), None)
    assert crew.free == 0
    assert set(collect(crew, 2)) == {2, 3}
    # Long enough to be killed in the middle of it.
    long = job(20, training={"seed": 1, "max_iterations": 1000, "patience": 1000}, iterations=1000)
    crew.submit(long, None)
    time.sleep(0.1)
    assert not crew.finished()
    for pid in crew.processes:
        os.kill(pid, signal.SIGKILL)
    found = collect(crew, 1)[20]
    here = InThisProcess(bench())
    here.submit(long, None)
    assert without_clocks(found) == without_clocks(collect(here, 1)[20])


def test_a_driver_that_is_killed_takes_its_workers_along() -> None:
    code = (
        "import time, sys; sys.path.insert(0, sys.argv[1])\n"
        "from test_workers import bench, job, LocalWorkers\n"
        "if __name__ == '__main__':\n"
        "    crew = LocalWorkers(bench(), 1); crew.submit(job(1), None)\n"
        "    while not crew.finished(): pass\n"
        "    print(crew.processes[0], flush=True); time.sleep(600)\n"
    )
    here = os.path.dirname(__file__)  # noqa: PTH120 - a word on a command line
    driver = subprocess.Popen([sys.executable, "-c", code, here], stdout=subprocess.PIPE, text=True)
    assert driver.stdout is not None
    worker = int(driver.stdout.readline())
    driver.kill()
    driver.wait()
    driver.stdout.close()
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and alive(worker):
        time.sleep(0.05)
    assert not alive(worker)


def test_a_script_without_a_guard_is_not_run_again_by_its_workers(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        f"import sys; sys.path.insert(0, {os.path.dirname(__file__)!r})\n"  # noqa: PTH120 - a word in a script
        "from test_workers import bench, job, LocalWorkers\n"
        "print('begun', flush=True)\n"
        "crew = LocalWorkers(bench(), 1); crew.submit(job(1), None)\n"
        "found = []\n"
        "while not found: found = crew.finished()\n"
        "crew.close(); print(found[0][1]['usable'], __file__, flush=True)\n",
        encoding="utf-8",
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.splitlines() == ["begun", f"True {script}"]
    assert done.stderr == ""


def alive(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as stat:  # noqa: PTH123 - not a file that a path names for long
            return stat.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_fit_that_fails_is_a_result() -> None:
    outcome = run_job(
        bench(), job(1, structure={"kind": "NARX", "input_delays": [[1], [1]], "output_delays": 1, "neurons": 1}), None
    )
    assert outcome["status"] == FAILED
    assert not outcome["usable"]
    assert "sets of input delays" in outcome["reason"]


def test_a_job_in_two_pieces_ends_where_one_would_have() -> None:
    whole = run_job(bench(), job(3, iterations=8), None)
    first = run_job(bench(), job(3, iterations=5), None)
    second = run_job(bench(), job(3, iterations=8, after="x", resume=True), first)
    assert without_clocks(second) == without_clocks(whole)


def test_a_shorter_record_shortens_what_is_fitted_and_not_what_is_scored() -> None:
    outcome = run_job(bench(), job(2, record=0.5), None)
    assert outcome["fit"]["model"]["scaling"] != run_job(bench(), job(2), None)["fit"]["model"]["scaling"]
    assert set(outcome["cases"]) == {"est", "val"}


@pytest.mark.parametrize(
    "structure",
    [
        {"kind": "ARX", "na": 1, "nb": [1], "nk": [1]},
        {"kind": "TransferFunction", "poles": [1], "zeros": [0], "delays": [1]},
    ],
    ids=["ARX", "transfer function"],
)
def test_linear_models_are_tried_like_networks(structure: dict[str, Any]) -> None:
    outcome = run_job(bench(), job(1, structure=structure, training={}, iterations=None), None)
    assert outcome["usable"]
    assert outcome["operations"] > 0
    assert outcome["checkpoint"] is None
