"""``sysid surrogate``: from a slow model to a surrogate in its place."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

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


def surrogate_command(
    source: str, wish: Wish, *, minutes: float, proof: int | None, rounds: int | None, workers: int, seed: int,
    out: Path | None, tracking: bool,
) -> int:  # fmt: skip
    """Make a surrogate and say how it does.

    Args:
        source: An FMU, or a pipeline of kind ``experiment``. **It is code, and is run.**
        wish: What is said beside an FMU.
        minutes: Time for all.
        proof: New experiments.
        rounds: Rounds of added experiments, in place of those of the pipeline.
        workers: Processes.
        seed: Of everything random.
        out: Folder of the results.
        tracking: Whether fits are tracked.

    Returns:
        Exit code.

    Raises:
        UserError: If the reference cannot be used, or does not say enough.
    """
    fmu = source.lower().endswith(".fmu")
    folder = out or Path("runs") / f"surrogate-{slug(Path(source).stem)}"
    listeners = Listeners.of(tracking=tracking)
    target, command = listeners.target, f"sysid surrogate {source} --minutes {minutes:g}"
    target.print(f"{source} is code and is run with your rights.", soft_wrap=True, markup=False)
    pipeline, notes = find_pipeline(source) if not fmu else Path(source), list[str]()
    if fmu:
        pipeline, notes = written(Path(source), wish, folder, minutes=minutes, workers=workers, seed=seed)
        target.print(f"Proposed: {pipeline}; change it and run this again to have it otherwise.", soft_wrap=True)
    for note in notes:
        target.print(f"  {note}", soft_wrap=True, markup=False)

    def perform(program: Program[Any], place: Path) -> Any:
        return carry_out(program, place, command=command, watchers=listeners.watchers)

    try:
        made = make_surrogate(
            pipeline, folder, perform=perform, minutes=minutes, proof=proof, rounds=rounds, seed=seed,
            say=lambda text: target.print(text, markup=False, soft_wrap=True),
        )  # fmt: skip
    finally:
        listeners.screen.close()
    for line in [*made.proof.sentences(), *(f"note: {one}" for one in made.notes)]:
        target.print(line, soft_wrap=True, markup=False)
    for name, path in {"Report": made.report, "Bundle": made.bundle, "FMU": made.fmu}.items():
        if path is not None:
            target.print(f"{name + ':':<9}{path}", soft_wrap=True, markup=False)
    return 0
