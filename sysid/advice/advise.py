"""The look at data first: every check in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np

from sysid.advice.amount import check_amount
from sysid.advice.channels import check_channels
from sysid.advice.dynamics import check_dynamics, check_noise, check_sampling
from sysid.advice.excitation import check_excitation
from sysid.advice.feedback import check_feedback
from sysid.advice.finding import Advice, Finding
from sysid.advice.linearity import check_linearity
from sysid.advice.record import Record
from sysid.advice.structures import suggestions
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.nonparametric.memory import Memory
from sysid.models import Mapping
from sysid.traces import Role, Trace, TraceSet

CHECKS: Final[tuple[Callable[[Record], Iterator[Finding]], ...]] = (
    check_amount,
    check_channels,
    check_excitation,
    check_feedback,
    check_dynamics,
    check_sampling,
    check_noise,
    check_linearity,
)
"""In the order in which they are read."""


MOST = 16
"""Answers that a process remembers: a search looks at its traces, and its page shows them."""
_memory = Memory[Advice](MOST)


@one_blas_thread()
def advise(traces: TraceSet, mapping: Mapping, *, suggest: bool = True) -> Advice:
    """Look at a data set: what is in it, what is wrong with it, what to try.

    Args:
        traces: The data set; its estimation and selection traces are looked at, all where there are none.
        mapping: Inputs and output.
        suggest: Whether structures are looked for, too, whose orders take longer than most checks.

    Returns:
        What was found; nothing in it is random.

    Raises:
        ChannelError: If a channel of the mapping is missing.
        TraceError: If a channel has values that cannot be squared.
    """
    chosen = traces.with_role(Role.ESTIMATION, Role.SELECTION) or traces.traces
    spans = [(trace.name, trace.start_time, len(trace)) for trace in traces]
    key = repr((traces.name, mapping, suggest, [(trace.name, trace.digest) for trace in chosen], spans))
    return _memory.get(key, lambda: _advice(traces, mapping, chosen, suggest=suggest))


def _advice(traces: TraceSet, mapping: Mapping, chosen: Sequence[Trace], *, suggest: bool) -> Advice:
    for trace in chosen:
        trace.check_sizes([*mapping.inputs, *mapping.outputs])
    record = Record(
        traces=tuple(trace.seen_by(mapping.channels, each=True) for trace in chosen),
        mapping=mapping,
        others=tuple(trace for trace in traces if trace not in chosen),
    )
    findings = tuple(finding for check in CHECKS for finding in check(record))
    impulse, response = record.slowed[0].impulse, record.response
    if not isinstance(response, str):  # others have it too
        for value in vars(response).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
    return Advice(
        data=traces.name,
        mapping=mapping,
        sample_time=traces.sample_time,
        units={name: traces.traces[0].channel(name).unit for name in (*mapping.inputs, mapping.output)},
        findings=findings,
        suggestions=suggestions(record, findings) if suggest else (),
        impulse=None if isinstance(impulse, str) else impulse,
        response=None if isinstance(response, str) else response,
    )
