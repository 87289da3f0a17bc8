"""What a finding says, and what to do about it, in plain words: one row for each code."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Protocol

from sysid.advice import Topic, Verdict
from sysid.names import visible
from sysid.reporting.advice.record import AdviceRecord
from sysid.reporting.advice.sentences import SAID, Words
from sysid.reporting.numbers import number


class Told(Protocol):
    """A finding, or its record."""

    @property
    def code(self) -> str:
        """What was found."""

    @property
    def subject(self) -> Sequence[str]:
        """What it is about."""

    @property
    def figures(self) -> Mapping[str, float]:
        """By name."""

    @property
    def reason(self) -> str:
        """Why it cannot be said."""


class Proposed(Protocol):
    """A suggestion, or its record."""

    @property
    def code(self) -> str:
        """Why."""

    @property
    def label(self) -> str:
        """The structure in a few characters."""

    @property
    def at_edge(self) -> bool:
        """Whether it may want more."""


def said(finding: Told, units: Mapping[str, str]) -> tuple[str, str]:
    """A finding in words.

    Args:
        finding: The finding.
        units: Unit of each channel.

    Returns:
        What it says, and what to do; the second may be empty.
    """
    words = SAID.get(finding.code, Words("{code}: of a later release"))
    channels = [name for name in finding.subject if name in units] or list(finding.subject)
    unit = next((units[name] for name in channels if units.get(name, "1") != "1"), "")
    others: dict[str, object] = {
        "who": ", ".join(visible(name) for name in finding.subject),
        "channel": next(map(visible, finding.subject), ""),
        "unit": unit,
        "why": finding.reason,
        "code": finding.code,
    }
    figures = _Figures({name: _Number(value) for name, value in finding.figures.items()} | others)
    says = re.sub(r"(?<![\d.])1 (sample|time)s\b", r"1 \1", words.says.format_map(figures))
    return re.sub("[ \n]+", " ", says).strip().replace(" ,", ",").replace(" .", "."), words.do.format_map(figures)


class _Number(float):
    """A figure whose powers of ten are written as people read them: 3600 and 1.00 × 10⁻⁹, not 3.6e+03 and 1e-09."""

    def __format__(self, spec: str) -> str:
        text = super().__format__(spec)
        return number(float(self), digits=len(text.split("e")[0].strip("-").replace(".", ""))) if "e" in text else text


class _Figures(dict[str, object]):
    """Figures by name; one that is not known is not a number."""

    def __missing__(self, key: str) -> float:
        return float("nan")


def suggested(one: Proposed) -> tuple[str, str]:
    """A structure that is worth a try, in words.

    Args:
        one: The suggestion.

    Returns:
        What it is, and what to do; the second may be empty.
    """
    words = SAID.get(one.code, Words("{label}"))
    edge = "Its orders are the largest that were tried: allow more." if one.at_edge else ""
    return words.says.format(label=one.label), " ".join([words.do, edge]).strip()


def lines(advice: AdviceRecord) -> list[tuple[str, str, str, str]]:
    """Every finding: the question, the verdict, what it says and what to do; then the structures.

    Args:
        advice: What was found.

    Returns:
        Rows of words.
    """
    rows = []
    for one in advice.findings:
        question = Topic[one.topic].value if one.topic in Topic.__members__ else one.topic
        verdict = Verdict[one.verdict].value if one.verdict in Verdict.__members__ else one.verdict
        rows.append((question, verdict, *said(one, advice.units)))
    return rows + [("What to try?", "", *suggested(one)) for one in advice.suggestions]
