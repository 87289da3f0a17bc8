"""Figures of a published report for programs: errors of the free run by case, beside what is published."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from sysid.atomic import replacing
from sysid.reporting.published.figures_file import read_figures
from sysid.reporting.records import Number

SCORES_FILE: Final = "scores.json"
"""Beside the page of a published run."""


class Score(BaseModel):
    """Mean squared errors of one model's free run by case."""

    model_config = ConfigDict(frozen=True, extra="allow", protected_namespaces=())

    mapping: str = Field(description="Written as in 'BP+AR -> BC'.")
    unit: str = Field(description="The output's unit.")
    model: str = Field(description="Which model, in a few words.")
    mse: dict[str, Number] = Field(description="By case, in the unit squared; null where the free run diverges.")
    published: dict[str, Number] = Field(default={}, description="Published figures by case, in the same unit.")
    source: str = Field(default="", description="Where they are printed, and of which model they are.")

    def typical(self, *, without: Sequence[str] = ("EST01",)) -> float:
        """Geometric mean over the cases; infinite where one diverges, so that such a model is nobody's best.

        Example:
            >>> Score(mapping="u -> y", unit="V", model="a", mse={"EST01": 9.0, "A": 1.0, "B": 4.0}).typical()
            2.0
        """
        errors = [error for case, error in self.mse.items() if case not in without]
        if not errors or not all(math.isfinite(error) for error in errors):
            return math.inf
        return math.exp(sum(math.log(error) for error in errors) / len(errors))


_SCORES: Final = TypeAdapter(list[Score])


def write_scores(folder: Path, scores: Sequence[Score]) -> Path:
    """Write scores.json.

    Args:
        folder: Folder of the report.
        scores: The scores.

    Returns:
        The file.
    """
    path = Path(folder) / SCORES_FILE
    with replacing(path) as draft:
        draft.write_bytes(_SCORES.dump_json(list(scores), indent=1) + b"\n")
    return path


def read_scores(folder: Path) -> list[Score]:
    """The scores of a published report.

    Args:
        folder: Folder of the report.

    Returns:
        The scores.

    Raises:
        ConfigError: If there are none, or they are damaged.
    """
    return read_figures(
        Path(folder) / SCORES_FILE,
        _SCORES,
        what="the scores of the report cannot be read",
        expected="what sysid publish writes beside the page of a run",
        remedy="publish the run again",
    )
