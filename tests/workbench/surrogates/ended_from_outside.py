"""``sysid surrogate``, ended by real signals in the middle of what it does; ``test_ended.py`` runs it.

Every session is a process of its own, forked once all is imported. What it is ended by is sent to it from within, where
the words of :data:`SESSIONS` say, so that it always comes to the same place.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy  # noqa: F401 - what every session needs is loaded once, before they are forked
import matplotlib.figure  # noqa: F401
import numpy as np
import pint  # noqa: F401
import scipy.signal  # noqa: F401

import sysid
import sysid.workbench.surrogates.make
from sysid.export import writing
from sysid.export.fmi import units
from sysid.kernels.passages import closest
from sysid.reporting import charts, parts, report
from sysid.workbench import cli
from sysid.workbench.auto import budget, finish, ledger, plan
from sysid.workbench.auto.families import Family, Try
from sysid.workbench.runner.events import Event, StepProgress, StepStarted
from sysid.workbench.runner.screen import LogFile
from sysid.workbench.surrogates import work

SESSIONS = (
    ("SIGTERM", "experiments"), ("SIGINT", "experiments"), ("SIGTERM", "Searching"), ("SIGINT", "Fitting best"),
    ("SIGTERM", "export"), ("SIGTERM", "proof"), ("SIGINT", "proof"), ("SIGHUP", "proof"), ("SIGTERM", "page"),
    ("SIGINT", "page"),
)  # fmt: skip
LAG = """\
def lag(time, inputs, parameters):
    with open(__file__ + ".log", "a") as log:
        log.write(f"{inputs.sum():.17g}\\n")
    y, out = 0.0, inputs.copy()
    for k, u in enumerate(inputs[:, 0]):
        out[k] = y = 0.8 * y + 0.2 * u
    return out
"""
PIPELINE: dict[str, Any] = {
    "kind": "experiment", "name": "lag", "workers": 1,
    "reference": {
        "python": "lag.py:lag", "folder": ".", "sample_time": 0.5,
        "inputs": {"u": {"unit": "V", "range": [0, 2], "start": 0}}, "outputs": {"y": {"unit": "V"}},
    },
    "experiment": {"duration": 20.0, "runs": {"estimation": 4, "selection": 2, "test": 1}},
}  # fmt: skip
COMMAND = ["surrogate", "lag.yaml", "--minutes", "2", "--proof", "8", "--workers", "1", "--out", "out", "--no-tracking"]


def end(name: str) -> None:
    """Send a signal to this process."""
    os.kill(os.getpid(), signal.Signals[name])


def after(calls: int, function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """A function that ends the process once it has been called so often."""
    left = [calls]

    def called(*args: Any, **options: Any) -> Any:
        found = function(*args, **options)
        left[0] -= 1
        if left[0] == 0:
            end(name)
        return found

    return called


def arm(name: str, at: str) -> None:
    """Make this process end in the middle of something."""
    steps = {"experiments": "Running the reference", "proof": "Proving"}
    if at == "export":
        writing.check_parity = after(2, writing.check_parity, name)  # of three formats
    elif at == "page":
        report.render_html = after(1, report.render_html, name)  # its results and the page are yet to be written
    else:
        told = LogFile.__call__

        def heard(log: LogFile, event: Event) -> None:
            told(log, event)
            here = isinstance(event, StepProgress | StepStarted) and event.step.startswith(steps.get(at, at))
            half = here and isinstance(event, StepProgress) and (event.fraction or 0.0) >= 0.4
            begun = here and isinstance(event, StepStarted) and at not in steps
            if half or begun:
                end(name)

        LogFile.__call__ = heard  # type: ignore[method-assign]


def session(place: Path, *, ended: tuple[str, str] | None = None) -> int:
    """The exit code of a session in a process of its own."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    os.chdir(place)
    os.environ["SYSID_CACHE"] = str(place / "cache")
    if ended is not None:
        arm(*ended)
    sys.argv = ["sysid", *COMMAND]
    code: object = 1
    try:
        cli.main()
    except SystemExit as left:
        code = left.code
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code if isinstance(code, int) else 1)


def runs(place: Path) -> int:
    """How often the reference was run so far."""
    return len((place / "lag.py.log").read_text(encoding="utf-8").splitlines())


def main() -> None:
    """A surrogate that nothing ends, and one that everything does; what each came to, as JSON."""
    lag = Family(kind="ARX", linear=True, first=lambda _: [Try(structure=sysid.ARX(na=1, nb=(1,), nk=(0,)))])
    ledger.FAMILIES = (lag,)
    plan.suggested = lambda *_, **__: []
    parts.svg = lambda *_, **__: "<svg/>"
    charts.chart_figure = lambda *_: None
    finish.pace = lambda: 1.0  # it draws pictures to find it
    finish.slowness = budget.slowness = work.slowness = lambda: 1.0  # it is busy to find it
    # What every session would read and load anew: all units, and all that Numba knows of.
    units.unit_definitions(["V"])
    closest(np.zeros((3, 1)), np.zeros(1, dtype=np.int64), 0, 1)
    found: dict[str, Any] = {"ended": []}
    for name in ("whole", "ended"):
        place = Path(sys.argv[1]).resolve() / name
        place.mkdir()
        (place / "lag.py").write_text(LAG, encoding="utf-8")
        (place / "lag.yaml").write_text(json.dumps(PIPELINE), encoding="utf-8")
        for one in SESSIONS if name == "ended" else ():
            found["ended"].append([session(place, ended=one), runs(place)])
        found[name if name == "whole" else "after"] = [session(place), runs(place)]
    print(json.dumps(found))  # noqa: T201 - read by the test


if __name__ == "__main__":
    main()
