"""Step responses, Bode diagrams and poles of linear models, computed with their 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from sysid.errors import ConfigError
from sysid.estimation.estimators import estimator_of
from sysid.estimation.linear.modes import Mode, modes
from sysid.models import AbstractModel
from sysid.models.converting.to_control import Linear
from sysid.models.orders.intersample import HELD
from sysid.reporting.linear.responses import Bode, Known, Matrix, Poles, StepResponse
from sysid.reporting.linear.step_responses import (
    band,
    gains,
    settling,
    step_response,
    step_responses,
)
from sysid.reporting.linear_views import LinearView, linear_views

if TYPE_CHECKING:
    from sysid.models import TransferFunctionModel


def poles_of(known: Known) -> Poles:
    """The poles of linear models.

    Args:
        known: The models.

    Returns:
        They, with intervals where there is an uncertainty.

    Raises:
        ConfigError: If a model is not linear.
    """
    check_linear(known)
    found = [replace(mode, of=_whose(model, mode, known)) for model, sure in known for mode in modes(model, sure)]
    pairs = [(model, view) for model, sure in known for view in linear_views(model, sure)]
    views = [replace(view, name=name) for (_, view), name in zip(pairs, _names(pairs)["names"], strict=True)]
    return Poles(modes=tuple(found), views=tuple(views))


def _whose(model: AbstractModel, mode: Mode, known: Known) -> str:
    """What a pole belongs to: of models side by side, their outputs too."""
    outputs = ", ".join(model.mapping.outputs) if len(known) > 1 else ""
    return " from ".join(filter(None, (outputs, mode.of)))


def step_of(known: Known, *, samples: int | None = None) -> StepResponse:
    """Step responses of linear models, from every input to every output.

    Args:
        known: The models, with one sample time.
        samples: Length; by default until the slowest pole has settled, 20,000 at most.

    Returns:
        The responses.

    Raises:
        ConfigError: If a model is not linear, or no input moves any.
    """
    pairs = _views(known)
    n = samples or max(settling(view) for _, view in pairs)
    values, ends, found = [], [], []
    for model, view in pairs:
        A, B, C, D = _stepped(model, view).matrices
        at, of = slice(view.source, view.source + 1), slice(view.target, view.target + 1)
        y = step_response(A, B[:, at], C[of], D[of, at], n)
        values.append(y)
        drawn = step_responses(view, n)
        ends.append(band(drawn) if len(drawn) else np.full((2, n), np.nan))
        found.append(gains(view))
    low, high = (np.column_stack([one[side] for one in ends]) for side in (0, 1))
    time = known[0][0].sample_time * np.arange(n, dtype=np.float64)
    return StepResponse(
        **_names(pairs), time=time, values=np.column_stack(values), low=low, high=high,
        **dict(zip(("gain", "gain_low", "gain_high"), np.array(found).T, strict=True)),
    )  # fmt: skip


def _stepped(model: AbstractModel, view: LinearView) -> Linear:
    """The model of a step, which stands between samples, whatever the inputs of its records do there."""
    if not view.discrete:
        transfer = cast("TransferFunctionModel", model)
        return replace(transfer, orders=replace(transfer.orders, intersample=HELD))
    return cast("Linear", model)


def bode_of(known: Known, *, frequency: Any = None, points: int = 200) -> Bode:
    """Frequency responses of linear models, from every input to every output.

    Args:
        known: The models, with one sample time.
        frequency: In rad/s; by default four decades up to the Nyquist frequency.
        points: How many by default.

    Returns:
        The responses.

    Raises:
        ConfigError: If a model is not linear, no input moves any, or a frequency is none.
    """
    pairs = _views(known)
    nyquist = np.pi / known[0][0].sample_time
    w = nyquist * np.logspace(-4.0, 0.0, points) if frequency is None else _frequencies(frequency)
    columns, unwrapped, gains, phases = [], [], [], []
    for _, view in pairs:
        with np.errstate(divide="ignore", invalid="ignore"):  # of an integrator at 0 rad/s
            responses = view.responses(w)
        shown, drawn = responses[0], responses[1:]
        columns.append(shown)
        none = np.full((2, len(w)), np.nan)
        gains.append(band(np.abs(drawn)) if len(drawn) else none)
        unwrapped.append(phase := view.phase(w))
        # By the angle between them: of what is 0 throughout no quotient is a number.
        turned = drawn * np.exp(-1j * np.angle(shown))
        phases.append(np.degrees(band(phase + np.angle(turned))) if len(drawn) else none)
    bands = {"gain": gains, "phase": phases}
    ends: dict[str, Any] = {
        f"{name}_{end}": np.column_stack([one[side] for one in found])
        for name, found in bands.items()
        for side, end in enumerate(("low", "high"))
    }
    phase = np.degrees(np.column_stack(unwrapped))
    return Bode(**_names(pairs), frequency=w, values=np.column_stack(columns), phase=phase, **ends)


def _frequencies(given: Any) -> Matrix:
    try:
        w = np.atleast_1d(np.asarray(given, dtype=np.float64))
    except (TypeError, ValueError):
        w = np.empty(0)
    if w.ndim != 1 or not len(w) or not np.isfinite(w).all() or (w < 0.0).any():
        raise ConfigError(
            "not frequencies",
            where="frequency",
            expected="finite numbers in rad/s, 0 or more",
            got=type(given).__name__,
            remedy="give an array such as np.logspace(-2, 1); hertz times 2 pi are rad/s",
        )
    return w


def check_linear(known: Known) -> None:
    """Refuse what has no transfer function."""
    for model, _ in known:
        if not estimator_of(model.structure).linear:
            raise ConfigError(
                "a model that is not linear has no step response, Bode diagram or poles of its own",
                where=str(model.mapping),
                expected="ARX, VectorARX, TF, OE, ARMAX, BJ, SS",
                got=model.structure.label,
                remedy="simulate the step that is meant, from the level where it happens; or fit a linear structure",
            )


def _views(known: Known) -> list[tuple[AbstractModel, LinearView]]:
    check_linear(known)
    pairs = [(model, view) for model, known_by in known for view in linear_views(model, known_by, 0)]
    if not pairs:
        raise ConfigError(
            "there is no input to respond to",
            where=", ".join(str(model.mapping) for model, _ in known),
            expected="a model with an input that moves it",
            remedy="print its poles",
        )
    return pairs


def _names(pairs: Sequence[tuple[AbstractModel, LinearView]]) -> dict[str, Any]:
    ends = [(model.ends, view) for model, view in pairs]
    outputs = tuple(end.outputs[view.target] for end, view in ends)
    inputs = tuple(end.inputs[view.source] for end, view in ends)
    several = len(set(outputs)) > 1
    return {
        "names": tuple(f"{y} from {u}" if several else u for y, u in zip(outputs, inputs, strict=True)),
        "inputs": inputs,
        "outputs": outputs,
        "units": tuple((end.output_units[view.target], view.unit) for end, view in ends),
    }
