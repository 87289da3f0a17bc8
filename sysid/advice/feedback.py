"""Does the output act on the inputs? Said of a record; it is found beside the estimates without a structure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

from sysid.advice.finding import Finding, Topic, Verdict
from sysid.advice.record import Record


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
        code, verdict = "feedback.found", Verdict.LOOK
    elif found.slight:
        code, verdict = "feedback.slight", Verdict.NOTE
    else:
        code, verdict = "feedback.none", Verdict.FINE
    yield Finding(topic=Topic.FEEDBACK, code=code, verdict=verdict, subject=record.moving, figures=asdict(found))
