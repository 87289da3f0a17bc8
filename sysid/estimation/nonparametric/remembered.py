"""Impulse responses that were estimated before: every fit of the same records asks for the same ones."""

from __future__ import annotations

from collections.abc import Sequence

from sysid.estimation.nonparametric.impulse import estimate_impulse_response
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse
from sysid.estimation.nonparametric.memory import Memory, key_of
from sysid.estimation.nonparametric.segments import segments_of
from sysid.models import Mapping
from sysid.traces import Trace

MOST = 16
"""Responses that a process remembers; one of 512 columns takes 2 MB."""

_memory = Memory[ImpulseResponse](MOST)


def remembered_response(traces: Sequence[Trace], mapping: Mapping, *, longest: int) -> ImpulseResponse:
    """The impulse response of every input, estimated once a process for the same samples.

    A sweep fits the same records a hundred times, and an estimate takes longer than most fits of a linear structure.

    Args:
        traces: The experiments.
        mapping: Which channels go in, which comes out.
        longest: Lags at most.

    Returns:
        The response; its arrays are read-only, since others have them too.

    Raises:
        UserError: As :func:`~sysid.estimation.nonparametric.impulse.estimate_impulse_response` does.
    """
    units = [(trace.sample_time, *(trace.channel(name).unit for name in mapping.channels)) for trace in traces]
    key = key_of(segments_of(traces, mapping, of_inputs=True), mapping, longest, units)
    return _memory.get(key, lambda: _read_only(estimate_impulse_response(traces, mapping, longest=longest)))


def _read_only(found: ImpulseResponse) -> ImpulseResponse:
    for array in (found.lags, found.values, found.covariance):
        array.setflags(write=False)
    return found
