"""Does the output act on the inputs? Said of a record; it is found beside the estimates without a structure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

from sysid.advice.finding import Finding, Topic, Verdict
from sysid.advice.record import Record
from sysid.models import Mapping

WELL, TIMES = 0.8, 5.0
"""The part of an input that a linear response to the output has to explain, and how many times less it leaves than the
response to the inputs leaves of the output, so that the two are taken to be exchanged."""


def check_feedback(record: Record) -> Iterator[Finding]:
    """Sims's test, over as much of the record as dynamics are judged by.

    Args:
        record: The record.

    Yields:
        Whether there is feedback.
    """
    if not record.moving:
        return
    found = record.feedback
    if isinstance(found, str):
        yield Finding(topic=Topic.FEEDBACK, code="feedback.unknown", verdict=Verdict.UNKNOWN, reason=found)
        return
    if found.found:
        if turned := list(exchanged(record)):
            yield from turned
            return
        code, verdict = "feedback.found", Verdict.LOOK
    elif record.runs_away:
        code, verdict = "feedback.holds", Verdict.LOOK
    elif found.slight:
        code, verdict = "feedback.slight", Verdict.NOTE
    else:
        code, verdict = "feedback.none", Verdict.FINE
    yield Finding(topic=Topic.FEEDBACK, code=code, verdict=verdict, subject=record.moving, figures=asdict(found))


def exchanged(record: Record) -> Iterator[Finding]:
    """Inputs that a linear response to the output explains well, where the other way round it does not.

    Args:
        record: The record.

    Yields:
        A finding for each.
    """
    forward = record.impulse
    if isinstance(forward, str):
        return
    output = record.mapping.output
    for name in record.moving:
        backward = Record(traces=record.traces, mapping=Mapping(inputs=(output,), output=name)).impulse
        if isinstance(backward, str) or backward.explained < WELL:
            continue
        if 1.0 - forward.explained > TIMES * (1.0 - backward.explained):
            figures = {"forward": max(forward.explained, 0.0), "backward": backward.explained}
            yield Finding(
                topic=Topic.FEEDBACK, code="feedback.exchanged", verdict=Verdict.LOOK, subject=(name,), figures=figures
            )
