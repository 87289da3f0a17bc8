"""A sweep that is killed, split and sent away: 500 trials with SIGKILLs, one worker against two, Dask, tracking.

    python -m tests.benchmarks sweep                 # all of it, some minutes
    python -m tests.benchmarks sweep --only=kills    # or: workers, dask, tracking

The trials are those of 500 small networks on a short record, so that what is measured is the sweep and not the
training; ``workers`` takes forty networks on the 20,000 samples of the built-in data instead. Everybody is killed at a
random share of the results. A trial is the same if its number, key, structure, status, look, iterations, error and
evidence are, to the last digit.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml

from tests.benchmarks._findings import found

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

KILLS = 5
PARTS = ("kills", "workers", "dask", "tracking")

DATASET = """\
name: rig
sample_time: 0.1
channels: [{name: u, unit: V}, {name: v, unit: V}, {name: y, unit: V}]
source: {files: {}}
cases:
  est: {role: estimation, file: est.csv}
  sel: {role: selection, file: sel.csv}
  val: {role: validation, file: val.csv}
"""

SMALL = """\
kind: sweep
name: small
data: rig
mapping: u+v -> y
structure:
  kind: NARX
  input_delays: {from: 1, to: 5}
  output_delays: {from: 1, to: 5}
  neurons: {from: 1, to: 20}
training: {loop: closed, max_iterations: 6}
pruning: [{iterations: 2, keep: 0.4}]
workers: 2
export: null
"""

FORTY = """\
kind: sweep
name: forty
data: abdx-service
selection: abdx-selection
mapping: BP+AR -> BC
rest: {BC: 0}
structure: {kind: NARX, input_delays: 3, output_delays: {from: 1, to: 4}, neurons: {from: 6, to: 15}}
training: {loop: closed, max_iterations: 40}
export: null
"""


def workspace(folder: Path, pipeline: str) -> Path:
    """A workspace with a short record of a saturating system and one pipeline."""
    data = folder / "datasets" / "rig"
    data.mkdir(parents=True)
    (folder / "pipelines").mkdir()
    (data / "dataset.yaml").write_text(DATASET, encoding="utf-8")
    for seed, name in enumerate(("est", "sel", "val")):
        rng = np.random.default_rng(seed)
        u, v = (np.repeat(rng.uniform(-1.0, 1.0, 20), 30) for _ in range(2))
        y = np.zeros(600)
        for t in range(1, 600):
            y[t] = 0.9 * y[t - 1] + 0.2 * np.tanh(u[t - 1] - 0.3 * y[t - 1]) + 0.05 * v[t - 1]
        rows = [f"{0.1 * t:.1f},{u[t]:.6f},{v[t]:.6f},{y[t]:.9f}" for t in range(600)]
        (data / f"{name}.csv").write_text("\n".join(["t [s],u [V],v [V],y [V]", *rows]) + "\n", encoding="utf-8")
    name = yaml.safe_load(pipeline)["name"]
    (folder / "pipelines" / f"{name}.yaml").write_text(pipeline, encoding="utf-8")
    return folder


def start(folder: Path, name: str, *options: str) -> subprocess.Popen[bytes]:
    """The real driver, as a person starts it."""
    code = "from sysid.workbench.cli import main; main()"
    command = [sys.executable, "-c", code, "sweep", name, "--no-tracking", *options]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def finish(process: subprocess.Popen[bytes]) -> None:
    """Wait for it, and show why if it failed."""
    _, errors = process.communicate()
    if process.returncode:
        sys.exit(errors.decode())


def workers_of(driver: int) -> list[int]:
    """Process numbers of a driver's workers."""
    tasks = Path(f"/proc/{driver}/task/{driver}/children")
    children = [int(pid) for pid in tasks.read_text().split()] if tasks.exists() else []
    return [pid for pid in children if "spawn_main" in Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")]


def stored(folder: Path, name: str) -> dict[str, int]:
    """The trials on disk and when each was written, in nanoseconds."""
    trials = folder / "runs" / name / "trials"
    return {file.stem: file.stat().st_mtime_ns for file in trials.glob("*/*.json")}


def outcome(folder: Path, name: str) -> tuple[list[tuple[object, ...]], int]:
    """All that a sweep found and that does not depend on the clock, and its winner."""
    record = json.loads((folder / "runs" / name / "sweep.json").read_text())
    kept = ("number", "key", "label", "status", "dropped_at", "iterations", "selection_free_run_mse", "log_evidence")
    return [tuple(trial[k] for k in kept) for trial in record["trials"]], record["winner"]


def undisturbed(base: Path) -> tuple[list[tuple[object, ...]], int]:
    """The sweep that nobody kills."""
    folder = workspace(base / "undisturbed", SMALL)
    began = time.perf_counter()
    finish(start(folder, "small"))
    trials, winner = outcome(folder, "small")
    print(f"undisturbed: {len(trials)} trials, winner {winner}, {time.perf_counter() - began:.0f} s", flush=True)
    return trials, winner


def kills(base: Path) -> None:
    """The driver killed five times at a random moment, then a worker killed five times."""
    expected = undisturbed(base)
    total = len(stored(base / "undisturbed", "small"))
    kill_drivers(base, expected, total)
    kill_workers(base, expected, total)


def kill_drivers(base: Path, expected: tuple[list[tuple[object, ...]], int], total: int) -> None:
    """Five sessions that end by SIGKILL, and one that is let go on."""
    rng = np.random.default_rng(1)
    folder = workspace(base / "driver", SMALL)
    seen: dict[str, int] = {}
    twice = 0
    for kill in range(KILLS):
        # A random share of the results: a random moment whatever the machine's load.
        goal = int(total * (kill + rng.random()) / KILLS)
        driver = start(folder, "small")
        while len(now := stored(folder, "small")) < goal and driver.poll() is None:
            time.sleep(0.05)
        driver.send_signal(signal.SIGKILL)
        driver.wait()
        print(f"driver killed with {len(now)} of {total} results stored", flush=True)
        now = stored(folder, "small")
        twice += sum(now[key] != written for key, written in seen.items())
        seen = now
    finish(start(folder, "small", "--resume"))
    now = stored(folder, "small")
    twice += sum(now[key] != written for key, written in seen.items())
    check(f"driver killed {KILLS} times", outcome(folder, "small"), expected, twice + len(now) - total)


def kill_workers(base: Path, expected: tuple[list[tuple[object, ...]], int], total: int) -> None:
    """One session whose workers are killed, five times one of them."""
    rng = np.random.default_rng(2)
    folder = workspace(base / "worker", SMALL)
    shares = [(kill + rng.random()) / (KILLS + 1) for kill in range(KILLS)]
    driver, killed = start(folder, "small"), 0
    while driver.poll() is None:
        if killed < KILLS and len(stored(folder, "small")) >= total * shares[killed]:
            victims = workers_of(driver.pid)
            if victims:
                os.kill(int(rng.choice(victims)), signal.SIGKILL)
                killed += 1
                print(f"worker killed with {len(stored(folder, 'small'))} of {total} results stored", flush=True)
        time.sleep(0.1)
    finish(driver)
    surplus = len(stored(folder, "small")) - total
    check(f"a worker killed {killed} times", outcome(folder, "small"), expected, surplus)


def check(
    what: str, ended: tuple[list[tuple[object, ...]], int], expected: tuple[list[tuple[object, ...]], int], surplus: int
) -> None:
    """Say whether a disturbed sweep came to the same as the undisturbed one."""
    same = sum(ours == theirs for ours, theirs in zip(ended[0], expected[0], strict=False))
    winner = "the same winner" if ended[1] == expected[1] else f"ANOTHER WINNER: {ended[1]}, not {expected[1]}"
    found(f"{what}: trials as undisturbed", same, target=len(expected[0]), at_least=True, note=winner)
    found(f"{what}: results done twice or too many", surplus, target=0)


def workers(base: Path) -> None:
    """Wall time of forty networks with one worker and with two, in turn, three times."""
    ratios, processor = [], []
    for turn in range(3):
        seconds, ended, spent = {}, {}, {}
        for n in (1, 2):
            folder = workspace(base / f"workers-{turn}-{n}", FORTY)
            finish(start(folder, "forty", "--workers", str(n)))
            record = json.loads((folder / "runs" / "forty" / "sweep.json").read_text())
            seconds[n], ended[n] = record["wall_s"], outcome(folder, "forty")
            spent[n] = sum(trial["cpu_s"] for trial in record["trials"])
            load = os.getloadavg()[0]
            print(f"{n} workers: {seconds[n]:.1f} s wall, {spent[n]:.1f} s of processor in trials, load {load:.1f}")
        ratios.append(seconds[1] / seconds[2])
        # How much dearer a trial gets beside another one, by shared caches: the machine's own bound on the ratio.
        processor.append(spent[1] / spent[2])
        same = "the same" if ended[1] == ended[2] else "OTHER"
        print(f"ratio {ratios[-1]:.2f}, {same} trials and winner", flush=True)
    share = float(np.median(processor))
    note = f"median of three; processor time of the trials with one worker by that with two {share:.2f}"
    found("two workers against one", float(np.median(ratios)), "x", target=1.8, at_least=True, note=note)


def dask(base: Path) -> None:
    """Two Dask workers by address, one of them killed."""
    expected = outcome(base / "undisturbed", "small") if (base / "undisturbed").exists() else undisturbed(base)
    address = "tcp://127.0.0.1:18786"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "18786", "--no-dashboard", "--no-show"],
        **quiet,
    )
    worker = [
        sys.executable,
        "-m",
        "distributed.cli.dask_worker",
        address,
        "--nthreads",
        "1",
        "--no-dashboard",
        "--no-nanny",
    ]
    crew = [subprocess.Popen(worker, **quiet) for _ in range(2)]
    try:
        folder = workspace(base / "dask", SMALL + f"cluster: {address}\n")
        driver, killed, total = start(folder, "small"), False, len(expected[0])
        while driver.poll() is None:
            if not killed and len(stored(folder, "small")) > 0.3 * total:
                crew[0].send_signal(signal.SIGKILL)
                killed = True
                print(f"Dask worker killed with {len(stored(folder, 'small'))} results stored", flush=True)
            time.sleep(0.1)
        finish(driver)
        surplus = len(stored(folder, "small")) - len(stored(base / "undisturbed", "small"))
        check("Dask by address, one of two workers killed", outcome(folder, "small"), expected, surplus)
    finally:
        for process in [*crew, scheduler]:
            process.kill()


def tracking(base: Path) -> None:
    """Logging 500 finished trials into SQLite."""
    from sqlalchemy import event
    from sqlalchemy.engine import Engine

    from sysid.reporting.sweep_record import read_sweep
    from sysid.workbench.runner.events import SweepReady
    from sysid.workbench.tracking.listener import Tracker
    from sysid.workbench.tracking.mlflow_store import connect

    if not (base / "undisturbed").exists():
        undisturbed(base)
    folder = base / "undisturbed" / "runs" / "small"
    record = read_sweep(folder)
    tracker = Tracker.of_workspace(base, print)
    connect(tracker.uri)
    ready = SweepReady(record=record, folder=folder, command="sysid sweep small", data="rig", seed=0)
    commits: list[object] = []
    event.listen(Engine, "commit", commits.append)
    for what, target in (("for the first time", 15.0), ("again, with nothing new", None)):
        commits.clear()
        began, cpu = time.perf_counter(), time.process_time()
        tracker(ready)
        wall, spent = time.perf_counter() - began, time.process_time() - cpu
        note = f"{spent:.1f} s of processor, {len(commits)} commits, load {os.getloadavg()[0]:.1f}"
        note += "".join(f"; FAILED: {failure}" for failure in tracker.failures)
        found(f"{len(record.trials)} trials and a summary logged {what}", wall, "s", target=target, note=note)


def main() -> None:
    """Run the parts that are asked for."""
    only = [argument.removeprefix("--only=") for argument in sys.argv[1:] if argument.startswith("--only=")]
    base = Path(tempfile.mkdtemp(prefix="sweep-"))
    try:
        for part in only or PARTS:
            {"kills": kills, "workers": workers, "dask": dask, "tracking": tracking}[part](base)
    finally:
        shutil.rmtree(base, ignore_errors=True)


if __name__ == "__main__":
    main()
