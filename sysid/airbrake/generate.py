"""The door between data sets and the reference physics: a case's recipe in, a trace out."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from sysid.airbrake.command import MAX_DURATION, Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.equipment import EQUIPMENT, Equipment
from sysid.airbrake.machine import QUANTITIES, Probe
from sysid.airbrake.radio import Radio
from sysid.airbrake.sequences import RandomCommand
from sysid.airbrake.simulate import AirBrakeRecord, simulate
from sysid.airbrake.variant import USUAL_VARIANT, VARIANTS
from sysid.errors import ConfigError
from sysid.excitation import excite
from sysid.field_checks import check
from sysid.traces import Channel, Trace
from sysid.units import Reference, convert

COMMAND = "command"
"""The quantity that is the driver's handle."""

USUAL_NAMES: Mapping[str, str | dict[str, int]] = {
    "STP": COMMAND,
    "BP": "pipe",
    "AR": "auxiliary",
    "ER": "emergency",
    "BC": "cylinder",
    "PS": "action",
}
"""What a channel of this name is, unless ``quantities`` says otherwise."""


class _Random(BaseModel):
    model_config = ConfigDict(extra="forbid")
    seed: int = Field(ge=0)
    duration: float = Field(gt=0)
    minimum_reduction: float = 5.8
    full_reduction: float = 25.8
    steps: int = 4
    hold: tuple[float, float] = (10.0, 90.0)
    recharge: tuple[float, float] = (30.0, 300.0)
    partial_release: float = 0.15
    emergency: float = 0.0
    positions: tuple[float, ...] | None = None


class _Excited(BaseModel):
    model_config = ConfigDict(extra="forbid")
    kind: str
    seed: int = Field(ge=0)
    duration: float = Field(gt=0, le=MAX_DURATION)
    low: float = Field(default=66.0, ge=0)
    high: float | None = None
    options: dict[str, Any] = Field(default_factory=dict)


class _Recipe(BaseModel):
    model_config = ConfigDict(extra="forbid")
    command: list[tuple[float, float]] | None = None
    time_unit: Literal["s", "ds"] = "s"
    duration: float | None = Field(default=None, gt=0)
    random: _Random | None = None
    excitation: _Excited | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> _Recipe:
        if sum(one is not None for one in (self.command, self.random, self.excitation)) != 1:
            raise ValueError("give one of command, random and excitation")
        if self.command is None and self.duration is not None:
            raise ValueError("the duration of a random command or an excitation stands beside its seed")
        return self


class _Radio(BaseModel):
    model_config = ConfigDict(extra="forbid")
    delay: float = 1.0
    loss: float = 0.0
    repeat: float = 1.0
    seed: int = Field(default=0, ge=0)


class _Options(BaseModel):
    model_config = ConfigDict(extra="forbid")
    variant: str | None = None
    equipment: str | None = None
    switches: dict[str, bool | float | str | None] = Field(default_factory=dict)
    pairs: int = Field(default=50, ge=1, le=200)
    locomotives: tuple[int, ...] = ()
    loads: float | tuple[float, ...] = 1.0
    retainers: float | tuple[float, ...] = 0.0
    radio: _Radio | None = None
    running_pressure: float | None = None
    speed: float | None = Field(default=None, ge=0)
    time_step: float = Field(default=1e-3, gt=0)
    node: int = 3
    quantities: dict[str, str | dict[str, int]] = Field(default_factory=dict)


def _excited(asked: _Excited, running_pressure: float, sample_time: float) -> Command:
    """An excitation as a command: a position for every sample at which the handle moves."""
    high = running_pressure if asked.high is None else asked.high
    found = excite(
        asked.kind,
        sample_time=sample_time,
        duration=asked.duration,
        low=asked.low,
        high=high,
        names="handle",
        units="psi",
        seed=asked.seed,
        **asked.options,
    )
    return Command.from_samples(found.values[:, 0], sample_time=sample_time)


def _command(recipe: _Recipe, running_pressure: float, sample_time: float) -> Command:
    if recipe.excitation is not None:
        return _excited(recipe.excitation, running_pressure, sample_time)
    if recipe.random is not None:
        limits = recipe.random.model_dump(exclude={"seed"})
        return RandomCommand(running_pressure=running_pressure, **limits).draw(recipe.random.seed)
    rows = [list(row) for row in recipe.command or ()]
    return Command.from_rows(rows, time_unit=recipe.time_unit, duration=recipe.duration)


def _probe(channel: str, options: _Options) -> Probe | None:
    """What a channel records; ``None`` for the handle."""
    known = {**USUAL_NAMES, **options.quantities}
    expected = f"{COMMAND}, one of {', '.join(QUANTITIES)}, or one of these with a node, such as {{pipe: 3}}"
    if channel not in known:
        raise ConfigError(
            f"the generator does not know what channel {channel} is",
            where="options, quantities",
            expected=expected,
            got=f"no entry for {channel}",
            remedy=f"add {channel} to quantities",
        )
    meant = known[channel]
    if meant == COMMAND:
        return None
    pair = (meant, options.node) if isinstance(meant, str) else next(iter(meant.items()), ("nothing", 0))
    if pair[0] not in QUANTITIES or (isinstance(meant, dict) and len(meant) != 1):
        raise ConfigError("unknown quantity", where=f"options, quantities, {channel}", expected=expected, got=meant)
    return Probe(quantity=pair[0], node=pair[1])


def _equipment(options: _Options) -> Equipment:
    """What stands at the cars: a row of its own, or a reading of the reference with the dissertation's valve."""
    for name, given, rows in (
        ("equipment", options.equipment, EQUIPMENT),
        ("variant", options.variant, VARIANTS),
    ):
        if given is not None and given not in rows:
            raise ConfigError.unknown(f"unknown {name}", given, rows, "name one of these", where=f"options, {name}")
    if options.equipment is not None and options.variant is not None:
        raise ConfigError(
            "equipment and variant are both given", where="options",
            expected="one of them: a row of equipment says how its valve works",
            got=f"{options.equipment} and {options.variant}", remedy="leave variant out, and turn switches",
        )  # fmt: skip
    if options.equipment is not None:
        row = EQUIPMENT[options.equipment]
    else:
        row = Equipment(variant=VARIANTS[options.variant or USUAL_VARIANT], about="as the variant has it")
    return dataclasses.replace(row, variant=row.variant.with_options(options.switches))


def _check_heeded(options: _Options, equipment: Equipment) -> None:
    """Refuse options that nothing on this train looks at."""
    idle = {
        "radio": (options.radio is not None and not options.locomotives, "locomotives inside the train that hear it"),
        "speed": (
            options.speed is not None and not equipment.variant.speed_gates,
            "a variant with speed_gates, such as listing",
        ),
    }
    for name, (unheeded, expected) in idle.items():
        if unheeded:
            raise ConfigError(
                f"{name} changes nothing here", where=f"options, {name}", expected=expected,
                got=getattr(options, name), remedy=f"leave {name} out",
            )  # fmt: skip


def _column(channel: Channel, probe: Probe | None, record: AirBrakeRecord) -> np.ndarray[Any, np.dtype[np.float64]]:
    psi = record.command if probe is None else record.gauge_psi(probe.quantity, probe.node)
    # The model's own psi (six digits) is kept for psi; everything else is converted from it.
    if channel.unit == "psi" and channel.reference is Reference.GAUGE:
        return psi
    return convert(psi, "psi", channel.unit, reference=Reference.GAUGE, to_reference=channel.reference)


def generate(
    *,
    case: str,
    recipe: Mapping[str, Any],
    options: Mapping[str, Any],
    channels: tuple[Channel, ...],
    sample_time: float,
) -> Trace:
    """Simulate one case of a data set.

    Args:
        case: Its name.
        recipe: ``{command: [[time, psi gauge], ...], time_unit: s | ds, duration: s}`` or
            ``{random: {seed: 7, duration: 900, ...}}`` (limits: :class:`sysid.airbrake.sequences.RandomCommand`), or
            ``{excitation: {kind: ramps, seed: 7, duration: 900, low: 66, high: 90, options: {rise: 50}}}`` (a kind of
            :func:`sysid.excitation.excite`; from 66 psi to the running pressure by default).
        options: ``variant`` (``acoustic`` by default) or ``equipment`` (a row of
            :data:`sysid.airbrake.equipment.EQUIPMENT`), ``switches`` (fields of
            :class:`sysid.airbrake.variant.Variant`), ``pairs``, ``locomotives``, ``radio`` (how these hear of the
            handle: :class:`sysid.airbrake.radio.Radio`), ``loads`` and ``retainers`` (one number or one a pair:
            :class:`sysid.airbrake.consist.Consist`), ``running_pressure`` in psi gauge, ``speed`` in m/s (for
            variants with ``speed_gates``), ``time_step`` in s, ``node``, and ``quantities``: what each channel is,
            ``command``, a quantity at ``node``, or ``{quantity: node}``.
        channels: Channels wanted, in their units.
        sample_time: Seconds between samples; each is the mean over its time steps.

    Returns:
        The trace, not rounded.

    Raises:
        ConfigError: If recipe or options cannot be used.
        StabilityError: If the time step is too large.

    Example:
        >>> trace = generate(
        ...     case="minimum",
        ...     recipe={"command": [[0, 90], [10, 84.2], [20, 84.2]]},
        ...     options={"pairs": 1},
        ...     channels=(Channel(name="BC", unit="psi", reference=Reference.GAUGE),),
        ...     sample_time=0.1,
        ... )
        >>> len(trace), float(trace["BC"][0])
        (200, 0.0)
    """
    recipe_ = check(_Recipe, recipe, where=f"the recipe of case {case}")
    options_ = check(_Options, options, where="the options of the generator")
    equipment = _equipment(options_)
    _check_heeded(options_, equipment)
    running = equipment.running_pressure if options_.running_pressure is None else options_.running_pressure
    consist = Consist(
        pairs=options_.pairs,
        locomotives=options_.locomotives,
        running_pressure=running,
        valve=equipment.valve,
        loads=options_.loads,
        retainers=options_.retainers,
    )
    probes = [_probe(channel.name, options_) for channel in channels]
    record = simulate(
        _command(recipe_, running, sample_time),
        consist=consist,
        variant=equipment.variant,
        probes=tuple(dict.fromkeys(probe for probe in probes if probe is not None)),
        time_step=options_.time_step,
        sample_time=sample_time,
        speed=1.0 if options_.speed is None else options_.speed,
        radio=None if options_.radio is None else Radio(**options_.radio.model_dump()),
    )
    columns = [_column(channel, probe, record) for channel, probe in zip(channels, probes, strict=True)]
    kind = f"equipment {options_.equipment}" if options_.equipment else f"variant {options_.variant or USUAL_VARIANT}"
    switches = "".join(f", {name}={value}" for name, value in options_.switches.items())
    return Trace(
        name=case,
        sample_time=sample_time,
        channels=channels,
        values=np.column_stack(columns),
        provenance=(
            f"simulated: {kind}{switches}, {consist.vehicles} vehicles, step {options_.time_step:g} s",
            f"each sample is the mean over its {round(sample_time / options_.time_step)} steps",
        ),
    )
