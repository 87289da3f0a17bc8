"""The mean of several cascades, as one: what each start of a training got wrong in its own way, it does not.

They stand side by side, each with channels of its own, and read the same inputs. So the mean is run, exported and taken
apart like any other cascade; it costs as much time as all of them.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from collections.abc import Mapping as Dict
from dataclasses import replace

import numpy as np

from sysid.models.arx import ARX, ARXModel
from sysid.models.cascade import Cascade
from sysid.models.cascade_program import Limit
from sysid.models.mapping import Mapping
from sysid.models.vector_narx import VectorNARXModel
from sysid.models.wiring import Member


def mean_of(cascades: Sequence[Cascade], outputs: Collection[str]) -> Cascade:
    """Several cascades side by side, with the means of what they put out.

    Args:
        cascades: The cascades, of one sample time.
        outputs: Outputs that all of them have, and whose means are wanted.

    Returns:
        A cascade with these outputs, and beside them what the means are of: ``BP_1``, ``BP_2`` and so on. A single
        cascade as it is.

    Raises:
        ChannelError: If one lacks an output.
        ConfigError: If they cannot stand side by side: other units, other sample times.

    Example:
        >>> from sysid.models import ARX, ARXModel
        >>> def gain(value: float) -> Cascade:
        ...     return Cascade(models=(ARXModel(orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([value, 0.0]),
        ...         intercept=0.0, mapping=Mapping.parse("u -> y"), sample_time=0.1, input_units=("V",),
        ...         output_unit="V", rest_output=0.0),))
        >>> mean = mean_of([gain(1.0), gain(3.0)], ["y"])
        >>> mean.outputs, mean.simulate(np.array([[0.0], [1.0]]))["y"].tolist()
        (('y_1', 'y_2', 'y'), [0.0, 2.0])
    """
    for name in outputs:
        for cascade in cascades:
            cascade.member(name)
    if len(cascades) == 1:
        return cascades[0]
    mark = _mark(cascades)
    apart = [_apart(cascade, f"{mark}{number}") for number, cascade in enumerate(cascades, start=1)]
    means = [_mean(cascades, name, mark) for name in cascades[0].outputs if name in outputs]
    return Cascade(
        models=(*(model for one in apart for model in one.models), *means),
        rest={name: level for one in apart for name, level in one.rest.items()},
        limits={name: limit for one in apart for name, limit in one.limits.items()},
    )


def _mark(cascades: Sequence[Cascade]) -> str:
    """What stands between a channel's name and the number of its cascade, so that no two channels have one name."""
    taken = {name for one in cascades for name in (*one.inputs, *one.outputs)}
    mark = "_"
    while any(f"{name}{mark}{number + 1}" in taken for name in taken for number in range(len(cascades))):
        mark += "_"
    return mark


def _apart(cascade: Cascade, suffix: str) -> Cascade:
    """The same cascade with a suffix behind all that it writes."""
    own = {name: f"{name}{suffix}" for name in cascade.outputs}
    return Cascade(
        models=tuple(_renamed(model, own) for model in cascade.models),
        rest={own.get(name, name): level for name, level in cascade.rest.items()},
        limits={
            own[name]: Limit(low=_side(limit.low, own), high=_side(limit.high, own))
            for name, limit in cascade.limits.items()
        },
    )


def _renamed(model: Member, own: Dict[str, str]) -> Member:
    inputs = tuple(own.get(name, name) for name in model.mapping.inputs)
    if isinstance(model, VectorNARXModel):
        outputs = tuple(own[name] for name in model.mapping.outputs)
        return replace(model, mapping=replace(model.mapping, inputs=inputs, outputs=outputs))
    mapping = replace(model.mapping, inputs=inputs, output=own[model.mapping.output])
    return replace(model, mapping=mapping)  # type: ignore[type-var]  # every model is a dataclass


def _side(limit: float | str | None, own: Dict[str, str]) -> float | str | None:
    return own.get(limit, limit) if isinstance(limit, str) else limit


def _mean(cascades: Sequence[Cascade], name: str, mark: str) -> ARXModel:
    """The mean of one output: a sum of that sample, without a past."""
    count, unit = len(cascades), cascades[0].units[name]
    return ARXModel(
        orders=ARX(na=0, nb=(1,) * count, nk=(0,) * count),
        coefficients=np.full(count, 1.0 / count),
        intercept=0.0,
        mapping=Mapping(inputs=tuple(f"{name}{mark}{number + 1}" for number in range(count)), output=name),
        sample_time=cascades[0].sample_time,
        input_units=(unit,) * count,
        output_unit=unit,
        rest_output=0.0,
    )
