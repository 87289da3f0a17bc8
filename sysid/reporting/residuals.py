"""The stored residual analyses of a fit."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict

from sysid.reporting.records import Number, parse_record, read_document

RESIDUALS_FILE: Final = "residuals.json"


class _Record(BaseModel):
    """Frozen; keys from a later release are skipped."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class CorrelationRecord(_Record):
    """A correlation function with its bound."""

    name: str
    lags: list[int]
    values: list[Number]
    bound: Number
    passed: bool


class ResidualRecord(_Record):
    """What the residuals on some cases look like."""

    n_samples: int
    variance: Number
    whiteness: CorrelationRecord
    ljung_box_p: Number
    white: bool
    inputs: list[CorrelationRecord]
    independent: bool
    sentences: list[str]


class GroupRecord(_Record):
    """Cases whose residuals were analysed together, or why they were not."""

    cases: list[str]
    analysis: ResidualRecord | None
    reason: str = ""


class _Residuals(_Record):
    groups: dict[str, GroupRecord]


def read_residuals(folder: Path) -> dict[str, GroupRecord]:
    """Read the residual analyses of one fit.

    Args:
        folder: The fit's folder.

    Returns:
        By group of cases; empty if the run stored none, as earlier releases did not.

    Raises:
        ConfigError: If the file is damaged.
    """
    path = Path(folder) / RESIDUALS_FILE
    if not path.is_file():
        return {}
    return parse_record(_Residuals, read_document(path), where=path, what="the stored residuals").groups
