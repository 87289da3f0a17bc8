"""``sysid sweep``: a sweep with everybody who listens to it."""

from __future__ import annotations

import shlex
from pathlib import Path

from sysid.errors import ConfigError
from sysid.workbench.fits.config import find_pipeline
from sysid.workbench.kinds import KINDS, RunRequest, kind_of
from sysid.workbench.listeners import perform
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.run import program
from sysid.workbench.sweep.store import TRIALS, TrialStore
from sysid.workbench.sweep.sweep_steps import Sweep


def sweep_command(
    pipeline: str, *, workers: int | None, resume: bool, fresh: bool, out: Path | None, tracking: bool
) -> int:
    """Run a sweep and show how it came out."""
    path = find_pipeline(pipeline)
    kind = kind_of(path)
    if kind != "sweep":
        raise ConfigError(
            f"{pipeline} is not a sweep",
            where=path,
            expected="a pipeline with kind: sweep",
            got=f"kind: {kind}",
            remedy=f"run it with: sysid run {shlex.quote(pipeline)}" if kind in KINDS else "correct the kind",
        )
    folder = out or Path("runs") / Sweep.read(SweepConfig, path).config.name
    if resume and TrialStore(path=folder / TRIALS).count() == 0:
        raise ConfigError(
            "there is no sweep to go on with",
            where=folder,
            expected="a run folder with finished trials",
            remedy="leave --resume out to begin one, or name its folder with --out",
        )
    request = RunRequest(path=path, typed=pipeline, fresh=fresh, out=out, tracking=tracking, workers=workers)
    return perform(program(request), request)
