"""A surrogate that real signals end ten times, in the middle of everything, goes on, and nothing is run twice."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sysid.reporting.judging.results import FOLDER
from sysid.workbench.sweep.store import TRIALS
from tests.workbench.surrogates.ended_from_outside import SESSIONS

pytest.importorskip("fmpy")
CODES = {"SIGTERM": 143, "SIGINT": 130, "SIGHUP": 129}


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no signals there")
def test_a_surrogate_that_is_ended_ten_times_goes_on_and_runs_nothing_twice(tmp_path: Path) -> None:
    script = Path(__file__).with_name("ended_from_outside.py")
    done = subprocess.run([sys.executable, str(script), str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    told = json.loads(done.stdout.splitlines()[-1])
    codes, counts = zip(*told["ended"], told["after"], strict=True)
    assert codes == (*(CODES[name] for name, _ in SESSIONS), 0), done.stdout[-3000:]
    for name in CODES:
        said = f"{'stopped' if name == 'SIGINT' else f'ended by {name}'}; the same command goes on where this one was"
        assert done.stderr.count(said) == sum(one == name for one, _ in SESSIONS)
    whole, ended = (tmp_path / name for name in ("whole", "ended"))
    ran = [set((place / "lag.py.log").read_text(encoding="utf-8").splitlines()) for place in (whole, ended)]
    assert ran[0] == ran[1]
    # What was on its way when a session ended is run again; nothing else is, and nothing at all once all was run.
    places = [at for _, at in SESSIONS]
    assert counts[-1] <= told["whole"][1] + sum(at in {"experiments", "proof"} for at in places)
    search, page = places.index("Searching"), places.index("page")
    assert counts[search] == counts[places.index("proof") - 1]
    assert counts[page] == counts[-1]
    first, second = (json.loads((place / "out/model" / FOLDER / "proof.json").read_text()) for place in (whole, ended))
    assert [first[name] for name in ("scenes", "subjects", "told")] == [
        second[name] for name in ("scenes", "subjects", "told")
    ]
    told_of = [line for line in done.stdout.splitlines() if line.startswith(("note: ", "Error of "))]
    assert len(told_of) == 4
    assert told_of[:2] == told_of[2:], "a session that ends, first and last, says the same of the proof"
    # Nothing half done is left.
    files = [
        {str(one.relative_to(place)) for one in (place / "out").rglob("*") if TRIALS not in one.parts}
        for place in (whole, ended)
    ]
    assert files[0] == files[1]
    assert all(
        "Of 8 new random experiments" in (place / "out/model/report/index.html").read_text() for place in (whole, ended)
    )
