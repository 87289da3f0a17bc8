"""Interpolation over positions: every position of a line from an assembly that is modelled at a few of them."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.export.bundle import ranges_of
from sysid.export.ranges import ranges_in
from sysid.models import Cascade, Interpolation
from sysid.models.interpolation import SPREAD
from sysid.traces import Channel, Trace, TraceSet
from sysid.units import Reference
from sysid.workbench.assembly.proof_config import InterpolationConfig

WORKERS = 2
"""Threads of the timed runs."""


@dataclass(frozen=True, kw_only=True, eq=False)
class InterpolationScores:
    """How the line does at positions, seen and unseen.

    Args:
        mse: Mean squared error of the free run by output and case, at each position, in the output's unit squared.
        positions: By output, the positions that the data have.
        seen: By output, whether each is a knot.
        timing: Seconds of a free run of all positions together, by case.
    """

    mse: Mapping[str, Mapping[str, NDArray[np.float64]]]
    positions: Mapping[str, NDArray[np.float64]]
    seen: Mapping[str, NDArray[np.bool_]]
    timing: Mapping[str, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class StoredInterpolation:
    """A line as a run leaves it: with the channels that go in and come out, in their units.

    Args:
        line: The line.
        inputs: Channels of the inputs of the whole.
        outputs: Channels that are had at every position.
        ranges: Least and greatest value of each input in the traces that it was trained on, where that is known.
    """

    line: Interpolation
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @classmethod
    def of(
        cls, asked: InterpolationConfig, line: Interpolation, case: Trace, fitted: Sequence[Trace]
    ) -> StoredInterpolation:
        """A line with the channels of a trace.

        Args:
            asked: What is had at every position.
            line: The line.
            case: A trace with the inputs of the whole, and the outputs under the names of the first instance or at some
                position.
            fitted: What the line was trained on.

        Returns:
            The line with its channels.
        """
        outputs = []
        for name in (*asked.outputs, *(f"{one}{SPREAD}" for one in line.spread)):
            there = name if name in case.channel_names else next(iter(positions_of(case, name).values()), None)
            unit = Channel(name=name, unit=line.units[name])
            outputs.append(replace(case.channel(there), name=name, description="") if there else unit)
        inputs = tuple(case.channel(name) for name in line.inputs)
        return cls(line=line, inputs=inputs, outputs=tuple(outputs), ranges=ranges_in(line.inputs, fitted))

    @property
    def _sides(self) -> dict[str, tuple[Channel, ...]]:
        return {"inputs": self.inputs, "outputs": self.outputs}

    def to_dict(self) -> dict[str, Any]:
        """The line and its channels as JSON values."""
        channels = {side: [_said(one) for one in some] for side, some in self._sides.items()}
        for entry in channels["inputs"]:
            if entry["name"] in self.ranges:
                entry["range"] = list(self.ranges[entry["name"]])
        return {**self.line.to_dict(), "channels": channels}

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> StoredInterpolation:
        """What :meth:`to_dict` wrote.

        Args:
            fields: What it wrote.

        Returns:
            The line with its channels.

        Raises:
            ConfigError: If it is no line, or a field is missing.
        """
        line, channels = Interpolation.from_dict(fields), fields.get("channels", {})
        sides = {
            side: tuple(
                Channel(name=one["name"], unit=one["unit"], reference=Reference(one["reference"]))
                for one in channels.get(side, ())
            )
            for side in ("inputs", "outputs")
        }
        if tuple(channel.name for channel in sides["inputs"]) != line.inputs or not sides["outputs"]:
            raise ConfigError(
                "the stored line lacks its channels",
                expected=f"channels of the inputs {', '.join(line.inputs)}, and of some outputs",
                got=", ".join(channel.name for channel in sides["inputs"]) or "none",
                remedy="let the pipeline that makes it run again",
            )
        return cls(line=line, **sides, ranges=ranges_of(channels["inputs"]))


def _said(channel: Channel) -> dict[str, Any]:
    return {"name": channel.name, "unit": channel.unit, "reference": channel.reference.value}


def interpolation_of(
    asked: InterpolationConfig, whole: Cascade, *, where: str = "interpolation, outputs"
) -> Interpolation:
    """The line of an assembly: what the knots need runs along it, what the outputs need stands at every position.

    Args:
        asked: What stands where.
        whole: The assembly.
        where: Of whom an error speaks.

    Returns:
        The line.

    Raises:
        ConfigError: If the outputs cannot be had from the channel at a position.
    """
    there = whole.upstream_of(asked.outputs, given=(asked.channel, *whole.inputs))
    unread = [name for name in there.inputs if name != asked.channel and name not in whole.inputs]
    if unread or asked.channel not in there.inputs:
        raise ConfigError(
            "the outputs cannot be had at a position of the line",
            where=where,
            expected=f"outputs that follow from {asked.channel} and the inputs of the whole",
            got=f"{', '.join(asked.outputs)} from {', '.join(there.inputs)}",
            remedy="name the channel that the positions read, and outputs of members that stand there",
        )
    levels = {whole.level(knot) for knot in asked.knots}
    if len(levels) == 1 and not isinstance(level := next(iter(levels)), str):
        there = replace(there, rest={**there.rest, asked.channel: level})  # before its first sample, as in the whole
    return Interpolation(
        along=whole.upstream_of(asked.knots),
        knots=asked.knots,
        at_place=there,
        channel=asked.channel,
        delay=asked.delay,
    )


def positions_of(case: Trace, output: str) -> dict[float, str]:
    """Positions at which a trace has an output.

    Args:
        case: The trace; the output at position 17 is the output's name with 17 behind it.
        output: The output.

    Returns:
        Channel by position, in the order of the positions.
    """
    pattern = re.compile(rf"{re.escape(output)}(\d+(?:\.\d+)?)")
    found = {float(match[1]): name for name in case.channel_names if (match := pattern.fullmatch(name))}
    return dict(sorted(found.items()))


def score_interpolation(asked: InterpolationConfig, line: Interpolation, cases: TraceSet) -> InterpolationScores:
    """Score a line at the positions of a data set.

    Args:
        asked: What is judged.
        line: The line.
        cases: The reference at its positions.

    Returns:
        The scores.

    Raises:
        ConfigError: If the data have an output at no position.
    """
    positions = {name: positions_of(next(iter(cases)), name) for name in asked.scored}
    for name, found in positions.items():
        if not found:
            raise ConfigError(
                "the data have no position of the line",
                where=f"data set {cases.name}",
                expected=f"channels such as {name}17, the output at position 17",
                got=", ".join(next(iter(cases)).channel_names),
                remedy="add such channels to the data set, or take the output out of line, judged",
            )
    every = sorted({position for found in positions.values() for position in found})
    mse: dict[str, dict[str, NDArray[np.float64]]] = {name: {} for name in asked.scored}
    timing = {}
    for trace in cases:
        line.simulate_trace(trace, every, workers=WORKERS)  # compiles
        began = time.perf_counter()
        run = line.simulate_trace(trace, every, workers=WORKERS)
        timing[trace.name] = time.perf_counter() - began
        for name, found in positions.items():
            rows = [every.index(position) for position in found]
            mse[name][trace.name] = _errors(run[name][rows], trace, list(found.values()))
    knots = list(line.knots.values())
    return InterpolationScores(
        mse=mse,
        positions={name: np.array(list(found)) for name, found in positions.items()},
        seen={name: np.isin(list(found), knots) for name, found in positions.items()},
        timing=timing,
    )


def _errors(run: NDArray[np.float64], trace: Trace, channels: Sequence[str]) -> NDArray[np.float64]:
    counted = trace.usable_samples
    found: NDArray[np.float64] = np.mean((run - trace.columns(channels).T)[:, counted] ** 2, axis=1)
    return found
