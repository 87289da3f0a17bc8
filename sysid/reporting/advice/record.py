"""What was found in a record, as it is stored in results.json."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from sysid.reporting.records import Number, Record


class FindingRecord(Record):
    """One thing that was found in the record."""

    topic: str = Field(description="AMOUNT, CHANNELS, EXCITATION, FEEDBACK, DYNAMICS, SAMPLING, NOISE or LINEARITY.")
    code: str = Field(description="What was found, such as excitation.low.")
    verdict: str = Field(description="FINE, NOTE (worth knowing), LOOK (look at this) or UNKNOWN (cannot be said).")
    subject: list[str] = Field(default=[], description="Channels or traces that it is about.")
    figures: dict[str, Number] = Field(default={}, description="By name; those that are not finite are left out.")
    reason: str = Field(default="", description="Why it cannot be said.")


class SuggestionRecord(Record):
    """A structure that is worth a try."""

    structure: dict[str, Any] = Field(description="All fields of the structure.")
    label: str = Field(description="The structure in a few characters.")
    code: str = Field(description="Why, such as structure.arx.")
    at_edge: bool = Field(default=False, description="Whether its orders are the largest that were tried.")


class ImpulseRecord(Record):
    """The regularised impulse response, with its bands."""

    time: list[Number] = Field(description="Seconds after the pulse.")
    inputs: list[str] = Field(description="Names.")
    values: list[list[Number]] = Field(description="By input: output unit per input unit and sample.")
    deviation: list[list[Number]] = Field(description="By input: standard deviations.")


class ResponseRecord(Record):
    """The frequency response, with its bands, and coherence."""

    frequency: list[Number] = Field(description="In rad/s.")
    inputs: list[str] = Field(description="Names.")
    gain: list[list[Number]] = Field(description="By input: output unit per input unit.")
    low: list[list[Number]] = Field(description="By input: lower end of the 95 % band of the gain.")
    high: list[list[Number]] = Field(description="By input: upper end.")
    coherence: list[Number] = Field(description="Share of the output that all inputs explain, 0 to 1.")


class AdviceRecord(Record):
    """What is in the record, before anything is fitted to it."""

    mapping: str = Field(description="Written as in 'u1+u2 -> y'.")
    units: dict[str, str] = Field(description="Unit of each channel.")
    findings: list[FindingRecord] = Field(description="In the order of the topics.")
    suggestions: list[SuggestionRecord] = Field(default=[], description="The simplest first.")
    impulse: ImpulseRecord | None = None
    response: ResponseRecord | None = None
