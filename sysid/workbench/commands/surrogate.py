"""``sysid surrogate``: from a slow model to a surrogate in its place."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sysid.errors import ConfigError
from sysid.names import slug
from sysid.references.described import Wish
from sysid.references.sources import TABLES, source_of
from sysid.workbench.fits.config import find_pipeline
from sysid.workbench.listeners import Listeners
from sysid.workbench.runner.program import Program, carry_out
from sysid.workbench.surrogates.make import make_surrogate
from sysid.workbench.surrogates.plan import named, pairs, written
from sysid.yaml_files import read_yaml


def wish_of(ranges: Sequence[str], parameters: Sequence[str], outputs: Sequence[str], **times: float | None) -> Wish:
    """What was typed beside a reference."""
    inputs, varied, given = pairs(ranges, "--range"), pairs(parameters, "--parameter"), dict(map(named, outputs))
    units = {**given, **{name: unit for name, (_, unit) in (*inputs.items(), *varied.items())}}
    return Wish(
        ranges={name: span for name, (span, _) in inputs.items()},
        parameters={name: span for name, (span, _) in varied.items()},
        outputs=tuple(given), units={name: unit for name, unit in units.items() if unit}, **times,
    )  # fmt: skip


def _pipeline_of(source: str) -> Path | None:
    """The pipeline that a source names; nothing where that is a reference, or a file that says less than a pipeline."""
    file = Path(source)
    if file.suffix.lower() in TABLES and file.is_file():
        return file if "kind" in read_yaml(file) else None
    words = len(source.split()) > 1 or ":" in source or file.suffix.lower() in {".fmu", ".py"}
    return None if words or file.is_file() else find_pipeline(source)


def no_options(wish: Wish, where: str, what: str) -> None:
    """Refuse what is said beside a reference where there is none: it would be passed over.

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
            what, where=where, expected="such options beside a reference alone", got=", ".join(given),
            remedy="leave them out; a pipeline of kind experiment has them as fields",
        )  # fmt: skip


def surrogate_command(
    source: str, wish: Wish, *, minutes: float, proof: int | None, rounds: int | None, workers: int | None, seed: int,
    out: Path | None, tracking: bool, began: float,
) -> int:  # fmt: skip
    """Make a surrogate and say how it does.

    Args:
        source: A reference, as :func:`~sysid.references.sources.source_of` takes it, or a pipeline of kind
            ``experiment``. **It is code, and is run.**
        wish: What is said beside a reference.
        minutes: Time for all.
        proof: New experiments.
        rounds: Rounds of added experiments, in place of those of the pipeline.
        workers: Processes; as the pipeline says, and two of a reference, by default.
        seed: Of everything random.
        out: Folder of the results.
        tracking: Whether fits are tracked.
        began: When the time began, by ``time.monotonic``.

    Returns:
        Exit code.

    Raises:
        UserError: If the reference cannot be used, or does not say enough.
    """
    pipeline, notes = _pipeline_of(source), list[str]()
    reference = None if pipeline is not None else source_of(source)
    if reference is None:
        no_options(wish, source, "a pipeline says its ports and times itself")
    folder = out or Path("runs") / f"surrogate-{slug(Path(source).stem if reference is None else reference.name)}"
    listeners = Listeners.of(tracking=tracking)
    target, command = listeners.target, f"sysid surrogate {shlex.quote(source)} --minutes {minutes:g}"
    target.print(f"{source} is code and is run with your rights.", soft_wrap=True, markup=False)
    if reference is not None:
        pipeline, notes = written(reference, wish, folder, minutes=minutes, workers=workers or 2, seed=seed)
        target.print(f"Proposed: {pipeline}; change it and run this again to have it otherwise.", soft_wrap=True)
    assert pipeline is not None  # noqa: S101 - found, or written now
    for note in notes:
        target.print(f"  {note}", soft_wrap=True, markup=False)

    def perform(program: Program[Any], place: Path) -> Any:
        return carry_out(program, place, command=command, watchers=listeners.watchers)

    try:
        made = make_surrogate(
            pipeline, folder, perform=perform, minutes=minutes, proof=proof, rounds=rounds, workers=workers,
            seed=seed, began=began, say=lambda text: target.print(text, markup=False, soft_wrap=True),
        )  # fmt: skip
    finally:
        listeners.screen.close()
    for line in [*made.proof.sentences(), *(f"note: {one}" for one in made.notes)]:
        target.print(line, soft_wrap=True, markup=False)
    for name, path in {"Report": made.report, "Bundle": made.bundle, "FMU": made.fmu}.items():
        if path is not None:
            target.print(f"{name + ':':<9}{path}", soft_wrap=True, markup=False)
    return 0
