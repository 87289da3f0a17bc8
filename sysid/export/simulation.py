"""A bundle run over inputs: what ``sysid simulate`` does, as one call."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.export.bundle import Bundle, channel_of
from sysid.export.command_table import CommandTable, read_command
from sysid.export.flags import MEANING, Flag, Held, expected_flags, limits_reached
from sysid.export.inputs import check_constants, ticking, with_constants
from sysid.export.measured_run import Initial, able, check_able, check_one_start, obstacle, run_measured, run_with
from sysid.export.ranges import taking_rounding
from sysid.export.reading import read_bundle
from sysid.export.surrogate import Surrogate
from sysid.ingest.memory.run_records import record_of
from sysid.models import Start, StartKind, StartLike
from sysid.models.channels.ends import check_record
from sysid.traces import Channel, Trace
from sysid.validation.metrics import Figures, figures


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulation:
    """A free run of a bundle.

    Args:
        trace: Inputs, then outputs, at every sample.
        inputs: Names of the inputs.
        outputs: Names of the outputs.
        flags: Of every sample, bits of :class:`sysid.export.Flag`.
        held: Which declared limits held which outputs, and for how much of the run.
        start: How the run begins.
        firsts: By output that begins by its measured samples: how many at the beginning say how it goes on; they are
            not scored. What is not among them begins at rest.
        initial: What somebody gave that stands before the first sample.
        note: Why measured outputs say nothing of how the run begins; empty where they do, or there are none.
        scored: By output that was measured: figures of the run on the samples after :attr:`firsts`.
    """

    trace: Trace
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    flags: NDArray[np.int32]
    held: tuple[Held, ...] = ()
    start: Start = field(default_factory=Start)
    firsts: Dict[str, int] = field(default_factory=dict)
    initial: Initial = None
    note: str = ""
    scored: Dict[str, Figures] = field(default_factory=dict)

    @property
    def first(self) -> int:
        """Samples at the beginning of which some output was measured to say how it goes on."""
        return max(self.firsts.values(), default=0)

    @property
    def begins(self) -> str:
        """How the run begins, as a sentence."""
        alike: dict[int | None, list[str]] = {}
        for name in self.outputs:
            alike.setdefault(self.firsts.get(name), []).append(name)
        told = [(", ".join(names), self._begins(first, len(names))) for first, names in alike.items()]
        text = told[0][1] if len(told) == 1 else "; ".join(f"{names}: {how}" for names, how in told)
        return f"{text}; {self.note}" if self.note else text

    def _begins(self, first: int | None, count: int) -> str:
        if first:
            what = {
                StartKind.ESTIMATED: "its initial state is estimated on",
                StartKind.MEASURED: "it goes on from",
            }[self.start.kind]
            time, output = self.trace.time, "output" if count == 1 else "outputs"
            return (
                f"{what} the first {first} samples of the measured {output} "
                f"({time[0]:.6g} to {time[first - 1]:.6g} s), which are not scored"
            )
        if isinstance(self.initial, tuple):
            return "it goes on from the samples before it"
        if self.initial is not None:
            levels = self.initial if isinstance(self.initial, Dict) else {"the output": self.initial}
            stood = ", ".join(f"{name} has stood at {level:g}" for name, level in levels.items())
            return f"it begins where {stood}"
        if first is None:
            return "it begins at rest, with its inputs at their first sample"
        return "it begins where its channels have stood at their first sample"

    @property
    def sentences(self) -> list[str]:
        """What was raised, and for how much of the run; empty if nothing was."""
        shares = {flag: float(np.mean((self.flags & int(flag)) > 0)) for flag in Flag}
        which = {Flag.AT_LIMIT: f": {'; '.join(one.sentence for one in self.held)}" if self.held else ""}
        return [
            f"in {100.0 * share:.3g} % of the samples {MEANING[flag]}{which.get(flag, '')}"
            for flag, share in shares.items()
            if share
        ]


def simulate_bundle(
    bundle: Bundle | str | Path,
    inputs: Trace | CommandTable | str | Path | Any,
    *,
    time_unit: str | None = None,
    unit: str | None = None,
    initial: Initial = None,
    start: StartLike | None = None,
    constants: Dict[str, float] | None = None,
) -> Simulation:
    """Run a bundle's model or cascade on nothing but its inputs.

    Args:
        bundle: The bundle, its folder or its zip, or the folder of the run that exported it.
        inputs: A trace with the inputs; a frame or dict with columns by name, or an array of the inputs; a command
            table; or a file with one, as :func:`read_command` reads it. A file of samples is read with
            :func:`sysid.export.inputs.read_inputs` first.
        time_unit: Unit of a command file's times, where it does not say.
        unit: Unit of a command file's values, likewise.
        initial: The output before the first sample, in its unit; of several outputs a dict by name; or the pair
            ``(u, y)`` of the samples before, oldest first. The declared levels by default.
        start: How the run begins. By default as the bundle's cases did, where the trace has the measured output (the
            initial state is estimated, unless a pipeline said otherwise); at rest without it. Of several models each
            begins by its own outputs; those that read each other begin at rest.
        constants: Inputs that are a number, by name, in the bundle's unit.

    Returns:
        Every channel at every sample, and the flags.

    Raises:
        BundleError: If the bundle is damaged or incomplete.
        ConfigError: If the run cannot begin so, or ``initial`` would say nothing.
        UserError: If the inputs cannot be read or are not the bundle's.
    """
    read = bundle if isinstance(bundle, Bundle) else read_bundle(Path(bundle))
    channels, outputs = (tuple(map(channel_of, entries)) for entries in (read.inputs, read.outputs))
    numbers, sample_time = ticking(read, constants or {}), read.model.sample_time
    check_constants(numbers, channels)
    others = tuple(channel for channel in channels if channel.name not in numbers)
    if isinstance(inputs, str | Path):
        inputs = read_command(inputs, others or channels, time_unit=time_unit, unit=unit)
    if isinstance(inputs, CommandTable):
        given = inputs.trace(sample_time)
    else:
        given = record_of(inputs, others, outputs, sample_time=sample_time)
    check_record({channel.name: channel.unit for channel in (*channels, *outputs)}, sample_time, given)
    begin = None if start is None else Start.of(start)
    return _run(read, with_constants(given, channels, numbers), channels, initial, begin)


def declared_start(bundle: Bundle) -> Start:
    """How the free runs of a bundle's cases began; estimated where nobody said how those of several models do."""
    declared = dict(bundle.metadata.get("cases_start", {"kind": StartKind.ESTIMATED.value}))
    said = declared.pop("said", bundle.model.single is not None or bool(bundle.model.rest))
    start = Start(**declared)
    return Start(kind=StartKind.ESTIMATED) if start.kind is StartKind.REST and not said else start


def _run(
    bundle: Bundle, given: Trace, channels: tuple[Channel, ...], initial: Initial, start: Start | None
) -> Simulation:
    outputs = tuple(channel_of(entry) for entry in bundle.outputs)
    names, targets = tuple(channel.name for channel in channels), [channel.name for channel in outputs]
    surrogate = Surrogate.of(bundle.model, taking_rounding(bundle.ranges), outputs=targets)
    measured = [name for name in targets if name in given.channel_names]
    start, note = _start(bundle, given, measured, initial, start)
    values, firsts = given.columns(names), dict[str, int]()
    if start.kind is StartKind.REST:
        _check_level(targets, initial)
        computed = run_with(surrogate, values, initial)
    else:
        run = run_measured(surrogate, values, {name: given[name] for name in measured}, start, given.usable_samples)
        computed, firsts = run.computed, {name: first for name, first in run.first.items() if name in targets}
    trace = Trace(
        name=given.name,
        sample_time=given.sample_time,
        start_time=given.start_time,
        channels=(*channels, *outputs),
        values=np.column_stack([values, surrogate.chosen(computed)]),
        usable=None if measured or given.usable is None else given.usable_of(names),
        provenance=(*given.provenance, f"{surrogate.mapping} simulated in free run by {bundle.folder}"),
    )
    return Simulation(
        trace=trace,
        inputs=names,
        outputs=tuple(targets),
        flags=expected_flags(surrogate, values, computed),
        held=tuple(limits_reached(surrogate, values, computed)),
        start=start,
        firsts=firsts,
        initial=initial,
        note=note,
        scored=_scored(given, trace, measured, firsts),
    )


def _scored(given: Trace, trace: Trace, measured: list[str], firsts: Dict[str, int]) -> dict[str, Figures]:
    """Figures of each output that was measured, on the samples that did not say how it begins."""
    found = {}
    for name in measured:
        counted = slice(firsts.get(name, 0), None)
        usable = given.usable_of([*trace.channel_names])[counted]
        if usable.any():
            found[name] = figures(given[name][counted], trace[name][counted], trace.channel(name).unit, usable)
    return found


def _start(
    bundle: Bundle, given: Trace, measured: list[str], initial: Initial, start: Start | None
) -> tuple[Start, str]:
    """How the run begins: as is said, or as there is something to begin from; and why not by what was measured."""
    check_one_start(initial, start)
    if initial is not None or (start is not None and start.kind is StartKind.REST):
        return Start(), ""
    if start is not None:
        check_able(bundle.model, measured, start, where=given.name)
    start = declared_start(bundle) if start is None else start
    if start.kind is StartKind.REST or not measured:
        return Start(), ""
    begun, why = able(bundle.model, measured), obstacle(bundle.model)
    if why:
        return Start(), f"{why}, and no initial state is estimated from what was measured"
    waits = [name for name in measured if name not in begun]
    told = f"what was measured of {', '.join(waits)} says too little: other outputs of the model were not measured"
    note = told if waits else ""
    return start if begun else Start(), note


def _check_level(targets: list[str], initial: Initial) -> None:
    if len(targets) > 1 and initial is not None and not isinstance(initial, Dict | tuple):
        raise ConfigError(
            "the outputs cannot all begin at one value",
            where="initial",
            expected="a number for each of them",
            got=f"one number for {', '.join(targets)}",
            remedy=f'leave it out: each begins at its declared level; or name them, --initial "{targets[0]}=..." for '
            f'each, in Python initial={{"{targets[0]}": ...}}',
        )
