"""The stored static curves of a fit."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from pydantic import BaseModel, ConfigDict

from sysid.bounded_text import read_json
from sysid.errors import ConfigError
from sysid.models.curve_values import CurvePoints
from sysid.reporting.records import Number

CURVES_FILE: Final = "curves.json"


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

    def points(self) -> CurvePoints:
        """As the picture takes it."""
        arrays = {name: np.array(getattr(self, name), dtype=np.float64) for name in ("x", "y", "edges", "counts")}
        if arrays["x"].shape != arrays["y"].shape or len(arrays["edges"]) != len(arrays["counts"]) + 1:
            raise ValueError("the numbers of one curve do not belong together")
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
    try:
        return [curve.points() for curve in _Curves.model_validate(read_json(path)).curves]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, RecursionError) as error:
        raise ConfigError(
            "the stored curves cannot be read",
            where=path,
            expected="curves with as many values as points",
            got=f"{error!s:.200}",
            remedy="run the pipeline again; it resumes from what is finished",
        ) from error
