"""Impulse responses that were estimated before: every fit of the same records asks for the same ones."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from threading import Lock

import numpy as np

from sysid.estimation.nonparametric.impulse import estimate_impulse_response
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse
from sysid.estimation.nonparametric.segments import segments_of
from sysid.models import Mapping
from sysid.traces import Trace

MOST = 16
"""Responses that a process remembers; one of 512 columns takes 2 MB."""

_known = dict[str, ImpulseResponse]()
_one_at_a_time = Lock()


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
    key = _key(traces, mapping, longest)
    found = _known.get(key)
    if found is None:
        found = estimate_impulse_response(traces, mapping, longest=longest)
        for array in (found.lags, found.values, found.covariance):
            array.setflags(write=False)
    with _one_at_a_time:
        _known.pop(key, None)
        while len(_known) >= MOST:
            del _known[next(iter(_known))]
        _known[key] = found  # the last that was asked for goes last
    return found


def _key(traces: Sequence[Trace], mapping: Mapping, longest: int) -> str:
    """Of all that a response depends on: the samples that count, where they stand, and what they are called."""
    units = [(trace.sample_time, *(trace.channel(name).unit for name in mapping.channels)) for trace in traces]
    sha = hashlib.sha256(repr((mapping, longest, units)).encode())
    for segment in segments_of(traces, mapping):
        sha.update(repr((segment.trace, segment.first, segment.inputs.shape)).encode())
        for signal in (segment.inputs, segment.output):
            sha.update(np.ascontiguousarray(signal).tobytes())
    return sha.hexdigest()
