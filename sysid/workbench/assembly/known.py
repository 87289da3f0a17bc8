"""Known members: what is known of a system is declared, and only the rest is fitted.

A known member is a weighted sum of channels, held between two bounds: a valve that opens fully within one psi of its
setting, a limit switch, a difference that a member reads better than its two terms. Networks that stand beside it are
fitted with it as one more measured channel; in the whole it runs on what the others put out, and nothing trains it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sysid.models import NARX, NARXModel, Scaling
from sysid.traces import Channel, Trace
from sysid.workbench.assembly.config import KnownConfig


def known_model(known: KnownConfig, like: Trace) -> NARXModel:
    """A declared member as a network without neurons, so that it runs and is exported like the others.

    Args:
        known: What is declared.
        like: A trace with its inputs, for their units and the sample time.

    Returns:
        The model, without its bounds.

    Raises:
        ChannelError: If the trace lacks an input.
    """
    inputs = known.mapping.inputs
    return NARXModel(
        network=NARX(input_delays=[0], output_delays=1, neurons=0),
        theta=np.array([known.constant, *(known.gains[name] for name in inputs), 0.0]),
        scaling=Scaling.identity(len(inputs)),
        mapping=known.mapping,
        sample_time=like.sample_time,
        input_units=tuple(like.channel(name).unit for name in inputs),
        output_unit=known.unit,
        rest_output=known.rest,
        clamp=np.inf,  # its bounds are limits of the whole: a model at its own bound counts as lost
    )


def with_known(known: Sequence[KnownConfig], traces: Sequence[Trace]) -> list[Trace]:
    """Traces with what the known members say of their measured channels, as further channels.

    Args:
        known: The known members; a later one may read an earlier one.
        traces: Measured traces.

    Returns:
        As many traces.
    """

    def one(trace: Trace) -> Trace:
        for member in known:
            column = known_model(member, trace).simulate(trace.columns(member.mapping.inputs))
            column = np.clip(column, member.low, member.high)
            trace = replace(
                trace,
                channels=(*trace.channels, Channel(name=member.mapping.output, unit=member.unit)),
                values=np.column_stack([trace.values, column]),
            )
        return trace

    return [one(trace) for trace in traces] if known else list(traces)
