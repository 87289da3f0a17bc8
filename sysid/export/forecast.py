"""What is to be expected after measured samples, by a bundle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.export.measured_run import matrix_of
from sysid.models import AbstractModel, Cascade, History
from sysid.traces import Trace

if TYPE_CHECKING:
    Array = NDArray[np.float64]


def check_forecasts(model: AbstractModel | Cascade) -> tuple[AbstractModel, ...]:
    """The models that go on from what was measured, each by itself.

    Args:
        model: Of a bundle.

    Returns:
        The models, one an output, or one of all.

    Raises:
        ConfigError: If one reads what another computes, whose own past was not measured.
    """
    if isinstance(model, AbstractModel):
        return (model,)
    computed = {name for one in model.models for name in one.mapping.outputs}
    reading = [one for one in model.models if computed & set(one.mapping.inputs)]
    if reading or model.limits:
        raise ConfigError(
            "a whole of models that read each other, or with limits, has no forecast",
            where=", ".join(str(one.mapping) for one in reading) or "limits",
            expected="one model, or one an output that reads inputs alone",
            got=f"{len(model.models)} models",
            remedy="sysid simulate begins by the measured outputs, without what is known of the noise",
        )
    return tuple(model.models)


def check_follows(past: Trace, to_come: Trace, *, apart: float | None = None) -> None:
    """Refuse inputs to come that do not begin one sample after the samples before, where their stamps say so.

    Args:
        past: The samples before.
        to_come: The inputs to come; where their time begins at 0 it is of its own, and says nothing.
        apart: Seconds from second 0 of the samples before to that of the inputs, where dates tell; else ``None``.

    Raises:
        TraceError: If their stamps leave samples out, or come again.
    """
    begins, due = to_come.start_time + (apart or 0.0), past.time[-1] + past.sample_time
    if (apart is None and to_come.start_time == 0.0) or abs(begins - due) <= 0.5 * past.sample_time:
        return
    raise TraceError(
        "the inputs to come do not follow the samples before",
        where=to_come.name,
        expected=f"a first sample at {due:.10g} s of {past.name}, one sample after its last",
        got=f"{begins:.10g} s",
        remedy="cut or fill the files so that one follows the other; stamps that begin at 0 are taken to follow",
    )


def forecast(
    models: Sequence[AbstractModel], outputs: Sequence[str], before: dict[str, Array], inputs: dict[str, Array]
) -> Array:
    """Outputs to come.

    Args:
        models: From :func:`check_forecasts`.
        outputs: In which order.
        before: The samples before, oldest first, by channel.
        inputs: Inputs to come, by channel.

    Returns:
        Shape ``(n_samples, n_outputs)``.
    """
    n, past = (len(next(iter(one.values()))) for one in (inputs, before))
    found: dict[str, Array] = {}
    for model in models:
        read, names = model.mapping.inputs, model.mapping.outputs
        output = np.column_stack([before[name] for name in names])
        output = output if model.structure.several_outputs else output[:, 0]
        history = History(inputs=matrix_of(before, read, past), output=output)
        run = model.forecast(matrix_of(inputs, read, n), history).reshape(n, -1)
        found |= dict(zip(names, run.T, strict=True))
    return np.column_stack([found[name] for name in outputs])
