"""A whole that sees one of its channels a little off: where its answer parts from what it was, that channel decides.

A surrogate with a switch is right or wrong by tiny differences: a valve that is about to release does so now, or half
a minute later. Another surrogate need not differ there, but the surrogate itself does, as soon as what its switch
compares is moved by as much as it is usually wrong. Two of them, moved up and down, are the others of a
:func:`sysid.composite.committee` that doubts where its first member hangs by a thread.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from sysid.composite.doubt.committee import renamed
from sysid.errors import ChannelError, ConfigError
from sysid.models import NARX, AbstractModel, Cascade, Mapping, NARXModel, Scaling
from sysid.models.channels.ends import Ends

SEEN = "_seen"
"""Behind the name of a channel: what its readers see of it."""


def perturbed(
    whole: Cascade | AbstractModel, channel: str, by: float, *, readers: Collection[str] | None = None
) -> Cascade:
    """The same whole, in which a channel is read with an error that stays.

    Args:
        whole: The whole.
        channel: An input, or an output that other members read.
        by: What is added to what they read, in its unit: about as much as the channel is usually wrong.
        readers: Outputs of the members that read it so; all that read it but its own writer by default. For a switch,
            name the switch.

    Returns:
        The whole, with one channel more.

    Raises:
        ConfigError: If ``by`` is 0 or not finite, or nobody reads the channel.
        ChannelError: If a reader is no output of the whole.

    Example:
        >>> from sysid.models import ARX, ARXModel
        >>> lag = ARXModel(orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([0.5, 0.5]), intercept=0.0,
        ...     mapping=Mapping.parse("u -> y"), sample_time=1.0, input_units=("V",), output_unit="V", rest_output=0.0)
        >>> perturbed(lag, "u", 0.1).simulate(np.array([[1.0], [1.0]]))["y"].round(3).tolist()
        [0.55, 0.825]
    """
    cascade = whole if isinstance(whole, Cascade) else Cascade(models=(whole,))
    if readers is not None and (strangers := sorted(set(readers) - set(cascade.outputs))):
        raise ChannelError(strangers, cascade.outputs, where="readers")
    reading = [
        channel in end.inputs
        and channel not in end.outputs
        and (readers is None or bool(set(end.outputs) & set(readers)))
        for end in map(Ends.of, cascade.models)
    ]
    if not any(reading) or not 0.0 < abs(by) < np.inf:
        raise ConfigError(
            "nothing is perturbed",
            where="perturbed",
            expected="a channel that a member reads, and what is added to it: a finite number other than 0",
            got=f"{channel} by {by:g}, read by {', '.join(readers) if readers else 'all'}",
            remedy="name a channel of the whole, and outputs of members that read it",
        )
    seen = channel + SEEN
    while seen in cascade.wiring.channels:
        seen += "_"
    models = [renamed(one, {channel: seen}) if yes else one for one, yes in zip(cascade.models, reading, strict=True)]
    own = {
        name: level
        for end in map(Ends.of, cascade.models)
        for name, level in zip(end.outputs, end.rest_outputs, strict=True)
    }
    level = cascade.rest.get(channel, own.get(channel, channel))  # an input rests at its own first sample
    added = NARXModel(
        network=NARX(input_delays=[[0]], output_delays=1, neurons=0),
        theta=np.array([by, 1.0, 0.0]),
        scaling=Scaling.identity(1),
        mapping=Mapping(inputs=(channel,), output=seen),
        sample_time=cascade.sample_time,
        input_units=(cascade.units[channel],),
        output_unit=cascade.units[channel],
        rest_output=0.0,
        clamp=np.inf,
    )
    rest = {**cascade.rest, seen: level if isinstance(level, str) else level + by}
    return Cascade(models=(*models, added), rest=rest, limits=cascade.limits)
