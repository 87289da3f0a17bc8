"""One channel u from stamps and values to a trace, and what is checked of the trace or of the refusal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.errors import UserError
from sysid.ingest import FileOptions, GridOptions, RawColumn, RawTable, RepairOptions
from sysid.ingest.assembling.assemble import Wanted, assemble
from sysid.traces import Channel, Trace
from sysid.units import Reference

N = 20
NAN = float("nan")
EVEN = [0.1 * i for i in range(N)]

Refused = tuple[dict[str, Any], type[UserError], str]
"""Arguments, error class, message: what, where, expected, got, remedy in this order."""

Done = tuple[dict[str, Any], list[float], list[int], str]
"""Arguments, values that come out, samples that do not count, what the provenance says."""


def ramp(values: Sequence[float] | None = None) -> list[float]:
    return list(values) if values is not None else [float(i) for i in range(N)]


def make(
    folder: Path,
    *,
    stamps: Sequence[float] | None = None,
    values: Sequence[float] | None = None,
    unit: str | None = "V",
    time_unit: str | None = "s",
    reference: Reference | None = None,
    channel: Channel | None = None,
    sample_time: float = 0.1,
    files: dict[str, Any] | None = None,
    grid: dict[str, Any] | None = None,
    repairs: dict[str, Any] | None = None,
    **wanted: Any,
) -> Trace:
    """One channel u through the whole way; its lines in the file start at 2."""
    source = folder / "run.csv"
    source.write_text("content")
    times = EVEN if stamps is None else stamps
    levels = [float(i) for i in range(len(times))] if values is None else values
    table = RawTable(
        source=source,
        reader="csv",
        columns=(
            RawColumn(name="t", values=np.array(times, dtype=float), unit=time_unit),
            RawColumn(name="u", values=np.array(levels, dtype=float), unit=unit, reference=reference),
        ),
        time="t",
        lines=np.arange(len(times)) + 2,
    )
    return assemble(
        table,
        Wanted(name="RUN", channels=(channel or Channel(name="u", unit="V"),), sample_time=sample_time, **wanted),
        files=FileOptions.model_validate(files or {}),
        grid=GridOptions.model_validate(grid or {}),
        repairs=RepairOptions.model_validate(repairs or {}),
    )


def check_refused(folder: Path, arguments: dict[str, Any], kind: type[UserError], message: str) -> None:
    """Check that a problem is refused, and that the error says all that it should."""
    with pytest.raises(kind, match=f"(?s){message}") as caught:
        make(folder, **arguments)
    assert "run.csv" in str(caught.value.where)
    assert None not in {caught.value.expected, caught.value.got, caught.value.remedy}


def check_done(folder: Path, arguments: dict[str, Any], values: list[float], masked: list[int], told: str) -> None:
    """Check the samples that come out, which of them do not count, and that the provenance says what was done."""
    trace = make(folder, **arguments)
    np.testing.assert_allclose(trace["u"], values, atol=1e-9)
    assert np.flatnonzero(~trace.usable_samples).tolist() == masked
    assert told in trace.provenance
    assert trace.provenance[0].startswith("read from run.csv (SHA-256 ")
