r"""Fixed submodels: what is known of a system is declared, and only the rest is fitted.

A fixed submodel is a weighted sum of channels, held between two bounds: a valve that opens fully within one psi of its
setting, a limit switch, a difference that a member reads better than its two terms. Networks that stand beside it are
fitted with it as one more measured channel; in the whole it runs on what the others put out, and nothing trains it.

With its own last value in the sum it has a memory. Between the bounds 0 and 1 a weight of 1 is a latch: one input sets
it, another resets it. A weight :math:`h > 1` is a relay with hysteresis (a Schmitt trigger): with

.. math:: y(n) = \tfrac12 + k\,(x(n) - m) + h\,\bigl(y(n-1) - \tfrac12\bigr), \quad h = 1 + 2 k w,

it goes to 1 once :math:`x` is above :math:`m + w` and back to 0 once it is below :math:`m - w`, the quicker the larger
:math:`k`. A network would have to learn it from traces in which what follows jumps.

With weights by lag it looks ahead: :math:`2x(n) - x(n-1)` is what :math:`x` will be in the next sample if nothing
happens. A switch with such a sum, and with one over what :math:`x` moves in a sample as its gain, says for how much of
the next sample it will be open. That goes from 0 to 1 as steadily as the instant of switching moves, where a steeper
switch jumps from one sample to the next: what follows has no edge, and training sees which way to move the instant.

What is no weighted sum, such as a product, the greater of two channels, a root or a table, is an equation. It runs in
the same pass, exactly as it is written; training goes through it by the derivatives of its operations, which know
nothing of a switch: what a comparison decides has an edge. What is not known of it is a parameter, and is estimated
with the networks when the whole is trained end to end; until then it stands where it starts.
"""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sysid.composite.fixed.member import FixedMember
from sysid.composite.members import bounds_of, placed
from sysid.errors import ConfigError
from sysid.models import NARX, Cascade, GreyBoxModel, NARXModel, Scaling
from sysid.traces import Channel, Trace


def fixed_model(
    fixed: FixedMember, like: Trace, units: Dict[str, str] | None = None, values: Dict[str, float] | None = None
) -> NARXModel | GreyBoxModel:
    """A fixed submodel in its first instance, as a model that runs and is exported like the others.

    A sum is a network without neurons, and what is no sum a grey box, its parameters where they start.

    Args:
        fixed: What is declared.
        like: A trace with its inputs, for their units and the sample time.
        units: Units of inputs that the trace need not have.
        values: Of parameters by name, in their units; those that are not among them, or beyond their bounds, stand
            where they start, or at the bound.

    Returns:
        The model, without its bounds.

    Raises:
        ChannelError: If the trace lacks an input.
    """
    inputs = fixed.mapping.inputs
    channels: Dict[str, Any] = {
        "scaling": Scaling.identity(len(inputs)),
        "mapping": fixed.mapping,
        "sample_time": like.sample_time,
        "input_units": tuple((units or {}).get(name) or like.channel(name).unit for name in inputs),
        "output_unit": fixed.unit_in(like),
        "rest_output": fixed.rest,
    }
    if fixed.equation:
        given = values or {}
        theta = np.array([min(max(given.get(one.name, one.start), one.low), one.high) for one in fixed.free])
        return GreyBoxModel(
            grey=fixed.grey_box,
            theta=theta,
            norms=(),
            levels=(),
            spans=(),
            substeps=1,
            **channels,
        )
    lags = [sorted(one) for one in fixed.weights]
    weights = [one[lag] for one, own in zip(fixed.weights, lags, strict=True) for lag in own]
    return NARXModel(
        network=NARX(input_delays=lags, output_delays=1, neurons=0),
        theta=np.array([fixed.constant, *weights, fixed.memory]),
        clamp=np.inf,  # its bounds are limits of the whole: a model at its own bound counts as lost
        **channels,
    )


def with_fixed(
    fixed: Sequence[FixedMember], traces: Sequence[Trace], values: Dict[str, float] | None = None
) -> list[Trace]:
    """Traces with what fixed submodels say of their measured channels, as further channels.

    Args:
        fixed: The submodels; they may read each other, in a circle through the past too.
        traces: Measured traces.
        values: Of parameters by name, in their units; by default where they start.

    Returns:
        As many traces, the new channels in the order of the submodels, each in all its instances. A channel that is
        measured stays as it is.

    Raises:
        ConfigError: If the submodels cannot be wired, or an output is measured in another unit than is declared.
        ChannelError: If a trace lacks an input.
    """
    bounds = bounds_of(fixed)

    def one(trace: Trace) -> Trace:
        units = {name: member.unit_in(trace) for member in fixed for name in member.outputs}
        _check_units(trace, {name: unit for name, unit in units.items() if name in trace.channel_names})
        first = [(member, fixed_model(member, trace, units, values)) for member in fixed]
        declared = tuple(placed(member, model, there) for member, model in first for there in member.instances)
        run = Cascade(models=declared, limits=bounds).simulate_trace(trace)
        # What is measured stays as measured: the whole is held against it, and the others are fitted to it.
        new = {name: unit for name, unit in units.items() if name not in trace.channel_names}
        return replace(
            trace,
            channels=(*trace.channels, *(Channel(name=name, unit=unit) for name, unit in new.items())),
            values=np.column_stack([trace.values, *(run[name] for name in new)]),
        )

    return [one(trace) for trace in traces] if fixed else list(traces)


def _check_units(trace: Trace, declared: Dict[str, str]) -> None:
    for name, unit in declared.items():
        measured = trace.channel(name).unit
        if measured != unit:
            raise ConfigError(
                f"the fixed submodel's output {name} is measured in another unit",
                where=f"trace {trace.name}",
                expected=measured,
                got=unit,
                remedy=f"declare unit: {measured} for it, and its weights for that unit",
            )
