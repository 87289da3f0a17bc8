"""Free runs of a state space over its records: what its one-step errors do not tell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.segments import Segment
from sysid.models import Scaling, VectorScaling
from sysid.models.channels.history import History
from sysid.models.contract.beginning import window
from sysid.models.linear.innovations import Innovations
from sysid.models.linear.state_space import StateSpace

Array = NDArray[np.float64]


def free_run_error(system: Innovations, segments: Sequence[Segment]) -> float:
    """Sum of squares of the free run, begun as a user's would: from the first samples, or from what had stood.

    Args:
        system: In scaled numbers, with a model of the noise.
        segments: The records, in scaled numbers.

    Returns:
        Each output over its sum of squares; infinite where a run is lost.
    """
    identity = Scaling.identity(system.n_inputs)
    form = StateSpace.of(system, VectorScaling.of([identity] * system.n_outputs), noise=True)
    errors, sizes = np.zeros(system.n_outputs), np.zeros(system.n_outputs)
    for segment in segments:
        counts, first = segment.root_weights > 0.0, 0
        if segment.rest is None:
            first = window(form.memory, counts, segment.inputs)
            history = History(inputs=segment.inputs[:first], output=segment.outputs[:first], usable=counts[:first])
        else:
            history = History.at_rest(inputs=segment.rest[0], output=segment.rest[1])
        if first == len(segment) or (segment.rest is None and first == 0):
            continue
        with np.errstate(all="ignore"):
            left = form.simulate(segment.inputs[first:], history) - segment.outputs[first:]
            errors += np.sum((left * segment.root_weights[first:, np.newaxis]) ** 2, axis=0)
        about = segment.outputs[first:] - segment.outputs.mean(axis=0)
        sizes += np.sum((about * segment.root_weights[first:, np.newaxis]) ** 2, axis=0)
    total = float(np.sum(errors / np.maximum(sizes, np.finfo(np.float64).tiny)))
    return total if np.isfinite(total) else np.inf
