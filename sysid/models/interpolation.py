"""Interpolation over positions: one system along a line, modelled at a few positions and interpolated to the others.

Along a pipe, a rod or a road a field is smooth between its ends, and what hangs on it is the same everywhere. So the
field is modelled at a few knots only, by a cascade that runs once; between the knots it is interpolated; and the same
models stand at every position, all of them run side by side. A position at which nothing was fitted costs no more
than one at which all was.

The field is interpolated by the cubic spline through the knots (not-a-knot ends), which is linear in the values: a
position is a row of fixed weights. A front that takes some samples from one knot to the next is smeared for that long,
unless it is said how fast it runs (``delay``): each knot is then heard at a position as much later or earlier as the
front passes it, and what is interpolated is what the knots have at the same time of their own. Limits: no faster change
along the line than the knots resolve, and no position beyond the outer knots.

Of several lines the mean may answer (``beside``). At each position each stands behind its own field, and what they come
to is averaged there: at a knot that is the mean of the wholes that they are made of. What would stand behind the mean
of their fields is none of them.
"""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError
from sysid.models.cascades.cascade import Cascade
from sysid.models.cascades.cascade_run import CascadeRun
from sysid.models.channels.ends import check_record
from sysid.models.store import cascade_from_dict
from sysid.traces import Trace

SPREAD = "_spread"
"""Behind the name of an averaged output: how far the answers are apart."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Interpolation:
    """A cascade at knots along a line, and another at every position.

    Args:
        along: The cascade that writes the field at the knots; it runs once.
        knots: Position of each knot, increasing, by the channel that is the field there.
        at_place: The cascade that stands at every position. It reads :attr:`channel`, and may read inputs of ``along``.
        channel: Name under which it reads the field.
        delay: Seconds that a front takes from one position to the next.
        beside: Other lines with the same inputs, channel and knots: the mean of all of them answers.
        spread: Outputs of such a mean of which the largest answer less the smallest is an output too, ``BC_spread`` of
            ``BC``.

    Raises:
        ConfigError: If the knots are fewer than two or do not increase, the cascades do not fit each other, or a line
            beside it answers another question.
        ChannelError: If a channel is written by none of them.

    Example:
        >>> from sysid.models import ARX, ARXModel, Mapping
        >>> def model(text: str, gain: float) -> ARXModel:
        ...     return ARXModel(orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([gain, 0.0]), intercept=0.0,
        ...         mapping=Mapping.parse(text), sample_time=0.1, input_units=("psi",), output_unit="psi",
        ...         rest_output=0.0)
        >>> along = Cascade(models=(model("u -> p1", 1.0), model("u -> p9", 5.0)))
        >>> line = Interpolation(along=along, knots={"p1": 1, "p9": 9},
        ...     at_place=Cascade(models=(model("p -> c", 2.0),)), channel="p")
        >>> line.simulate(np.ones((3, 1)), [1, 5, 9])["c"][:, -1].tolist()
        [2.0, 6.0, 10.0]
    """

    along: Cascade
    knots: Dict[str, float]
    at_place: Cascade
    channel: str
    delay: float = 0.0
    beside: tuple[Interpolation, ...] = ()
    spread: tuple[str, ...] = ()

    kind = "Interpolation"
    OLD_KIND = "Line"
    """As runs of earlier versions stored it; it is read."""

    def __post_init__(self) -> None:
        knots = {name: float(position) for name, position in self.knots.items()}
        object.__setattr__(self, "knots", knots)
        positions = np.array(list(knots.values()))
        if len(knots) < 2 or not (np.diff(positions) > 0.0).all():
            raise ConfigError(
                "the knots are no line",
                where="knots",
                expected="two or more, at increasing positions",
                got=", ".join(f"{name}: {position:g}" for name, position in knots.items()) or "none",
                remedy="give each knot its position, in order",
            )
        if not 0.0 <= self.delay < np.inf:
            raise ConfigError(
                "no front runs so", where="delay of the line",
                expected="seconds from one position to the next, from 0 on", got=self.delay,
            )  # fmt: skip
        strangers = [name for name in knots if name not in self.along.outputs]
        if strangers:
            raise ChannelError(strangers, self.along.outputs, where="knots of the line")
        readable = (self.channel, *self.along.inputs)
        strangers = [name for name in self.at_place.inputs if name not in readable]
        if strangers:
            raise ChannelError(strangers, readable, where="inputs at a position of the line")
        if not np.isclose(self.along.sample_time, self.at_place.sample_time, rtol=1e-9, atol=0.0):
            raise ConfigError(
                "the cascades of the line have different sample times",
                expected=f"{self.along.sample_time:g} s",
                got=f"{self.at_place.sample_time:g} s",
            )
        self._check_beside()

    def _check_beside(self) -> None:
        expected, *got = [one._question for one in (self, *self.beside)]
        if unlike := [one for one in got if one != expected]:
            raise ConfigError(
                "the lines do not answer the same question", where="beside", expected=expected, got=unlike[0],
                remedy="average lines of the same inputs, channel, knots and sample time",
            )  # fmt: skip
        averaged = self._shared if self.beside else ()
        if strangers := [name for name in self.spread if name not in averaged]:
            raise ChannelError(strangers, averaged, where="spread of the line")

    @property
    def _question(self) -> str:
        knots = ", ".join(f"{name}: {position:g}" for name, position in self.knots.items())
        unit = self.along.units[next(iter(self.knots))]
        return f"{', '.join(sorted(self.inputs))} in, {self.channel} in {unit} at {knots}, each {self.sample_time:g} s"

    @property
    def _shared(self) -> tuple[str, ...]:
        """What every line has at a position, in one unit: only that can be averaged."""
        return tuple(n for n, unit in self._units.items() if all(one._units.get(n) == unit for one in self.beside))

    @property
    def _units(self) -> dict[str, str]:
        units = {self.channel: self.along.units[next(iter(self.knots))]}
        return units | {name: self.at_place.units[name] for name in self.at_place.outputs}

    @property
    def inputs(self) -> tuple[str, ...]:
        """Inputs of the whole."""
        return self.along.inputs

    @property
    def outputs(self) -> tuple[str, ...]:
        """What is had at every position: the field, and what the cascade there writes; of a mean what all have."""
        return tuple(self.units)

    @property
    def units(self) -> dict[str, str]:
        """Unit of each of these."""
        units = {name: self._units[name] for name in self._shared}
        return units | {f"{name}{SPREAD}": units[name] for name in self.spread}

    @property
    def sample_time(self) -> float:
        """Seconds."""
        return self.along.sample_time

    @property
    def n_parameters(self) -> int:
        """Parameters of both cascades, and of those beside; the same for any number of positions."""
        own = self.along.n_parameters + self.at_place.n_parameters
        return own + sum(one.n_parameters for one in self.beside)

    @cached_property
    def _spline(self) -> Any:
        return scipy.interpolate.CubicSpline(list(self.knots.values()), np.eye(len(self.knots)))

    def weights(self, positions: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
        """What each knot says of the field at some positions.

        Args:
            positions: Where along the line.

        Returns:
            Shape ``(n_places, n_knots)``; a row adds up to 1.

        Raises:
            ConfigError: If there is none, or one lies beyond the outer knots.
        """
        at = np.atleast_1d(np.asarray(positions, dtype=np.float64))
        first, *_, last = self.knots.values()
        beyond = ~((at >= first) & (at <= last))
        if not len(at) or beyond.any():
            raise ConfigError(
                "no such position on the line",
                where="positions",
                expected=f"positions between {first:g} and {last:g}, where the outer knots are",
                got=", ".join(f"{one:g}" for one in at[beyond]) or "none",
                remedy="leave these out: what is fitted between the knots says nothing of what is beyond them",
            )
        found: NDArray[np.float64] = self._spline(at)
        return found

    def simulate(
        self, inputs: NDArray[np.float64], positions: Sequence[float] | NDArray[np.float64], *, workers: int = 2
    ) -> CascadeRun:
        """Free run of every position, from the inputs of the whole alone.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the order of :attr:`inputs` and in their units.
            positions: Where along the line.
            workers: Threads.

        Returns:
            One run whose arrays have a first axis of positions; its channels are the inputs of the cascade that
            stands there (the field among them) and its outputs; of a mean, :attr:`outputs`.

        Raises:
            TraceError: If the number of inputs is not that of the line.
            ConfigError: If a position is not on the line.
        """
        if self.beside:
            return self._mean(inputs, positions, workers)
        weights, along = self.weights(positions), self.along.simulate(inputs)
        fields = self._fields(np.stack([along[name] for name in self.knots]), weights, np.atleast_1d(positions))
        records = np.empty((*fields.shape, len(self.at_place.inputs)))
        for column, name in enumerate(self.at_place.inputs):
            records[..., column] = fields if name == self.channel else along[name]
        return self.at_place.simulate_batch(records, workers=workers)

    def _mean(
        self, inputs: NDArray[np.float64], positions: Sequence[float] | NDArray[np.float64], workers: int
    ) -> CascadeRun:
        """The mean of all lines, and how far they are apart; held is what holds any of them."""
        inputs = self.along.checked(inputs, 2)
        columns = [[self.inputs.index(name) for name in one.inputs] for one in self.beside]
        runs = [replace(self, beside=(), spread=()).simulate(inputs, positions, workers=workers)]
        runs += [
            one.simulate(inputs[:, own], positions, workers=workers)
            for one, own in zip(self.beside, columns, strict=True)
        ]
        answers = {name: np.stack([run[name] for run in runs]) for name in self._shared}
        found = {name: np.mean(answer, axis=0) for name, answer in answers.items()}
        found |= {f"{name}{SPREAD}": np.ptp(answers[name], axis=0) for name in self.spread}
        field, *outputs = self.outputs
        held = np.zeros((*found[field].shape, len(outputs)), dtype=np.int8)
        for column, name in enumerate(outputs):
            codes = [run.held[..., run.outputs.index(name)] for run in runs if name in run.outputs]
            held[..., column] = np.max(codes, axis=0, initial=0)
        return CascadeRun(
            inputs=(field,), outputs=tuple(outputs), values=np.stack(list(found.values()), axis=-1), held=held,
            units=self.units, sample_time=self.sample_time,
        )  # fmt: skip

    def _fields(
        self, knots: NDArray[np.float64], weights: NDArray[np.float64], positions: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """The field at positions, ``(n_places, n_samples)``; before the first sample and after the last it rests."""
        if not self.delay:
            return weights @ knots
        samples, found = np.arange(knots.shape[1]), np.zeros((len(positions), knots.shape[1]))
        for place, position in enumerate(positions):
            for k, at in enumerate(self.knots.values()):
                later = self.delay / self.sample_time * (position - at)
                found[place] += weights[place, k] * np.interp(samples - later, samples, knots[k])
        return found

    def simulate_trace(
        self, trace: Trace, positions: Sequence[float] | NDArray[np.float64], *, workers: int = 2
    ) -> CascadeRun:
        """Free run of every position over a trace's inputs; its other channels are not read.

        Args:
            trace: The trace.
            positions: Where along the line.
            workers: Threads.

        Returns:
            As :meth:`simulate`.

        Raises:
            ChannelError: If the trace lacks an input.
            ConfigError: If the trace has another sample time, or a channel in another unit.
        """
        check_record(self.along.units, self.sample_time, trace)
        return self.simulate(trace.columns(self.inputs), positions, workers=workers)

    def to_dict(self) -> dict[str, Any]:
        """Everything needed to build the line again, as JSON values."""
        return {
            "structure": {"kind": self.kind},
            "along": self.along.to_dict(),
            "knots": dict(self.knots),
            "at_place": self.at_place.to_dict(),
            "channel": self.channel,
            **({"delay": self.delay} if self.delay else {}),
            **({"beside": [one.to_dict() for one in self.beside]} if self.beside else {}),
            **({"spread": list(self.spread)} if self.spread else {}),
        }

    @classmethod
    def from_dict(cls, fields: Dict[str, Any]) -> Interpolation:
        """The line that :meth:`to_dict` wrote.

        Args:
            fields: What it wrote.

        Returns:
            The line.

        Raises:
            ConfigError: If it is no line, or a field is missing.
        """
        wanted = ("along", "knots", "at_place", "channel")
        missing = [name for name in wanted if name not in fields]
        if fields.get("structure", {}).get("kind") not in {cls.kind, cls.OLD_KIND} or missing:
            raise ConfigError(
                "not a stored line",
                expected=f"the kind {cls.kind} and {', '.join(wanted)}",
                got=f"the fields {', '.join(fields)}",
                remedy="let the pipeline that makes it run again",
            )
        return cls(
            along=cascade_from_dict(fields["along"]),
            knots=fields["knots"],
            at_place=cascade_from_dict(fields["at_place"]),
            channel=fields["channel"],
            delay=float(fields.get("delay", 0.0)),
            beside=tuple(cls.from_dict(one) for one in fields.get("beside", ())),
            spread=tuple(fields.get("spread", ())),
        )
