"""Is there enough of it: samples, gaps, experiments."""

from __future__ import annotations

from collections.abc import Iterator

from sysid.advice.finding import Finding, Topic, Verdict
from sysid.advice.record import SEEN, Record

FEW, MANY_MASKED = 100, 0.2


def check_amount(record: Record) -> Iterator[Finding]:
    """Count.

    Args:
        record: The record.

    Yields:
        How much there is; what is masked.
    """
    total = sum(map(len, record.traces))
    lengths = [len(segment) for segment in record.segments]
    usable = sum(lengths)
    longest = max(lengths, default=0)
    yield Finding(
        topic=Topic.AMOUNT,
        code="amount" if usable >= FEW else "amount.few",
        verdict=Verdict.FINE if usable >= FEW else Verdict.LOOK,
        figures={
            "samples": total,
            "usable": usable,
            "experiments": len(record.traces),
            "seconds": total * record.sample_time,
            "longest": longest,
        },
    )
    if usable > SEEN:
        figures = {"seen": SEEN}
        yield Finding(topic=Topic.AMOUNT, code="amount.part", verdict=Verdict.FINE, figures=figures)
    if usable < total:
        share, known = 1.0 - usable / total, sum(map(len, record.runs))
        yield Finding(
            topic=Topic.AMOUNT,
            code="amount.masked_output" if known == total else "amount.masked",
            verdict=Verdict.LOOK if share > MANY_MASKED or longest < FEW else Verdict.NOTE,
            figures={"share": share, "stretches": len(lengths), "longest": longest},
        )
    if not record.mapping.inputs:
        yield Finding(topic=Topic.AMOUNT, code="amount.no_input", verdict=Verdict.NOTE)
