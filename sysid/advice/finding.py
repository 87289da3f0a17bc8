"""What is found in a record: figures and a verdict; the words for people are made where reports are made."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from typing import Any

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
        reason: Why something cannot be said, where an estimate was refused.
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

    def to_dict(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "structure": self.structure.to_dict(),
            "label": self.structure.label,
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
    """

    data: str
    mapping: Mapping
    sample_time: float
    units: Dict[str, str]
    findings: tuple[Finding, ...]
    suggestions: tuple[Suggestion, ...]

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
        }
