"""Each member by itself, behind measured inputs: its candidates beside each other, and beside published models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sysid.reporting.assembly.results import CandidateRecord, MemberRecord
from sysid.reporting.assembly.tables import Value, mse_value
from sysid.reporting.published.tables import PublishedTable
from sysid.reporting.tables import Table, plain_table
from sysid.units import squared


def member_tables(member: MemberRecord, published: PublishedTable | None) -> list[Table]:
    """A member's candidates beside each other, and beside published models of the same structure.

    Args:
        member: The member.
        published: Published models.

    Returns:
        One table of free runs; of fits one step ahead where there are such, and of run times where such are published.
    """
    asked = [_Asked(member, published, one.structure) for one in member.candidates]
    # What is published of a structure stands behind the last of its seeds.
    last = [all(one.label != later.label for later in asked[index + 1 :]) for index, one in enumerate(asked)]
    rows = list(zip(member.candidates, asked, last, strict=True))
    found = [_free_table(member, rows), _one_step_table(member, rows), _time_table(member, rows)]
    return [table for table in found if table is not None]


def candidate_name(one: CandidateRecord) -> str:
    """Structure and seed, and what became of it."""
    said = [word for word, yes in (("best alone", one.best_alone), ("chosen", one.chosen)) if yes]
    name = f"{one.structure}, seed {one.seed}"
    return f"{name} ({', '.join(said)})" if said else name


def _free_table(member: MemberRecord, rows: Rows) -> Table:
    said = list[list[Value]]()
    for one, asked, last in rows:
        said.append([candidate_name(one), *map(mse_value, one.free_run_mse.values()), one.selection])
        said += asked.errors("free_run", "closed", [None]) if last else []
    return plain_table(
        f"{member.mapping} by itself, behind measured inputs: mean squared error of the free run "
        f"[{squared(member.unit)}]",
        [("Candidate", ""), *((case, "") for case in member.cases), ("Selection", "geometric mean")],
        said,
        note="The selection traces alone say which is the best, and which the whole has.",
    )


def _one_step_table(member: MemberRecord, rows: Rows) -> Table | None:
    said = list[list[Value]]()
    for one, asked, last in rows:
        if one.one_step is None:
            continue
        for how, errors, run in (
            ("one step ahead", one.one_step.one_step_mse, "one_step"),
            ("in free run", one.one_step.free_run_mse, "free_run"),
        ):
            said.append([f"{one.structure}, seed {one.seed}: {how}", *map(mse_value, errors.values())])
            said += asked.errors(run, "open", []) if last else []
    if not said:
        return None
    return plain_table(
        f"{member.mapping} by itself, fitted one step ahead: mean squared error [{squared(member.unit)}]",
        [("Candidate", ""), *((case, "") for case in member.cases)],
        said,
        note="One step ahead the past output is the measured one, in free run the network's own.",
    )


def _time_table(member: MemberRecord, rows: Rows) -> Table | None:
    said, published = list[list[Value]](), list[list[Value]]()
    for one, asked, last in rows:
        if last:
            beside = asked.run_times()
            published += beside
            said += [[one.structure, *(1e3 * taken for taken in one.run_time_s.values())], *beside]
    if not published:
        return None
    return plain_table(
        f"{member.mapping} by itself: run time of the free run [ms]",
        [("Structure", ""), *((case, "") for case in member.cases)],
        said,
        note="Compiled, on one core; median of 5 runs after one that is not counted. Published ones are of another "
        "machine.",
    )


@dataclass(frozen=True)
class _Asked:
    """Published figures of one structure."""

    member: MemberRecord
    published: PublishedTable | None
    label: str

    def errors(self, run: str, loop: str, more: Sequence[Value]) -> list[list[Value]]:
        """The row of what was published of such a model's errors, or none."""
        return self._row("mse", f"{self.member.unit}^2", run, loop, more=more)

    def run_times(self) -> list[list[Value]]:
        """The row of its published run times in milliseconds, or none."""
        return self._row("run_time", "s", "free_run", "closed", scale=1e3)

    def _row(
        self, quantity: str, unit: str, run: str, loop: str, *, scale: float = 1.0, more: Sequence[Value] = ()
    ) -> list[list[Value]]:
        if self.published is None:
            return []
        found = {}
        for case in self.member.cases:
            figure = self.published.find(
                mapping=self.member.mapping, quantity=quantity, run=run, loop=loop, case=case, structure=self.label,
                unit=unit,
            )  # fmt: skip
            if figure is not None:
                found[case] = figure
        if not found:
            return []
        first = next(iter(found.values()))
        values = [scale * found[case].value if case in found else None for case in self.member.cases]
        return [[f"{first.source}: {first.label}", *values, *more]]


Rows = Sequence[tuple[CandidateRecord, _Asked, bool]]
"""Each candidate, what was published of its structure, and whether it is the last one of it."""
