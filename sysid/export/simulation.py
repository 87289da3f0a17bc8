"""A bundle run over inputs: what ``sysid simulate`` does, as one call."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError
from sysid.export.bundle import Bundle
from sysid.export.command_table import CommandTable, read_command
from sysid.export.flags import MEANING, Flag, Held, expected_flags, limits_reached
from sysid.export.inputs import channel_of, check_constants, with_constants
from sysid.export.reading import read_bundle
from sysid.export.surrogate import Surrogate
from sysid.models import Start, StartKind, beginning
from sysid.models.ends import check_record
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
        first: Samples at its beginning that were measured, and say how it goes on; they are not scored.
        initial: The output before the first sample, where somebody gave it.
        scored: By output that was measured: figures of the run on the samples after :attr:`first`.
    """

    trace: Trace
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    flags: NDArray[np.int32]
    held: tuple[Held, ...] = ()
    start: Start = field(default_factory=Start)
    first: int = 0
    initial: float | None = None
    scored: Dict[str, Figures] = field(default_factory=dict)

    @property
    def begins(self) -> str:
        """How the run begins, as a sentence."""
        if self.first:
            what = {
                StartKind.ESTIMATED: "its initial state is estimated on",
                StartKind.MEASURED: "it goes on from",
            }[self.start.kind]
            time = self.trace.time
            return (
                f"{what} the first {self.first} samples of the measured output "
                f"({time[0]:.6g} to {time[self.first - 1]:.6g} s), which are not scored"
            )
        if self.initial is not None:
            return f"it begins where the output has stood at {self.initial:g}"
        if self.start.kind is StartKind.REST:
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
    inputs: Trace | CommandTable | str | Path,
    *,
    time_unit: str | None = None,
    unit: str | None = None,
    initial: float | None = None,
    start: Start | None = None,
    constants: Dict[str, float] | None = None,
) -> Simulation:
    """Run a bundle's model or cascade on nothing but its inputs.

    Args:
        bundle: The bundle, its folder or its zip, or the folder of the run that exported it.
        inputs: A trace with the inputs; a command table; or a file with one, as :func:`read_command` reads it. A file
            of samples is read with :func:`sysid.export.inputs.read_inputs` first.
        time_unit: Unit of a command file's times, where it does not say.
        unit: Unit of a command file's values, likewise.
        initial: The output before the first sample, in its unit; the declared level by default. One output only.
        start: How the run begins. By default as the bundle's cases did, where the trace has the measured output (the
            initial state is estimated, unless a pipeline said otherwise); at rest without it, and for several models.
        constants: Inputs that are a number, by name, in the bundle's unit.

    Returns:
        Every channel at every sample, and the flags.

    Raises:
        BundleError: If the bundle is damaged or incomplete.
        ConfigError: If the run cannot begin so, or ``initial`` would say nothing.
        UserError: If the inputs cannot be read or are not the bundle's.
    """
    read = bundle if isinstance(bundle, Bundle) else read_bundle(Path(bundle))
    channels, numbers = tuple(channel_of(entry) for entry in read.inputs), dict(constants or {})
    check_constants(numbers, channels)
    others = tuple(channel for channel in channels if channel.name not in numbers)
    if isinstance(inputs, str | Path):
        inputs = read_command(inputs, others or channels, time_unit=time_unit, unit=unit)
    sample_time = read.model.sample_time
    given = inputs.trace(sample_time) if isinstance(inputs, CommandTable) else inputs
    check_record({channel.name: channel.unit for channel in channels}, sample_time, given)
    return _run(read, with_constants(given, channels, numbers), channels, initial, start)


def declared_start(bundle: Bundle) -> Start:
    """How the free runs of a bundle's cases began."""
    return Start(**bundle.metadata.get("cases_start", {"kind": StartKind.ESTIMATED.value}))


def _run(
    bundle: Bundle, given: Trace, channels: tuple[Channel, ...], initial: float | None, start: Start | None
) -> Simulation:
    ranges = {entry["name"]: tuple(entry["range"]) for entry in bundle.inputs if entry["range"] is not None}
    outputs = tuple(channel_of(entry) for entry in bundle.outputs)
    names, targets = tuple(channel.name for channel in channels), [channel.name for channel in outputs]
    surrogate = Surrogate.of(bundle.model, ranges, outputs=targets)
    start = _start(bundle, given, targets, initial, start)
    values, measured = given.columns(names), [name for name in targets if name in given.channel_names]
    if start.kind is StartKind.REST:
        computed, first = _from_level(surrogate, values, initial), 0
    else:
        computed, first = _from_measured(bundle, given, values, targets[0], start)
    found = surrogate.chosen(computed)
    trace = Trace(
        name=given.name,
        sample_time=given.sample_time,
        start_time=given.start_time,
        channels=(*channels, *outputs),
        values=np.column_stack([values, found]),
        usable=None if measured else given.usable,
        provenance=(*given.provenance, f"{surrogate.mapping} simulated in free run by {bundle.folder}"),
    )
    counted = given.usable_samples[first:]
    scored = {
        name: figures(given[name][first:], trace[name][first:], trace.channel(name).unit, counted)
        for name in measured
        if counted.any()
    }
    return Simulation(
        trace=trace,
        inputs=names,
        outputs=tuple(targets),
        flags=expected_flags(surrogate, values, computed),
        held=tuple(limits_reached(surrogate, values, computed)),
        start=start,
        first=first,
        initial=initial,
        scored=scored,
    )


def _start(bundle: Bundle, given: Trace, targets: list[str], initial: float | None, start: Start | None) -> Start:
    """How the run begins: as is said, or as there is something to begin from."""
    if initial is not None and start is not None and start.kind is not StartKind.REST:
        raise ConfigError(
            "the run cannot begin in two ways", where="initial", expected="initial, or a start from measured samples",
            got=f"initial {initial:g} and start {start.kind.value}", remedy="leave one of them out",
        )  # fmt: skip
    known = bundle.model.single is not None and targets[0] in given.channel_names
    if start is None or start.kind is StartKind.REST:
        return declared_start(bundle) if start is None and initial is None and known else Start()
    if bundle.model.single is None:
        raise ConfigError(
            "several models begin at their declared levels", where="start", expected="rest", got=start.kind.value,
            remedy="leave start out, or give rest",
        )  # fmt: skip
    if not known:
        error = ChannelError(targets[:1], given.channel_names, where=given.name)
        raise ConfigError(
            f"a run that begins {start.kind.value} needs the measured output", where=error.where,
            expected=f"a column {targets[0]} with the samples that were measured", got=", ".join(given.channel_names),
            remedy="put the measured output beside the inputs, or leave start out: the run then begins at rest",
        )  # fmt: skip
    return start


def _from_level(surrogate: Surrogate, inputs: NDArray[np.float64], initial: float | None) -> NDArray[np.float64]:
    """A free run from rest, or from another output."""
    if initial is not None and len(surrogate.outputs) > 1:
        raise ConfigError(
            "the outputs cannot all begin at one value",
            expected="a bundle with one output",
            got=", ".join(port.name for port in surrogate.outputs),
            remedy="leave the value out: each begins at its declared level",
        )
    return surrogate.run_from(inputs, {} if initial is None else {surrogate.outputs[0].name: initial})


def _from_measured(
    bundle: Bundle, given: Trace, inputs: NDArray[np.float64], target: str, start: Start
) -> tuple[NDArray[np.float64], int]:
    """The run from measured samples on, behind what the model follows or was told in them; and how many they are."""
    model = bundle.model.single
    assert model is not None  # noqa: S101 - refused before
    begun = beginning(model, inputs, given[target], start, given.usable_samples)
    run = model.simulate(inputs[begun.first :], begun.history)
    if begun.first:
        estimated = start.kind is StartKind.ESTIMATED
        before = model.recursion.followed(begun.history) if estimated else begun.history.output
        run = np.concatenate([before[-begun.first :], run])
    return run[:, np.newaxis], begun.first
