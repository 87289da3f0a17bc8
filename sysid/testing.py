"""Slow, obviously right twins of the fast code: what tests, doctests and reports compare with.

Nothing here is compiled, cached or clever; each function is the formula written down.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.kernels.neurons import NEURONS
from sysid.kernels.passages import ELSEWHERE
from sysid.models import Cascade, Ends, GreyBoxModel, History, Limit, Member, NeuralForm, Recursion
from sysid.models.grey_box.equation_reference import MemberTwin


def step(form: Recursion, inputs: NDArray[np.float64], outputs: NDArray[np.float64]) -> float:
    """One step of a recursion in scaled numbers.

    Args:
        form: The recursion.
        inputs: Scaled inputs up to now, newest last, shape ``(depth + 1, n_inputs)``.
        outputs: Scaled outputs before now, newest last, shape ``(depth,)``.

    Returns:
        The scaled output now.
    """
    x = [inputs[-1 - lag, channel] for channel, lags in enumerate(form.lags.inputs) for lag in lags]
    x += [outputs[-lag] for lag in form.lags.output]
    y = form.constant + sum(w * value for w, value in zip(form.linear, x, strict=True))
    value = NEURONS[form.activation].value
    gates = np.zeros_like(form.hidden_weights) if form.gates is None else form.gates
    for weights, bias, readout, gate in zip(form.hidden_weights, form.hidden_bias, form.readout, gates, strict=True):
        gain = readout + sum(w * value for w, value in zip(gate, x, strict=True))
        y += gain * float(value(np.array(bias + sum(w * number for w, number in zip(weights, x, strict=True)))))
    y = min(max(y, form.low), form.high)
    least, most = form.between
    y = y if least is None else max(y, float(form.scaling.scale_output(np.array(least))))
    return float(y if most is None else min(y, float(form.scaling.scale_output(np.array(most)))))


def simulate(form: Recursion, inputs: NDArray[np.float64], history: History) -> NDArray[np.float64]:
    """Free run, one Python step at a time.

    Args:
        form: The recursion.
        inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
        history: The samples before.

    Returns:
        Output of shape ``(n_samples,)``, in its unit.

    Example:
        >>> from sysid.models import ARX, History, Mapping, ARXModel
        >>> orders = ARX(na=1, nb=(1,), nk=(1,))
        >>> model = ARXModel(orders=orders, coefficients=np.array([1.0, 0.5]), intercept=0.0,
        ...     mapping=Mapping.parse("u -> y"), sample_time=1.0, input_units=("V",), output_unit="V", rest_output=0.0)
        >>> simulate(model.recursion, np.ones((3, 1)), History.at_rest(inputs=[0.0], output=0.0)).tolist()
        [0.0, 1.0, 1.5]
    """
    depth = form.lags.depth
    past_inputs, past_output = history.padded(depth)
    u = form.scaling.scale_inputs(np.concatenate([past_inputs, inputs]))
    y = list(form.scaling.scale_output(past_output))
    for t in range(len(inputs)):
        y.append(step(form, u[: depth + t + 1], np.array(y)))
    return np.asarray(form.scaling.unscale_output(np.array(y[depth:])), dtype=np.float64)


def simulate_cascade(cascade: Cascade, inputs: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Free run of a cascade, sample by sample and member by member, with its limits.

    Args:
        cascade: Its members must be recursions over lagged regressors.
        inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.

    Returns:
        Every channel, shape ``(n_samples,)``, in its unit.
    """
    past = {
        name: [level] * 1000 for name, level in zip(cascade.wiring.channels, cascade.levels(inputs[0]), strict=True)
    }
    for now in inputs:
        for name, value in zip(cascade.inputs, now, strict=True):
            past[name].append(float(value))
        for model in cascade.models:
            names = Ends.of(model).outputs
            for name, value in zip(names, _member_step(model, past), strict=True):
                limit = cascade.limits.get(name, Limit())
                low = past[limit.low][-1] if isinstance(limit.low, str) else -np.inf if limit.low is None else limit.low
                high = (
                    past[limit.high][-1]
                    if isinstance(limit.high, str)
                    else np.inf
                    if limit.high is None
                    else limit.high
                )
                past[name].append(float(max(min(value, high), low)))
    return {name: np.array(values[1000:]) for name, values in past.items()}


def _member_step(model: Member, past: dict[str, list[float]]) -> list[float]:
    """Outputs of one member now.

    Its outputs in ``past`` are known up to the sample before, and so are inputs that are computed after it.
    """
    ends = Ends.of(model)
    n_known = len(past[ends.outputs[0]])
    past = {
        name: values + [np.nan] * (n_known + 1 - len(values)) for name, values in past.items() if name in ends.inputs
    } | {name: past[name] for name in ends.outputs}
    columns = model.recursion.columns
    if columns is None:
        raise TypeError(f"{model.mapping} is no recursion over lagged regressors")
    if isinstance(model, GreyBoxModel):
        return [MemberTwin(model, past).value()]
    x = []
    for column, (name, lags) in enumerate(zip((*ends.inputs, *ends.outputs), columns.lags.inputs, strict=True)):
        own = column >= len(ends.inputs)
        x += [(past[name][-lag if own else -1 - lag] - columns.offset[column]) / columns.scale[column] for lag in lags]
    n, r, m = columns.neurons, len(x), len(ends.outputs)
    W, b, V, c, w, gates = np.split(columns.theta, np.cumsum([n * r, n, m * n, m, m * r if columns.linear else 0]))
    h = NEURONS[columns.activation].value(W.reshape(n, r) @ x + b)
    y = V.reshape(m, n) @ h + c
    y = y + w.reshape(m, r) @ x if columns.linear else y
    y = y + h @ (gates.reshape(n, r) @ x) if columns.gated else y
    y = np.clip(y, columns.low, columns.high)
    units = zip(y, columns.scale[-m:], columns.offset[-m:], strict=True)
    return [float(value * scale + offset) for value, scale, offset in units]


def run_neural(form: NeuralForm, inputs: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Free run of a neural state space, one Python step at a time.

    Args:
        form: The model.
        inputs: Scaled inputs, shape ``(n_samples, n_inputs)``.
        x: State before the first sample, shape ``(n_states,)``.

    Returns:
        Scaled outputs of shape ``(n_samples, n_outputs)``.
    """
    s, theta = form.sizes, form.theta
    M, W = theta[s.linear].reshape(s.states, s.row), theta[s.hidden].reshape(s.neurons, s.row)
    V = theta[s.readout].reshape(s.states, s.neurons)
    L, Wy = theta[s.output_linear].reshape(s.outputs, s.row), theta[s.output_hidden].reshape(s.output_neurons, s.row)
    v = theta[s.output_readout].reshape(s.outputs, s.output_neurons)
    activation = NEURONS[form.activation].value

    y = []
    for u in inputs:
        z = np.concatenate([x, u, [1.0]])
        output = L @ z + v @ activation(Wy @ z)
        y.append(np.clip(abs(output) if form.rectified else output, form.low, form.high))
        x = np.clip(M @ z + V @ activation(W @ z), -form.bound, form.bound)
    return np.array(y)


def closest(features: NDArray[np.float64], drawn: NDArray[np.int64], end: int, apart: int) -> int:
    """Twin of :func:`sysid.kernels.passages.closest`.

    Args:
        features: What places are compared by, shape ``(n_rows, n_features)``.
        drawn: The places.
        end: Row after the passage.
        apart: Rows within which a place is passed over.

    Returns:
        The place.
    """
    away = np.sum((features[drawn] - features[min(end, len(features) - 1)]) ** 2, axis=1)
    return int(drawn[np.argmin(away + ELSEWHERE * (np.abs(drawn - end) < apart))])


def joined(
    rows: NDArray[np.float64], passages: Sequence[tuple[int, float, float, int, bool]], over: int
) -> NDArray[np.float64]:
    """Twin of :func:`sysid.kernels.passages.joined`.

    Args:
        rows: The records, one below the other.
        passages: Of each its first row, how many rows it goes over, the rows between its samples, their number, and
            whether it is led over from the one before.
        over: Samples over which.

    Returns:
        All passages together.
    """
    parts: list[NDArray[np.float64]] = []
    for at, span, step, count, led in passages:
        where = np.minimum(np.arange(count) * step, span)
        where[-1] = span
        below = np.minimum((where + at).astype(np.int64), len(rows) - 2)
        share = (where + at - below)[:, None]
        part = (1.0 - share) * rows[below] + share * rows[below + 1]
        if led:
            part = part + np.clip(1.0 - np.arange(count) / over, 0.0, 1.0)[:, None] * (parts[-1][-1] - part[0])
        parts.append(part)
    return np.clip(np.concatenate(parts), rows.min(axis=0), rows.max(axis=0))


def finite_difference_jacobian(
    function: Callable[[NDArray[np.float64]], NDArray[np.float64]], theta: NDArray[np.float64], width: float = 1e-6
) -> NDArray[np.float64]:
    """Jacobian by central differences.

    Args:
        function: From parameters to a vector.
        theta: Where, shape ``(n_parameters,)``.
        width: Half the distance between the two evaluations.

    Returns:
        Shape ``(n_values, n_parameters)``; errors of order ``width**2``.

    Example:
        >>> finite_difference_jacobian(lambda x: x**2, np.array([1.0, 2.0])).round(6).tolist()
        [[2.0, 0.0], [0.0, 4.0]]
    """
    columns = []
    for i in range(len(theta)):
        away = np.zeros(len(theta))
        away[i] = width
        columns.append((function(theta + away) - function(theta - away)) / (2.0 * width))
    return np.column_stack(columns)


def first_order_record() -> Path:
    """A file to try things on: 100 s of ``y[n] = 0.9 y[n-1] + 0.2 u[n-1]`` under a random square wave, every 0.5 s.

    Returns:
        A CSV file in a new temporary folder, columns ``t [s]``, ``u [V]``, ``y [V]``.
    """
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], 20), 10)
    y = np.full(200, 2.0 * u[0])  # at rest
    for n in range(1, 200):
        y[n] = 0.9 * y[n - 1] + 0.2 * u[n - 1]
    file = Path(tempfile.mkdtemp()) / "record.csv"
    rows = np.column_stack([0.5 * np.arange(200), u, y])
    np.savetxt(file, rows, delimiter=",", header="t [s],u [V],y [V]", comments="", fmt="%.17g")
    return file
