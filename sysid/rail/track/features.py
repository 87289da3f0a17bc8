"""Crests and sags from a correlation: where they begin, how severe they are.

After "track features and train handling" (US 9,120,493); the correlation is that of ``sysid.rail.track.terrain``.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError


class Severity(enum.Enum):
    """How much a feature matters to the handling of the train."""

    NONE = "none"
    LOW = "low"
    MEDIUM = "medium"
    HIGH = "high"


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """Sizes of correlation, rise over run, from which a feature is low, medium and high (ours).

    Args:
        crest: For positive correlations.
        sag: For negative ones; they need not be the same.

    Raises:
        ConfigError: If they do not rise.

    Example:
        >>> Thresholds().severity(-0.006).value
        'medium'
    """

    crest: tuple[float, float, float] = (0.002, 0.005, 0.010)
    sag: tuple[float, float, float] = (0.002, 0.005, 0.010)

    def __post_init__(self) -> None:
        for name in ("crest", "sag"):
            low, medium, high = getattr(self, name)
            if not 0.0 < low <= medium <= high:
                raise ConfigError(
                    "thresholds do not rise",
                    where=f"thresholds, {name}",
                    expected="three numbers above 0, not falling",
                    got=(low, medium, high),
                )

    def severity(self, value: float) -> Severity:
        """Severity of a correlation."""
        steps = self.crest if value >= 0.0 else self.sag
        levels = (Severity.NONE, Severity.LOW, Severity.MEDIUM, Severity.HIGH)
        return levels[sum(abs(value) >= step for step in steps)]


class StartRule(enum.Enum):
    """When a significant crest begins, without looking ahead."""

    MAGNITUDE = "the correlation reaches the threshold"
    NEGATIVE_GRADE = "after the threshold the leading end comes onto a descent"
    SLOPE_CHANGE = "after the threshold the correlation turns from rising to falling"
    DECLINE = "after the threshold the correlation has fallen by a given amount from its highest value"


def crest_starts(
    correlations: NDArray[np.float64],
    grades: NDArray[np.float64],
    *,
    rule: StartRule,
    threshold: float,
    decline: float = 0.001,
) -> tuple[int, ...]:
    """Samples at which a significant crest begins. A sag's are those of the negated correlations and grades.

    Each crest counts once: a new one needs a correlation below the threshold first.

    Args:
        correlations: Over increasing positions, shape ``(n,)``.
        grades: Under the leading end, same shape.
        rule: One of the four.
        threshold: Smallest correlation.
        decline: Amount of the fall for :attr:`StartRule.DECLINE`.

    Returns:
        Indices, increasing.
    """
    starts, armed, reached, highest = [], True, False, -np.inf
    for i, value in enumerate(correlations):
        over = value >= threshold
        if over:
            reached, highest = True, max(highest, float(value))
        # A fall that begins a crest may come together with the one below the threshold.
        before = correlations[i - 1] if i else -np.inf
        if (
            reached
            and armed
            and _begins(rule, value=value, before=before, grade=grades[i], fall=highest - value, decline=decline)
        ):
            starts.append(i)
            armed = False
        if not over:
            armed, reached, highest = True, False, -np.inf
    return tuple(starts)


def _begins(rule: StartRule, *, value: float, before: float, grade: float, fall: float, decline: float) -> bool:
    if rule is StartRule.MAGNITUDE:
        return True
    if rule is StartRule.NEGATIVE_GRADE:
        return bool(grade < 0.0)
    if rule is StartRule.SLOPE_CHANGE:
        return bool(value < before)
    return bool(fall >= decline)


@dataclass(frozen=True, kw_only=True)
class Feature:
    """A crest or a sag as a train will feel it.

    Args:
        kind: ``crest`` or ``sag``.
        start: Where the correlation passes the lowest threshold, in m.
        apex: Where it is largest: the leading end is at the apex or trough, in m.
        end: Where it falls below the threshold again, in m.
        correlation: There, rise over run.
        severity: By the thresholds.
    """

    kind: str
    start: float
    apex: float
    end: float
    correlation: float
    severity: Severity


def features(
    x: NDArray[np.float64], correlations: NDArray[np.float64], thresholds: Thresholds | None = None
) -> tuple[Feature, ...]:
    """Crests and sags along a line, from a correlation that is known ahead of the train.

    Args:
        x: Increasing positions in m, shape ``(n,)``.
        correlations: There.
        thresholds: Severity levels.

    Returns:
        The features in order of position.
    """
    thresholds = thresholds or Thresholds()
    found = []
    for kind, sign, lowest in (("crest", 1.0, thresholds.crest[0]), ("sag", -1.0, thresholds.sag[0])):
        above = np.concatenate([[False], sign * correlations >= lowest, [False]])
        turns = np.flatnonzero(np.diff(above.astype(np.int64)))
        for first, stop in zip(turns[::2], turns[1::2], strict=True):
            best = first + int(np.argmax(sign * correlations[first:stop]))
            value = float(correlations[best])
            found.append(
                Feature(
                    kind=kind,
                    start=float(x[first]),
                    apex=float(x[best]),
                    end=float(x[stop - 1]),
                    correlation=value,
                    severity=thresholds.severity(value),
                )
            )
    return tuple(sorted(found, key=lambda feature: feature.start))
