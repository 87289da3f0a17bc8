"""The section of a report that says what is in the record, before anything was fitted to it."""

from __future__ import annotations

from collections.abc import Sequence

from sysid.advice import Verdict
from sysid.reporting.advice.record import AdviceRecord
from sysid.reporting.advice.words import lines
from sysid.reporting.figures.advice_figure import advice_figure
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.reporting.parts import Part, Section, picture
from sysid.reporting.tables import Cell, Table

CAPTION = (
    "Estimates without a structure: impulse response with its prior chosen by evidence, frequency response and"
    " coherence by Blackman and Tukey. Shaded: 95 %."
)


def advice_section(found: Sequence[AdviceRecord], unit: FrequencyUnit = HERTZ) -> Section:
    """What is in the record: every finding with what to do, structures to try, pictures.

    Args:
        found: What was found, output by output.
        unit: Of the frequencies that are drawn.

    Returns:
        The section.
    """
    parts: list[Part] = []
    for number, advice in enumerate(found):
        parts += [_summary(advice), _table(advice)]
        drawing = advice_figure(advice, unit)
        if drawing is not None:
            parts.append(picture(drawing, f"First look at {advice.mapping}", CAPTION, f"advice-{number}"))
    return Section(anchor="advice", title="What is in this record?", parts=tuple(parts))


def _summary(advice: AdviceRecord) -> str:
    count = sum(one.verdict == Verdict.LOOK.name for one in advice.findings)
    unknown = sum(one.verdict == Verdict.UNKNOWN.name for one in advice.findings)
    sentences = [f"{advice.mapping}, on the traces that are fitted or choose."]
    looks = f"{count} of {len(advice.findings)} findings ask to be looked at."
    sentences.append(looks if count else "Nothing stands in the way of a model.")
    sentences += [f"{unknown} cannot be said from this record."] if unknown else []
    return " ".join(sentences)


def _table(advice: AdviceRecord) -> Table:
    rows, before = [], ""
    for question, verdict, says, do in lines(advice):
        mark = "best" if verdict == Verdict.LOOK.value else ""
        asked = question if question != before else ""
        before = question
        rows.append((Cell(text=asked, header=True), Cell(text=verdict, mark=mark), Cell(text=says), Cell(text=do)))
    return Table(
        caption="What is in the record, and what to do about it.",
        head=(("question", ""), ("verdict", ""), ("what was found", ""), ("what to do", "")),
        rows=tuple(rows),
        note="Found by estimates without a structure; nothing here looks at the traces that only score.",
    )
