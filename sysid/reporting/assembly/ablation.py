"""Ablation: what each step of modelling by parts brings, in words and figures.

Each compares what comes before with what comes after, on scored cases that nothing was fitted to. A step that the
pipeline has no stage for is not put to the test, and not mentioned.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from sysid.reporting.assembly.results import AblationComparison, AblationRecord
from sysid.reporting.assembly.tables import Value, mse_value
from sysid.reporting.numbers import number, times
from sysid.reporting.tables import Table, plain_table


@dataclass(frozen=True, kw_only=True)
class Claim:
    """What is said of a step.

    Args:
        text: What it says.
        before: What stands before, in a few words.
        after: What stands after.
    """

    text: str
    before: str
    after: str


CLAIMS: Final = {
    "close_loop": Claim(
        text="A network that was fitted one step ahead fails once its loop is closed",
        before="fitted one step ahead",
        after="fitted in free run",
    ),
    "choose_together": Claim(
        text="The members that are best alone are not the best together",
        before="of the best alone",
        after="of the best together",
    ),
    "retrain": Claim(
        text="Training members again on what the others put out helps", before="before", after="retrained"
    ),
    "train_together": Claim(
        text="Training the whole as one goes further than its parts", before="in parts", after="end to end"
    ),
}
"""By the ``step`` of :class:`sysid.reporting.assembly.results.AblationRecord`."""


def ablation_table(found: Sequence[AblationRecord]) -> Table:
    """The steps with their figures.

    Args:
        found: The steps.

    Returns:
        The table.
    """
    rows: list[list[Value]] = [
        [
            CLAIMS[one.step].text if index == 0 else "",
            f"{part.what}: {CLAIMS[one.step].before}{_deceptive(part)}, then {CLAIMS[one.step].after}",
            mse_value(part.before),
            mse_value(part.after),
            times(part.before / part.after) if math.isfinite(part.before / part.after) else "",
            held(one) if index == 0 else "",
            one.published if index == 0 else "",
        ]
        for one in found
        for index, part in enumerate(one.comparisons)
    ]
    return plain_table(
        "Ablation: what each stage is said to bring, and whether it held",
        [
            ("Claim", ""), ("Compared", ""), ("Before", "mse"), ("After", "mse"), ("Less by", ""),
            ("Verdict", ""), ("Published", ""),
        ],
        rows,
        note="Mean squared error of the free run, the geometric mean over outputs and over the cases that nothing "
        "was fitted to.",
    )  # fmt: skip


def ablation_point(found: Sequence[AblationRecord]) -> tuple[str, str]:
    """For the verdict.

    Args:
        found: The steps.

    Returns:
        Keyword and sentence.
    """
    return "Ablation", " ".join(f"{CLAIMS[one.step].text}: {held(one)}." for one in found)


def held(one: AblationRecord) -> str:
    """Whether what is said of a step held."""
    better = [part.what for part in one.comparisons if part.better]
    if len(better) == len(one.comparisons):
        return "held"
    return f"held for {', '.join(better)} only" if better else "did not hold"


def _deceptive(part: AblationComparison) -> str:
    """The error one step ahead, where it is what one would have gone by."""
    return f" (where it has {number(part.one_step)})" if math.isfinite(part.one_step) else ""
