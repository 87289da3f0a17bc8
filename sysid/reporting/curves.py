"""The stored static curves of a fit."""

from __future__ import annotations

from pathlib import Path
from typing import Final, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, model_validator

from sysid.models.blocks.curve_values import CurvePoints
from sysid.reporting.records import Number, parse_record, read_document

CURVES_FILE: Final = "curves.json"
_ARRAYS: Final = ("x", "y", "edges", "counts")


class _Curve(BaseModel):
    """Keys from a later release are skipped."""

    model_config = ConfigDict(frozen=True, extra="ignore")
    title: str
    before: str
    behind: str
    x: list[Number]
    y: list[Number]
    edges: list[Number]
    counts: list[Number]

    @model_validator(mode="after")
    def _fit_together(self) -> Self:
        if len(self.x) != len(self.y) or len(self.edges) != len(self.counts) + 1:
            raise ValueError("the numbers of one curve do not belong together")
        return self

    def points(self) -> CurvePoints:
        """As the picture takes it."""
        arrays = {name: np.array(getattr(self, name), dtype=np.float64) for name in _ARRAYS}
        return CurvePoints(title=self.title, before=self.before, behind=self.behind, **arrays)


class _Curves(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")
    curves: list[_Curve]


def read_curves(folder: Path) -> list[CurvePoints]:
    """Read the static curves of one fit.

    Args:
        folder: The fit's folder.

    Returns:
        Inputs first; empty for a model without curves.

    Raises:
        ConfigError: If the file is damaged.
    """
    path = Path(folder) / CURVES_FILE
    if not path.is_file():
        return []
    stored = parse_record(_Curves, read_document(path), where=path, what="the stored curves")
    return [curve.points() for curve in stored.curves]
