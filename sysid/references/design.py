"""Which experiments to run: excitations within ranges and rates, parameters spread evenly over theirs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from sysid.errors import ConfigError
from sysid.excitation import excite
from sysid.excitation.kinds import KINDS, kind_of
from sysid.field_checks import FieldError
from sysid.references.config import MOST_SAMPLES, InputPort, ReferenceConfig
from sysid.references.coverage import cells, most_seen
from sysid.references.events import Events
from sysid.references.runs import Case

OWN = ("events",)
"""Signals that are drawn here, beside those of :mod:`sysid.excitation`."""
USUAL = ("aprbs", "ramps", "multisine", "events", "aprbs", "staircase")
FEWEST = 20
"""Samples of an experiment: of fewer nothing can be chosen by."""
STILL = 1e-3
"""Share of its range by which an input has to move in what is fitted, or nothing can be said of what it does."""
PREFIX = {"estimation": "EST", "selection": "SEL", "test": "TST"}


class Excited(BaseModel):
    """A kind of signal.

    Args:
        kind: Of :mod:`sysid.excitation` (``aprbs``, ``prbs``, ``multisine``, ``noise``, ``chirp``, ``staircase``,
            ``ramps``, ``sine``, ``pulses``), or ``events``: away from the start to random levels, with rest between.
        options: Of the kind, as :func:`sysid.excite` takes them; of events those of
            :class:`~sysid.references.events.Events`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    kind: str
    options: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _known(self) -> Excited:
        if self.kind not in {*KINDS, *OWN}:
            raise FieldError(
                "there is no such excitation", expected=", ".join([*KINDS, *OWN]), got=self.kind,
                remedy="name one of these",
            )  # fmt: skip
        if self.kind in OWN:
            self.events()
        return self

    def events(self) -> Events:
        """The options of events."""
        try:
            return Events.model_validate(self.options)
        except ValidationError as error:
            first = error.errors()[0]
            raise FieldError(
                f"events cannot be so: {first['msg']}", expected=f"some of {', '.join(Events.model_fields)}",
                got=str(self.options), remedy="correct options, or leave them out",
            ) from None  # fmt: skip


class Counts(BaseModel):
    """How many experiments of each role.

    Args:
        estimation: That are fitted.
        selection: That choose between models.
        test: That neither is done on.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    estimation: Annotated[int, Field(ge=1, le=100_000)] = 12
    selection: Annotated[int, Field(ge=0, le=100_000)] = 4
    test: Annotated[int, Field(ge=0, le=100_000)] = 4


class Design(BaseModel):
    """What is run.

    Args:
        duration: Seconds of each experiment.
        runs: How many, by role.
        excitations: Signals, dealt in turn; each as its name, or with options.
        hold: Shortest and longest time in seconds at a level; a fiftieth and a tenth of the duration by default.
        lead: Seconds at the start of the inputs before anything moves; one sample at least, half the shortest hold by
            default.
        among: Random experiments among which each run that is fitted is chosen: that whose inputs add most to where
            those of the runs before it have been, at present and of late; 1 takes them as they come.
        sampling: How parameters are spread: ``sobol`` or ``latin-hypercube``.
        seed: Of everything random.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    duration: Annotated[float, Field(gt=0.0)]
    runs: Counts = Counts()
    excitations: tuple[Excited, ...] = tuple(Excited(kind=kind) for kind in USUAL)
    hold: tuple[float, float] | None = None
    lead: Annotated[float, Field(ge=0.0)] | None = None
    among: Annotated[int, Field(ge=1, le=1000)] = 1
    sampling: Literal["sobol", "latin-hypercube"] = "sobol"
    seed: Annotated[int, Field(ge=0)] = 0

    @model_validator(mode="before")
    @classmethod
    def _short(cls, values: Any) -> Any:
        given = values.get("excitations") if isinstance(values, dict) else None
        if isinstance(given, list | tuple):
            short = [{"kind": one} if isinstance(one, str) else one for one in given]
            return {**values, "excitations": short}
        return values

    @model_validator(mode="after")
    def _consistent(self) -> Design:
        if not self.excitations or (self.hold is not None and not 0.0 < self.hold[0] <= self.hold[1]):
            raise FieldError(
                "no excitation, or no times to hold", expected="an excitation; hold as two rising seconds, above 0",
                got=str(self.hold), remedy="correct excitations or hold",
            )  # fmt: skip
        return self

    def holds(self, sample_time: float) -> tuple[int, int]:
        """Shortest and longest time at a level in samples."""
        low, high = self.hold or (self.duration / 50.0, self.duration / 10.0)
        shortest = max(1, round(low / sample_time))
        return shortest, max(shortest, round(high / sample_time))


def designed(config: ReferenceConfig, design: Design) -> dict[str, list[Case]]:
    """The experiments of a design.

    Args:
        config: The reference.
        design: What is run.

    Returns:
        By role; no two have the same random numbers.

    Raises:
        ConfigError: If nothing could happen in them, or an input never moves in those that are fitted.
    """
    counts = {role: getattr(design.runs, role) for role in PREFIX}
    found = {
        role: drawn(config, design, count, seed=(design.seed, place), prefix=PREFIX[role], fitted=role == "estimation")
        for place, (role, count) in enumerate(counts.items())
        if count
    }
    _check_moving(config, found["estimation"])
    return found


def _check_moving(config: ReferenceConfig, cases: Sequence[Case]) -> None:
    """Refuse inputs of which the experiments that are fitted say nothing."""
    for k, (name, port) in enumerate(config.inputs.items()):
        values = np.concatenate([case.inputs[:, k] for case in cases])
        span = port.range[1] - port.range[0]
        if np.ptp(values) < STILL * span:
            raise ConfigError(
                f"{name} does not move in the experiments that are fitted", where=f"input {name}",
                expected=f"changes of {STILL * span:.3g} of its range of {span:.3g}, or more",
                got=f"{np.ptp(values):.3g}, with levels {port.levels}, rate {port.rate} and what experiment asks for",
                remedy="allow two levels, a faster rate, shorter rests or a longer duration; what is not to move is no "
                "input of an experiment",
            )  # fmt: skip


def _check_times(config: ReferenceConfig, design: Design) -> None:
    """Refuse experiments in which nothing can happen, or that no memory holds."""
    h, shortest = config.sample_time, design.holds(config.sample_time)[0]
    samples = design.duration / h
    if not FEWEST <= samples <= MOST_SAMPLES:
        raise ConfigError(
            "an experiment has too few samples" if samples < FEWEST else "an experiment has too many samples",
            where="experiment.duration", expected=f"{FEWEST * h:g} to {MOST_SAMPLES * h:g} s: {FEWEST} to "
            f"{MOST_SAMPLES:,} samples of sample_time {h:g} s", got=f"{design.duration:g} s",
            remedy="change duration or sample_time",
        )  # fmt: skip
    lead = 0.0 if design.lead is None else design.lead
    if config.inputs and lead + shortest * h > design.duration:
        raise ConfigError(
            "nothing would move in an experiment", where="experiment", expected="a lead, and the shortest time at a "
            f"level after it, within the {design.duration:g} s of duration", got=f"lead {lead:g} s, hold from "
            f"{shortest * h:g} s", remedy="shorten hold or lead, or lengthen duration",
        )  # fmt: skip


def drawn(
    config: ReferenceConfig,
    design: Design,
    count: int,
    *,
    seed: Sequence[int],
    prefix: str,
    fitted: bool = False,
) -> list[Case]:
    """Some experiments.

    Args:
        config: The reference.
        design: What each is.
        count: How many.
        seed: Of everything random; others give others.
        prefix: Of their names.
        fitted: Whether a model is fitted to them. Both ends of each parameter's range are then among its values: a
            model of what lies between is asked for what lies there, and is worst beyond what it was fitted to. And each
            is chosen among as many as the design says.

    Returns:
        The experiments.

    Raises:
        ConfigError: If nothing could happen in them.
    """
    _check_times(config, design)
    parameters = _spread(config, design, count, np.random.default_rng([*seed, 1]), to_the_ends=fitted)
    seeds = np.random.default_rng([*seed, 2]).integers(2**31, size=count)
    if fitted and design.among > 1 and config.inputs:
        seeds = _seeing_most(
            config, design, np.random.default_rng([*seed, 3]).integers(2**31, size=(count, design.among))
        )
    width = max(3, len(str(count)))
    cases = []
    for k in range(count):
        kind = design.excitations[k % len(design.excitations)]
        values = {name: float(x) for name, x in zip(config.parameters, parameters[k], strict=True)}
        said = ", ".join(f"{name} {value:.6g}" for name, value in values.items())
        cases.append(
            Case(
                name=f"{prefix}{k + 1:0{width}d}",
                inputs=moved(config, design, kind, int(seeds[k])),
                parameters=values,
                told=f"{kind.kind}, seed {seeds[k]}" + (f", {said}" if said else ""),
            )
        )
    return cases


def _seeing_most(config: ReferenceConfig, design: Design, seeds: NDArray[np.int64]) -> NDArray[np.int64]:
    """Of each row of seeds, one an experiment, that which sees most beside those before it."""
    ranges = np.array([port.range for port in config.inputs.values()])
    shortest, longest = design.holds(config.sample_time)
    kinds = [design.excitations[k % len(design.excitations)] for k in range(len(seeds))]
    groups = [
        [cells(moved(config, design, kind, int(seed)), ranges, (shortest, longest)) for seed in row]
        for kind, row in zip(kinds, seeds, strict=True)
    ]
    return seeds[np.arange(len(seeds)), most_seen(groups)]


def _spread(
    config: ReferenceConfig, design: Design, count: int, rng: np.random.Generator, *, to_the_ends: bool
) -> NDArray[np.float64]:
    ranges = np.array([port.range for port in config.parameters.values()]).reshape(-1, 2)
    if not len(ranges):
        return np.zeros((count, 0))
    if design.sampling == "sobol":
        power = int(np.ceil(np.log2(max(count, 1))))
        unit = scipy.stats.qmc.Sobol(len(ranges), rng=rng).random_base2(power)[:count]
    else:
        unit = scipy.stats.qmc.LatinHypercube(len(ranges), rng=rng).random(count)
    if to_the_ends and count > 1:
        unit = (unit - unit.min(axis=0)) / np.ptp(unit, axis=0)
    values = ranges[:, 0] + unit * (ranges[:, 1] - ranges[:, 0])
    return np.column_stack([port.at_levels(x) for port, x in zip(config.parameters.values(), values.T, strict=True)])


def moved(config: ReferenceConfig, design: Design, excited: Excited, seed: int) -> NDArray[np.float64]:
    """The inputs of an experiment.

    Args:
        config: The reference.
        design: Its length and times.
        excited: The kind of signal.
        seed: Of everything random.

    Returns:
        Shape ``(n_samples, n_inputs)``: within the ranges, rates and levels, and at the start before anything moves.
    """
    h, ports = config.sample_time, list(config.inputs.values())
    samples = max(4, round(design.duration / h))
    shortest, longest = design.holds(h)
    lead = min(samples - 2, max(1, shortest // 2 if design.lead is None else round(design.lead / h)))
    if not ports:
        return np.zeros((samples, 0))
    rest, length = np.array([port.begin for port in ports]), samples - lead
    low, high = (np.array([port.range[k] for port in ports]) for k in (0, 1))
    if excited.kind in OWN:
        how, rngs = excited.events(), [np.random.default_rng([seed, k]) for k in range(len(ports))]
        x = np.column_stack([how.drawn(r, length, h, (shortest, longest), p) for r, p in zip(rngs, ports, strict=True)])
    else:
        kind = kind_of(excited.kind, {**_usual(excited.kind, length, shortest, longest, h), **excited.options})
        names = [f"u{k}" for k in range(len(ports))]
        x = excite(
            kind, sample_time=h, samples=length, low=low.tolist(), high=high.tolist(), names=names, seed=seed
        ).values
    whole = np.concatenate([np.tile(rest, (lead, 1)), x])
    return np.column_stack([_kept_to(column, port, h) for column, port in zip(whole.T, ports, strict=True)])


def _usual(kind: str, length: int, shortest: int, longest: int, h: float) -> Mapping[str, Any]:
    """Options that follow from the times at a level."""
    shortest = min(shortest, length)
    fastest = min(0.5 / (shortest * h), 0.5 / h)
    band = (1.0 / (length * h), fastest)
    known: dict[str, Mapping[str, Any]] = {
        "aprbs": {"hold": shortest, "longest": max(shortest, longest)},
        "prbs": {"clock": shortest},
        "pulses": {"hold": shortest, "longest": max(shortest, longest)},
        "ramps": {
            **{"rise": max(1, shortest // 4), "longest_rise": max(shortest, longest)},
            **{"hold": shortest, "longest_hold": max(shortest, longest)},
        },
        "staircase": {"levels": int(np.clip(length // max(longest, 1), 2, 9)), "direction": "random"},
    }
    if kind in {"multisine", "noise", "chirp"}:
        found: dict[str, Any] = {"band": band} if band[0] < band[1] else {}
        # A low peak takes iterations, and says nothing where there are many experiments.
        return found | {"iterations": 0} if kind == "multisine" else found
    return known.get(kind, {})


def _kept_to(x: NDArray[np.float64], port: InputPort, h: float) -> NDArray[np.float64]:
    """A signal within what its port allows: levels first, then the rate, which a level must then be reached at."""
    x = port.at_levels(x)
    if port.rate is not None:
        most, y = port.rate * h, x.copy()
        for k in range(1, len(y)):
            y[k] = y[k - 1] + min(max(x[k] - y[k - 1], -most), most)
        x = y
    return np.clip(x, *port.range)
