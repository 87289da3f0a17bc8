"""How much data bought how much accuracy of a surrogate: rounds of added experiments, and random ones beside them."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from pydantic import Field

from sysid.reporting.charts import Chart, Line, chart_pictures
from sysid.reporting.parts import Section
from sysid.reporting.records import Number, Record, parse_record, read_document
from sysid.reporting.tables import plain_table

FILE: Final = "growth.json"
"""In the folder of a run."""


class RoundRecord(Record):
    """A surrogate after a round."""

    number: int = Field(description="0 is before any.")
    how: str = Field(description="start, worst, uncertain, or random: the control.")
    fitted: int = Field(description="Experiments that it was fitted to.")
    ran: int = Field(description="New experiments for which the reference had been run by then to look where to add.")
    error: Number = Field(
        description="Error quantile on the selection runs, a share of the range; infinite if unusable."
    )
    median: Number = Field(description="The middle one.")
    seconds: Number = Field(description="Wall time of its training.")


class GrowthRecord(Record):
    """All rounds."""

    schema_version: int = Field(default=1, description="1.")
    pick: str = Field(description="What was added: worst or uncertain.")
    candidates: int = Field(description="New experiments that a round looked at.")
    until: Number = Field(description="Share of the range that was aimed at.")
    quantile: Number = Field(description="Of the selection runs.")
    selection: int = Field(description="Selection runs.")
    rounds: list[RoundRecord]
    ended: str = Field(description="Why there was no further round.")
    chosen_round: int = Field(description="Whose model is the surrogate.")
    chosen_by_chance: bool = Field(default=False, description="Whether that is the control's.")

    @property
    def sentence(self) -> str:
        """For the report and the screen."""
        by = "added at random" if self.chosen_by_chance else f"the {self.pick} ones added"
        first = self.rounds[0]
        chosen = self.of(self.chosen_round, by_chance=self.chosen_by_chance)
        rounds = sum(one.how != "random" for one in self.rounds) - 1
        return (
            f"Grown over {rounds} rounds; {self.ended}. Of {self.selection} selection runs, {self.quantile:.0%} "
            f"have an error of at most {100.0 * first.error:.3g} % of the range with {first.fitted} experiments; with "
            f"{chosen.fitted} ({by}, round {self.chosen_round}), which is taken, {100.0 * chosen.error:.3g} %"
        )

    def of(self, number: int, *, by_chance: bool) -> RoundRecord:
        """A round, of the control or not."""
        return next(
            one for one in self.rounds if one.number == number and (number == 0 or (one.how == "random") is by_chance)
        )


def growth_section(folder: Path) -> list[Section]:
    """The section of a run that has grown its data.

    Args:
        folder: The run's folder.

    Returns:
        The section; none for a run that has not.

    Raises:
        ConfigError: If its file is damaged.
    """
    file = Path(folder) / FILE
    if not file.is_file():
        return []
    record = parse_record(GrowthRecord, read_document(file), where=file, what="the figures of the growth")
    lines = []
    for name, wanted in ((record.pick, record.pick), ("at random", "random")):
        rows = [one for one in record.rounds if one.how in {"start", wanted}]
        if len(rows) > 1:
            errors = [100.0 * one.error for one in rows]
            lines.append(Line(name=name, x=[float(one.fitted) for one in rows], y=errors, how="points"))
    fitted = [float(one.fitted) for one in record.rounds]
    aim = Line(name="aimed at", x=[min(fitted), max(fitted)], y=[100.0 * record.until] * 2, how="target")
    chart = Chart(
        title="Accuracy against data",
        caption=f"Error that {record.quantile:.0%} of {record.selection} selection runs stay under, over the "
        "experiments that were fitted.",
        x="experiments fitted", y="error (% of the range)", lines=[*lines, aim], logarithmic="xy",
    )  # fmt: skip
    table = plain_table(
        "How much data bought how much accuracy",
        [
            ("Round", ""), ("Added", "how"), ("Fitted", "experiments"), ("Looked at", "runs"),
            ("Error", "% of the range"), ("Median error", "% of the range"), ("Training", "s"),
        ],
        [
            [str(one.number), one.how, one.fitted, one.ran, 100.0 * one.error, 100.0 * one.median, one.seconds]
            for one in record.rounds
        ],
        note="Random is the control: as many of the same new experiments, as they come. "
        + ("The reference ran all of those that were looked at. " if record.pick == "worst" else "")
        + "The selection runs choose, so that their figures are a little too good; the proof's experiments had no say.",
    )  # fmt: skip
    return [
        Section(
            anchor="growth", title="Growth", parts=(f"{record.sentence}.", *chart_pictures([chart], "growth"), table)
        )
    ]
