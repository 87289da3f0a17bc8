"""Whether the plant integrates: whether a linear model that adds up exactly does as well as one that need not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import UserError
from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.estimation.networks.neural.start import linear_start
from sysid.estimation.records.experiment import experiments_of, unit_range
from sysid.models import Mapping, NeuralForm, Start, StartKind
from sysid.models.networks.neural_sizes import Sizes
from sysid.traces import Trace

STATES = (2, 3)
"""Of the linear models that are compared."""
SAMPLES = 500
"""To which a longer record is slowed by means over blocks: it is about what is slow."""
NO_WORSE, EXACT = 1.5, 1e-10
"""Times the mean squared error of a model that need not add up which one that does may have; and the share of the
output's variance below which an error is none."""
UNEXPLAINED = 0.1
"""Share of the output's variance that the best model may leave: of what it leaves, nobody knows whether it adds up."""
BRINGS = 0.5
"""Share of the output's variance that has to come from the sum: one that brings nothing does no harm either."""
BENDS = 0.3
"""The same of what lines in time leave of both: an offset that is summed up is a line, and so is any drift."""
FORGETS = 0.1
"""Share of a record within which a model has forgotten where it was: where one does as well, nothing adds up."""


def integrates(traces: Sequence[Trace], mapping: Mapping) -> bool:
    r"""Whether the plant adds up what its inputs bring, so that its output stays wherever it is left.

    Linear state spaces are fitted to the free run, with and without a pole that is 1 exactly. A pole that is found near
    1 says little: of a plant with friction it lies beside 1 by more than its interval. What a record does show is
    whether anything is lost where the level of the output changes nothing. A plant integrates where the sum brings
    most of the output, beside a line in time too, and the model that has it leaves about as little as one that is free,
    and less than one that is free and forgets: beside other slow poles a sum may bring anything, and they take it off.

    Args:
        traces: The records.
        mapping: Inputs and output.

    Returns:
        Whether it does; not where linear models explain too little to say.
    """
    try:
        rest = float(np.mean([trace[mapping.output][0] for trace in traces]))
        experiments = experiments_of(traces, mapping, Start(kind=StartKind.ESTIMATED), rest)
    except UserError:
        return False
    sizes = Sizes(states=1, inputs=len(mapping.inputs), neurons=0, output_neurons=0)
    form = NeuralForm(sizes=sizes, theta=np.zeros(sizes.count), scaling=unit_range(experiments))
    records = NeuralProvider(template=form, experiments=experiments)
    values = [y[counts] for (_, y), counts in zip(records.signals, records.counted, strict=True)]
    variance = float(np.var(np.concatenate(values)))
    off_line = _off_lines(values)
    free = [_left(records, states, 0) for states in STATES]
    least = min(free).error
    if least > UNEXPLAINED * variance:
        return False
    summed = min(_left(records, states, 1) for states in STATES)
    adds_up = summed.error <= max(NO_WORSE * least, EXACT * variance) and summed.brought >= BRINGS * variance
    memory = FORGETS * max(map(len, values))
    forgotten = any(one.memory < memory and one.error <= NO_WORSE * summed.error for one in free)
    return adds_up and summed.bent >= BENDS * off_line and not forgotten


def _off_lines(values: Sequence[NDArray[np.float64]]) -> float:
    """Mean square of what a line in time, of each record its own, leaves of some signals."""
    squares, count = 0.0, 0
    for y in values:
        line = np.column_stack([np.ones(len(y)), np.linspace(-1.0, 1.0, len(y))])
        left = y - line @ np.linalg.lstsq(line, y, rcond=None)[0]
        squares, count = squares + float(np.sum(left**2)), count + left.size
    return squares / max(count, 1)


class _Left(NamedTuple):
    """A linear model's mean squared error, variance of its mode at 1, also without lines in time, and slowest decay."""

    error: float
    brought: float
    bent: float
    memory: float


def _left(records: NeuralProvider, states: int, integrators: int) -> _Left:
    """What the best linear model of so many states leaves, and what its sum brings."""
    sizes = replace(records.template.sizes, states=states, integrators=integrators)
    form = replace(records.template, sizes=sizes, theta=np.zeros(sizes.count))
    provider = replace(records, template=form)
    theta = linear_start(provider)
    M = theta[sizes.linear].reshape(states, -1)[:, :states]
    values, left, right = scipy.linalg.eig(M, left=True)
    last = np.argmin(np.abs(values - 1.0))
    mode, shape = left[:, last].real, right[:, last].real
    brings = float(theta[sizes.output_linear][:states] @ shape) / float(mode @ shape or 1.0)
    paths = [brings * (path @ mode) for path in provider.states(theta)]
    error = 2.0 * provider.loss(theta) / provider.n_samples
    size = float(np.abs(values).max())
    memory = np.inf if size >= 1.0 else -1.0 / np.log(max(size, 1e-300))
    return _Left(error, float(np.var(np.concatenate(paths))), _off_lines(paths), float(memory))
