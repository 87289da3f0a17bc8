"""A bundle run over inputs: what ``sysid simulate`` does, as one call."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.export.bundle import Bundle
from sysid.export.command_table import CommandTable, read_command
from sysid.export.flags import MEANING, Flag, Held, expected_flags, limits_reached
from sysid.export.reading import read_bundle
from sysid.export.surrogate import Surrogate
from sysid.ingest import read_trace
from sysid.traces import Channel, Trace
from sysid.units import Reference


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulation:
    """A free run of a bundle.

    Args:
        trace: Inputs, then outputs, at every sample.
        inputs: Names of the inputs.
        outputs: Names of the outputs.
        flags: Of every sample, bits of :class:`sysid.export.Flag`.
        held: Which declared limits held which outputs, and for how much of the run.
    """

    trace: Trace
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    flags: NDArray[np.int32]
    held: tuple[Held, ...] = ()

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
) -> Simulation:
    """Run a bundle's model or cascade on nothing but its inputs.

    Args:
        bundle: The bundle, its folder or its zip.
        inputs: A trace with the inputs; a command table; or a file with one, as :func:`read_command` reads it. A file
            of samples is read with :func:`sysid.ingest.read_trace` first.
        time_unit: Unit of a command file's times, where it does not say.
        unit: Unit of a command file's values, likewise.
        initial: The output before the first sample, in its unit; the declared level by default. One output only.

    Returns:
        Every channel at every sample, and the flags.

    Raises:
        BundleError: If the bundle is damaged or incomplete.
        UserError: If the inputs cannot be read or are not the bundle's.
    """
    read = bundle if isinstance(bundle, Bundle) else read_bundle(Path(bundle))
    channels = tuple(channel_of(entry) for entry in read.inputs)
    if isinstance(inputs, str | Path):
        inputs = read_command(inputs, channels, time_unit=time_unit, unit=unit)
    sample_time = read.model.sample_time
    given = inputs.trace(sample_time) if isinstance(inputs, CommandTable) else inputs
    _check_sample_time(given, sample_time)
    return _run(read, given, channels, initial)


def read_inputs(bundle: Bundle, path: Path) -> Trace:
    """Read a file of samples as inputs of a bundle; units are converted to the bundle's.

    Args:
        bundle: The bundle.
        path: The file.

    Returns:
        The trace.
    """
    channels = tuple(channel_of(entry) for entry in bundle.inputs)
    return read_trace(path, channels=channels, sample_time=bundle.model.sample_time)


def channel_of(entry: dict[str, object]) -> Channel:
    """A channel as a bundle describes it."""
    reference = Reference(entry.get("reference", "none"))
    return Channel(name=str(entry["name"]), unit=str(entry["unit"]), reference=reference)


def _check_sample_time(trace: Trace, sample_time: float) -> None:
    if not np.isclose(trace.sample_time, sample_time, rtol=1e-9, atol=0.0):
        raise ConfigError(
            "the inputs have another sample time than the bundle",
            where=trace.name,
            expected=f"{sample_time:g} s",
            got=f"{trace.sample_time:g} s",
            remedy="resample them at ingest",
        )


def _run(bundle: Bundle, given: Trace, channels: tuple[Channel, ...], initial: float | None) -> Simulation:
    ranges = {entry["name"]: tuple(entry["range"]) for entry in bundle.inputs if entry["range"] is not None}
    outputs = tuple(channel_of(entry) for entry in bundle.outputs)
    surrogate = Surrogate.of(bundle.model, ranges, outputs=[channel.name for channel in outputs])
    if initial is not None and len(outputs) > 1:
        raise ConfigError(
            "the outputs cannot all begin at one value",
            expected="a bundle with one output",
            got=", ".join(channel.name for channel in outputs),
            remedy="leave the value out: each begins at its declared level",
        )
    names = tuple(channel.name for channel in channels)
    values = given.columns(names)
    computed = surrogate.compute(values, surrogate.rest(values[0], None if initial is None else np.array([initial])))
    found = surrogate.chosen(computed)
    trace = Trace(
        name=given.name,
        sample_time=given.sample_time,
        start_time=given.start_time,
        channels=(*channels, *outputs),
        values=np.column_stack([values, found]),
        usable=given.usable,
        provenance=(*given.provenance, f"{surrogate.mapping} simulated in free run by {bundle.folder}"),
    )
    flags = expected_flags(surrogate, values, computed)
    held = tuple(limits_reached(surrogate, values, computed))
    return Simulation(trace=trace, inputs=names, outputs=tuple(c.name for c in outputs), flags=flags, held=held)
