"""``sysid surrogate``: from a slow model to a surrogate in its place."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sysid.references.described import Wish
from sysid.workbench.listeners import Listeners
from sysid.workbench.runner.events import Event
from sysid.workbench.runner.program import Program, carry_out
from sysid.workbench.surrogates.asked import surrogate_of


def surrogate_command(
    source: str, wish: Wish, *, minutes: float, proof: int | None, rounds: int | None, workers: int | None, seed: int,
    out: Path | None, tracking: bool, began: float,
) -> int:  # fmt: skip
    """Make a surrogate and say how it does; ``began`` is when the time began, by ``time.monotonic``.

    The source **is code, and is run**.
    """
    listeners = Listeners.of(tracking=tracking)
    target = listeners.target
    asked = {
        "--minutes": f"{minutes:g}",
        "--proof": proof,
        "--rounds": rounds,
        "--workers": workers,
        "--seed": seed or None,
    }
    command = _command(source, wish, {**asked, "--out": out})

    def perform(program: Program[Any], place: Path) -> Any:
        return carry_out(program, place, command=command, watchers=listeners.watchers)

    def watch(event: Event) -> None:
        for one in (listeners.screen, listeners.log):
            one(event)

    try:
        made = surrogate_of(
            source, wish, out, perform=perform, minutes=minutes, proof=proof, rounds=rounds, workers=workers,
            seed=seed, began=began, say=lambda text: target.print(text, markup=False, soft_wrap=True), watch=watch,
        )  # fmt: skip
    finally:
        listeners.screen.close()
    for line in [*made.proof.sentences(), *(f"note: {one}" for one in made.notes)]:
        target.print(line, soft_wrap=True, markup=False)
    for name, path in {"Report": made.report, "Bundle": made.bundle, "FMU": made.fmu}.items():
        if path is not None:
            target.print(f"{name + ':':<9}{path}", soft_wrap=True, markup=False)
    return 0


def _command(source: str, wish: Wish, asked: Mapping[str, object]) -> str:
    """The command as it was typed, for who makes it again."""

    def named(name: str) -> str:
        unit = wish.units.get(name, {})
        return f"{name} [{' '.join(unit.values())}]" if unit else name

    said = [
        (flag, f"{named(name)}={low:.12g}:{high:.12g}")
        for flag, ranges in (("--range", wish.ranges), ("--parameter", wish.parameters))
        for name, (low, high) in ranges.items()
    ]
    said += [("--output", named(name)) for name in wish.outputs]
    times = {"--sample-time": wish.sample_time, "--duration": wish.duration}
    said += [(flag, str(value)) for flag, value in {**times, **asked}.items() if value is not None]
    return shlex.join(["sysid", "surrogate", source, *(word for pair in said for word in pair)])
