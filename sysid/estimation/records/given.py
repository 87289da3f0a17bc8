"""Records and a mapping in any of the forms that :func:`sysid.fit` takes, for what is called by itself."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from typing import Any

from sysid.models import Mapping
from sysid.traces import Trace, TraceSet

Records = TraceSet | Trace | Sequence[Trace]
"""A data set, a record, or several."""
Given = Mapping | str | Dict[str, Any]
"""How a mapping is written."""


def given(traces: Records, mapping: Given) -> tuple[tuple[Trace, ...], Mapping]:
    """The records to estimate from, and what goes in and comes out.

    Args:
        traces: A data set, whose records for estimation are taken; a record or several, all of which are.
        mapping: ``"u -> y"``, lists by name, or a mapping.

    Returns:
        Both.

    Raises:
        ConfigError: If the mapping cannot be read, or no record is for estimation.
    """
    if isinstance(traces, TraceSet):
        return tuple(traces.estimation), Mapping.of(mapping)
    return (traces,) if isinstance(traces, Trace) else tuple(traces), Mapping.of(mapping)
