"""``sysid surrogate``: from a slow model to a surrogate in its place."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sysid.errors import ConfigError
from sysid.names import slug
from sysid.references.described import Wish
from sysid.workbench.fits.config import find_pipeline
from sysid.workbench.listeners import Listeners
from sysid.workbench.runner.program import Program, carry_out
from sysid.workbench.surrogates.make import make_surrogate
from sysid.workbench.surrogates.plan import pairs, written


def wish_of(ranges: Sequence[str], parameters: Sequence[str], outputs: Sequence[str], **times: float | None) -> Wish:
    """What was typed beside an FMU."""
    return Wish(
        ranges=pairs(ranges, "--range"), parameters=pairs(parameters, "--parameter"), outputs=tuple(outputs), **times
    )


FUNCTION = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")
"""A Python function, which is named in a pipeline and not here."""


def _is_fmu(source: str) -> bool:
    """Whether a source is taken for an FMU: whoever reads it refuses what is none, and says what to do."""
    file = Path(source)
    return bool(FUNCTION.fullmatch(source)) or file.suffix.lower() == ".fmu" or (
        file.is_file() and file.suffix.lower() not in {".yaml", ".yml"}
    )  # fmt: skip


def no_options(wish: Wish, where: str, what: str) -> None:
    """Refuse what is said beside an FMU where there is none: it would be passed over.

    Args:
        wish: What was typed.
        where: What was named in its place.
        what: Why these say nothing there.

    Raises:
        ConfigError: If something was.
    """
    said = {
        "--range": wish.ranges, "--parameter": wish.parameters, "--output": wish.outputs,
        "--sample-time": wish.sample_time, "--duration": wish.duration,
    }  # fmt: skip
    if given := [flag for flag, value in said.items() if value]:
        raise ConfigError(
            what, where=where, expected="such options beside an FMU alone", got=", ".join(given),
            remedy="leave them out; a pipeline of kind experiment has them as fields",
        )  # fmt: skip


def surrogate_command(
    source: str, wish: Wish, *, minutes: float, proof: int | None, rounds: int | None, workers: int | None, seed: int,
    out: Path | None, tracking: bool,
) -> int:  # fmt: skip
    """Make a surrogate and say how it does.

    Args:
        source: An FMU, or a pipeline of kind ``experiment``. **It is code, and is run.**
        wish: What is said beside an FMU.
        minutes: Time for all.
        proof: New experiments.
        rounds: Rounds of added experiments, in place of those of the pipeline.
        workers: Processes; as the pipeline says, and of an FMU two, by default.
        seed: Of everything random.
        out: Folder of the results.
        tracking: Whether fits are tracked.

    Returns:
        Exit code.

    Raises:
        UserError: If the reference cannot be used, or does not say enough.
    """
    fmu = _is_fmu(source)
    if not fmu:
        no_options(wish, source, "a pipeline says its ports and times itself")
    folder = out or Path("runs") / f"surrogate-{slug(Path(source).stem)}"
    listeners = Listeners.of(tracking=tracking)
    target, command = listeners.target, f"sysid surrogate {source} --minutes {minutes:g}"
    target.print(f"{source} is code and is run with your rights.", soft_wrap=True, markup=False)
    pipeline, notes = find_pipeline(source) if not fmu else Path(source), list[str]()
    if fmu:
        pipeline, notes = written(Path(source), wish, folder, minutes=minutes, workers=workers or 2, seed=seed)
        target.print(f"Proposed: {pipeline}; change it and run this again to have it otherwise.", soft_wrap=True)
    for note in notes:
        target.print(f"  {note}", soft_wrap=True, markup=False)

    def perform(program: Program[Any], place: Path) -> Any:
        return carry_out(program, place, command=command, watchers=listeners.watchers)

    try:
        made = make_surrogate(
            pipeline, folder, perform=perform, minutes=minutes, proof=proof, rounds=rounds, workers=workers,
            seed=seed, say=lambda text: target.print(text, markup=False, soft_wrap=True),
        )  # fmt: skip
    finally:
        listeners.screen.close()
    for line in [*made.proof.sentences(), *(f"note: {one}" for one in made.notes)]:
        target.print(line, soft_wrap=True, markup=False)
    for name, path in {"Report": made.report, "Bundle": made.bundle, "FMU": made.fmu}.items():
        if path is not None:
            target.print(f"{name + ':':<9}{path}", soft_wrap=True, markup=False)
    return 0
