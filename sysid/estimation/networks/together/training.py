"""A cascade trained end to end: all members together, for the error of the whole."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from collections.abc import Mapping as Dict

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.networks.together.fit import Joint
from sysid.estimation.networks.together.layout import JointLayout
from sysid.estimation.networks.together.options import JointTraining
from sysid.estimation.networks.together.result import CascadeFit
from sysid.estimation.networks.training import FitProgress
from sysid.models import Cascade
from sysid.traces import Trace

SMALLEST_ERROR = 1e-3
"""Least error that counts as one, as a share of the target's spread: a target that fits perfectly already must not
outweigh all others."""


def fit_cascade(
    cascade: Cascade,
    traces: Sequence[Trace],
    *,
    targets: Sequence[str] | Dict[str, float] | None = None,
    trained: Sequence[str] | None = None,
    training: JointTraining | None = None,
    selection: Sequence[Trace] = (),
    shared: Collection[str] = (),
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> CascadeFit:
    """Train the members of a cascade together, from where they are, for the free run of the whole.

    Sensitivities go through the wiring: the loss on a downstream output moves the parameters upstream. Each member
    keeps the prior that it would have alone. A grey box without states, whose lags are whole samples, is trained
    likewise: by its parameters, within their bounds and by their priors.

    Args:
        cascade: The start; its members have been fitted before.
        traces: Estimation traces with the cascade's inputs and the targets; a run over each begins at rest.
        targets: Outputs whose error counts, all by default; given with numbers, the error of each in its unit that
            counts as one, otherwise the start's root mean square error, so that all targets count alike.
        trained: Outputs of the members that are trained; all by default.
        training: How to train.
        selection: Traces that choose among the states on the way, the start among them.
        shared: Names of parameters of equations that are one wherever they stand.
        on_progress: Called after every iteration.

    Returns:
        The best cascade seen; never one that does worse on the selection traces than the start.

    Raises:
        ChannelError: If a trace lacks an input or a target, or a name is no output of the cascade.
        ConfigError: If a member that is trained, or lies between trained ones and a target, has no flat parameters.
    """
    training = training or JointTraining()
    errors = unit_errors(cascade, traces, targets)
    provider = training.provider(cascade, traces, errors, trained)
    records = [_channels(cascade, trace) for trace in traces]
    layout = JointLayout.of(provider.members, records, shared)
    joint = Joint(provider=provider, layout=layout, training=training, selection=selection, on_progress=on_progress)
    return joint.fit(layout.in_basis(provider.theta))


def unit_errors(
    cascade: Cascade, traces: Sequence[Trace], targets: Sequence[str] | Dict[str, float] | None
) -> dict[str, float]:
    """The error of each target that counts as one.

    Args:
        cascade: The start.
        traces: Estimation traces.
        targets: As for :func:`fit_cascade`.

    Returns:
        By output, in its unit.

    Raises:
        ChannelError: If a trace lacks an input or a target, or a target is no output.
    """
    if isinstance(targets, Dict):
        return {name: float(error) for name, error in targets.items()}
    names = cascade.outputs if targets is None else tuple(targets)
    runs = [cascade.simulate_trace(trace) for trace in traces]
    errors = {}
    for name in names:
        seen = [trace.counted(cascade.inputs, [name])[:, 0] for trace in traces]
        known = list(zip(runs, traces, seen, strict=True))
        differences = np.concatenate([(run[name] - trace[name])[own] for run, trace, own in known])
        spread = float(np.std(np.concatenate([trace[name][own] for _, trace, own in known])))
        errors[name] = max(float(np.sqrt(np.mean(differences**2))), SMALLEST_ERROR * spread, np.finfo(np.float64).tiny)
    return errors


def _channels(cascade: Cascade, trace: Trace) -> dict[str, NDArray[np.float64]]:
    """What the members will see: measured where the trace has it, simulated otherwise."""
    run = cascade.simulate_trace(trace)
    return {name: trace[name] if name in trace.channel_names else run[name] for name in cascade.wiring.channels}
