"""An excitation: the signals of an experiment, within their ranges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.excitation.kinds import kind_of
from sysid.excitation.plan import AbstractExcitation, Plan, check
from sysid.traces import Channel, Trace
from sysid.units import check_unit

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True, eq=False)
class Excitation:
    """The signals of an experiment.

    Args:
        kind: What they are, with all options.
        plan: What they were drawn for.
        names: Of the channels.
        units: Of the channels.
        values: In their units, shape ``(samples, channels)``; never outside the range.
        low: Lower end of each channel's range.
        high: Upper end.
    """

    kind: AbstractExcitation
    plan: Plan
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64] = field(repr=False)
    low: tuple[float, ...]
    high: tuple[float, ...]

    def __len__(self) -> int:
        return len(self.values)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[np.float64]:
        return np.array(self.values, dtype=dtype) if copy or dtype is not None else self.values

    @property
    def time(self) -> NDArray[np.float64]:
        """Seconds, shape ``(samples,)``."""
        return self.plan.sample_time * np.arange(len(self), dtype=np.float64)

    @property
    def crest_factors(self) -> tuple[float, ...]:
        """Peak by root mean square of each channel, both about the middle of its range."""
        middle = 0.5 * (np.array(self.low) + np.array(self.high))
        x = self.values - middle
        size = np.sqrt(np.mean(x**2, axis=0))
        return tuple((np.abs(x).max(axis=0) / np.where(size > 0.0, size, 1.0)).tolist())

    def trace(self) -> Trace:
        """The signals as a trace."""
        channels = tuple(Channel(name=name, unit=unit) for name, unit in zip(self.names, self.units, strict=True))
        return Trace(
            name="excitation",
            sample_time=self.plan.sample_time,
            channels=channels,
            values=self.values,
            provenance=(f"excitation {self.kind}, seed {self.plan.seed}",),
        )

    def to_frame(self) -> pd.DataFrame:
        """A row for each sample.

        Returns:
            ``time`` in seconds, and a column for each channel.
        """
        import pandas as pd

        return pd.DataFrame({"time": self.time, **dict(zip(self.names, self.values.T, strict=True))})


def excite(
    kind: str | AbstractExcitation,
    *,
    sample_time: float,
    samples: int | None = None,
    duration: float | None = None,
    low: float | Sequence[float] = -1.0,
    high: float | Sequence[float] = 1.0,
    names: str | Sequence[str] = "u",
    units: str | Sequence[str] = "1",
    seed: int = 0,
    **options: Any,
) -> Excitation:
    """Draw the inputs of an experiment.

    Args:
        kind: ``prbs``, ``multisine``, ``noise``, ``chirp``, ``staircase``, ``aprbs``, ``ramps``, ``sine`` or
            ``pulses``; or one with its options, as ``PRBS(clock=4)``.
        sample_time: Seconds between samples.
        samples: Length of the experiment, or
        duration: in seconds.
        low: Lower end of the range, one for all channels or one each.
        high: Upper end.
        names: Of the channels, one or several.
        units: Of the channels, one for all or one each.
        seed: Of everything that is random.
        **options: Of the kind: see its class.

    Returns:
        The signals.

    Raises:
        ConfigError: If there is no such kind or option, or a number is out of range.
        UnitError: If a unit is not known.

    Example:
        >>> found = excite("prbs", samples=127, sample_time=0.1, low=2.0, high=5.0)
        >>> sorted(set(found.values[:, 0].tolist())), found.crest_factors
        ([2.0, 5.0], (1.0,))
    """
    labels = (names,) if isinstance(names, str) else tuple(names)
    if len(labels) != len(set(labels)) or not labels or not all(labels):
        raise ConfigError(
            "not the names of the channels",
            expected="different names, at least one",
            got=", ".join(labels),
            remedy="name each channel once",
        )
    length = _length(samples, duration, sample_time)
    plan = Plan(samples=length, sample_time=sample_time, channels=len(labels), seed=seed)
    if options and not isinstance(kind, str):
        raise ConfigError(
            "options are given beside a kind that has its own",
            expected="a name and options, or a kind",
            got=", ".join(options),
            remedy="write them into the kind",
        )
    chosen = kind_of(kind, options) if isinstance(kind, str) else kind
    lows, highs = (_each(value, len(labels), what) for value, what in ((low, "low"), (high, "high")))
    for a, b in zip(lows, highs, strict=True):
        check(
            bool(np.isfinite(a) and np.isfinite(b) and a < b), "range", "from a number up to a larger one", f"{a}:{b}"
        )
    x = chosen.draw(plan)
    bottom, top = np.array(lows), np.array(highs)
    given = (units,) * len(labels) if isinstance(units, str) else tuple(units)
    check(len(given) == len(labels), "units", f"one, or {len(labels)}", len(given))
    for unit in given:
        check_unit(unit)
    return Excitation(
        kind=chosen,
        plan=plan,
        names=labels,
        units=given,
        # Rounding must not carry a level over the end of its range.
        values=np.clip(bottom + 0.5 * (x + 1.0) * (top - bottom), bottom, top),
        low=lows,
        high=highs,
    )


def _each(value: float | Sequence[float], count: int, what: str) -> tuple[float, ...]:
    many = (float(value),) * count if isinstance(value, int | float) else tuple(float(one) for one in value)
    check(len(many) == count, what, f"one number, or {count}", len(many))
    return many


def _length(samples: int | None, duration: float | None, sample_time: float) -> int:
    if (samples is None) == (duration is None):
        raise ConfigError(
            "the length is not given once",
            where="excitation",
            expected="samples, or duration in seconds",
            got="neither" if samples is None else "both",
            remedy="give one of them",
        )
    if samples is not None:
        return samples
    assert duration is not None  # noqa: S101 - one of the two is there
    check(0.0 < duration < np.inf and sample_time > 0.0, "duration", "seconds, above 0", duration)
    return int(min(round(duration / sample_time), 10**12))
