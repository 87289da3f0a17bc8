"""What is found in a record: figures and a verdict; the words for people are made where reports are made."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from typing import Any

from sysid.estimation.nonparametric.impulse_response import ImpulseResponse
from sysid.estimation.nonparametric.response import FrequencyResponse
from sysid.models import AbstractStructure, Mapping


class Verdict(enum.Enum):
    """How a finding is to be taken; the value is the word for it."""

    FINE = "fine"
    NOTE = "worth knowing"
    LOOK = "look at this"
    UNKNOWN = "cannot be said"


class Topic(enum.Enum):
    """What was asked of the record; the value is the question."""

    AMOUNT = "Is there enough of it?"
    CHANNELS = "Are the channels sound?"
    EXCITATION = "Do the inputs move enough?"
    FEEDBACK = "Does the output act on the inputs?"
    DYNAMICS = "How fast, how late, how strong?"
    SAMPLING = "Is it sampled at a good rate?"
    NOISE = "How much is noise?"
    LINEARITY = "Is it linear?"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing that was found.

    Args:
        topic: What was asked.
        code: What was found, as in ``excitation.low``; words for people go by it.
        verdict: How it is to be taken.
        subject: Channels, or names of traces, that it is about.
        figures: By name; seconds, samples, shares (0 to 1) and units are said by the words.
        reason: Why something cannot be said, where an estimate was refused; or what to write, where that depends on
            more than figures.
    """

    topic: Topic
    code: str
    verdict: Verdict
    subject: tuple[str, ...] = ()
    figures: Dict[str, float] = field(default_factory=dict)
    reason: str = ""

    def to_dict(self) -> dict[str, Any]:
        """As JSON values; a figure that is not finite is left out."""
        return {
            "topic": self.topic.name,
            "code": self.code,
            "verdict": self.verdict.name,
            "subject": list(self.subject),
            "figures": {name: float(value) for name, value in self.figures.items() if math.isfinite(value)},
            "reason": self.reason,
        }


@dataclass(frozen=True, kw_only=True)
class Suggestion:
    """A structure that is worth a try.

    Args:
        structure: With its orders.
        code: Why.
        at_edge: Whether its orders are the largest that were tried: it may want more.
    """

    structure: AbstractStructure
    code: str
    at_edge: bool = False

    @property
    def label(self) -> str:
        """The structure in a few characters."""
        return self.structure.label

    def to_dict(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "structure": self.structure.to_dict(),
            "label": self.label,
            "code": self.code,
            "at_edge": self.at_edge,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Advice:
    """All that was found for one mapping.

    Args:
        data: Name of the data set.
        mapping: Inputs and output.
        sample_time: Seconds.
        units: Unit of each channel of the mapping.
        findings: In the order of the topics.
        suggestions: The simplest first.
        impulse: The impulse response that they go by; ``None`` where there is none.
        response: The frequency response, likewise.
    """

    data: str
    mapping: Mapping
    sample_time: float
    units: Dict[str, str]
    findings: tuple[Finding, ...]
    suggestions: tuple[Suggestion, ...]
    impulse: ImpulseResponse | None = None
    response: FrequencyResponse | None = None

    def of(self, topic: Topic) -> tuple[Finding, ...]:
        """What was found on a topic."""
        return tuple(finding for finding in self.findings if finding.topic is topic)

    def find(self, code: str, *subject: str) -> Finding | None:
        """A finding by its code and, where several have it, by what it is about."""
        return next((one for one in self.findings if one.code == code and set(subject) <= set(one.subject)), None)

    def to_dict(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "mapping": str(self.mapping),
            "units": dict(self.units),
            "findings": [finding.to_dict() for finding in self.findings],
            "suggestions": [one.to_dict() for one in self.suggestions],
            "impulse": None if self.impulse is None else _impulse(self.impulse),
            "response": None if self.response is None else _response(self.response),
        }


def _impulse(found: ImpulseResponse) -> dict[str, Any]:
    return {
        "time": found.time.tolist(),
        "inputs": list(found.mapping.inputs),
        "values": found.values.tolist(),
        "deviation": found.deviation.tolist(),
    }


def _response(found: FrequencyResponse) -> dict[str, Any]:
    """Every value that is there: what an input does not hold is left out of JSON as null."""
    low, high = found.gain_band
    parts = {"gain": found.gain.T, "low": low.T, "high": high.T, "coherence": found.coherence}
    return {
        "frequency": found.frequency.tolist(),
        "inputs": list(found.mapping.inputs),
        **{name: _finite(part.tolist()) for name, part in parts.items()},
    }


def _finite(values: Any) -> Any:
    if isinstance(values, list):
        return [_finite(value) for value in values]
    return values if math.isfinite(values) else None
