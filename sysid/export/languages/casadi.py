"""CasADi: a step as an expression whose derivatives are exact, for model predictive and optimal control."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Run, Runner, given, step_by_step
from sysid.export.flags import Flag
from sysid.export.forms.programs import INPUT, STATE, Listing, ProgramForm
from sysid.export.forms.stage import Side, Stage
from sysid.export.forms.state_space import Neurons, StateSpaceForm
from sysid.export.surrogate import Surrogate

FILE = "step.casadi"


class CasadiExporter(AbstractExporter):
    """Writes ``step.casadi``: a function ``(u, state) -> (y, state_out, flags)`` of columns."""

    name = "casadi"
    packages: ClassVar[tuple[str, ...]] = ("casadi",)

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Write the function in CasADi's own format."""
        step_function(surrogate).save(str(folder / FILE))
        details = {"casadi": version("casadi"), "function": "step"}
        return (ExportedFile(name=FILE, format=self.name, kind=Kind.STEP, details=details),)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Load the function; cars are columns."""
        self.check()
        import casadi

        step = casadi.Function.load(str(folder / file.name))

        def run(inputs: NDArray[Any], state: NDArray[Any] | None) -> Run:
            y, after, flags = (value.full() for value in step(inputs.T, given(state).T))
            return Run(output=y.T, state=after.T, flags=flags[0].astype(np.int32))

        return step_by_step(run)


def step_function(surrogate: Surrogate) -> Any:
    """One step as a CasADi function of scalars.

    Args:
        surrogate: What is written.

    Returns:
        The ``casadi.Function`` from inputs in their units and the state to outputs in their units, the next state and
        the flags; where a limit holds, derivatives are those of the limit.
    """
    import casadi

    u, state = casadi.SX.sym("u", len(surrogate.inputs)), casadi.SX.sym("state", surrogate.state_size)
    step = _Step(surrogate, casadi.vertsplit(u), casadi.vertsplit(state) if surrogate.state_size else [])
    for stage in surrogate.stages:
        step.add(stage)
    for late in surrogate.late:
        step.after[late.place] = (step.known[late.column] - late.offset) / late.scale
    y = casadi.vertcat(*(step.known[column] for column in surrogate.columns))
    after = casadi.vertcat(*step.after) if step.after else casadi.SX(0, 1)
    return casadi.Function("step", [u, state], [y, after, step.flags()], ["u", "state"], ["y", "state_out", "flags"])


class _Step:
    """A step under construction: scalar expressions.

    Args:
        surrogate: What is written.
        u: The inputs in units.
        state: The state.
    """

    def __init__(self, surrogate: Surrogate, u: Sequence[Any], state: Sequence[Any]) -> None:
        self.surrogate, self.state, self.given = surrogate, list(state), list(u)
        self.known: list[Any] = [one + _lost(one) for one in u]
        self.after: list[Any] = []
        self.raised: dict[Flag, list[Any]] = {flag: [] for flag in Flag}

    def add(self, stage: Stage) -> None:
        """Add a stage: what it computes, and its state."""
        form, n = stage.form, stage.form.n_inputs
        scaled = [(self.known[source] - form.offset[i]) / form.scale[i] for i, source in enumerate(stage.known_sources)]
        past = self.state[stage.first : stage.first + stage.state.size]
        kinds = {StateSpaceForm: _space, ProgramForm: _equations}
        outputs, following = kinds.get(type(form), _lagged)(stage, scaled, past)
        for j, output in enumerate(outputs):
            bounded = _within(output, form.low, form.high)
            value = bounded * form.scale[n + j] + form.offset[n + j]
            held, reached = self._limited(value, stage.limits[j])
            if stage.limits[j]:
                beyond = held != value
                outputs[j] = _choice(beyond, (held - form.offset[n + j]) / form.scale[n + j], bounded)
                if stage.told[j]:
                    self.raised[Flag.IN_DOUBT if stage.doubts[j] else Flag.AT_LIMIT].append(reached)
            else:
                outputs[j] = bounded
            for bound in (form.low, form.high):
                if np.isfinite(bound):
                    self.raised[Flag.AT_BOUND].append((bounded == bound) * (1 - reached))
            self.known.append(held)
        self.after += following(outputs)

    def _limited(self, value: Any, sides: Sequence[Side]) -> tuple[Any, Any]:
        """A value within its declared limits, and whether it is at one."""
        limits = []
        for side in sides:
            limit = side.value if side.column is None else self.known[side.column]
            value = _choice(value > limit if side.upper else value < limit, limit, value)
            limits.append(limit)
        reached: Any = 0
        for limit in limits:
            reached = _choice(value == limit, 1, reached)
        return value, reached

    def flags(self) -> Any:
        """The sum of the bits that are raised."""
        for port, value in zip(self.surrogate.inputs, self.given, strict=True):
            if port.range is not None:
                self.raised[Flag.OUTSIDE_RANGE] += [value < port.low, value > port.high]
        self.raised[Flag.NOT_A_NUMBER] = [_choice(value <= np.inf, 0, 1) for value in self.known]
        total: Any = 0
        for flag, causes in self.raised.items():
            any_of: Any = 0
            for cause in causes:
                any_of = _choice(cause, 1, any_of)
            total += int(flag) * any_of
        return total


def _choice(condition: Any, one: Any, other: Any) -> Any:
    import casadi

    return casadi.if_else(condition, one, other)


def _lost(value: Any) -> Any:
    """Nothing, but not a number where a value is infinite or none."""
    import casadi

    return _choice(casadi.fabs(value) < np.inf, 0, np.nan)


def _product(table: NDArray[np.float64], x: Any) -> Any:
    """A matrix times a column; CasADi leaves out what is times zero, which loses what is not a number."""
    import casadi

    left_out = np.asarray(table) == 0.0
    total = casadi.mtimes(table, x)
    if not left_out.any():
        return total
    lost = [_lost(one) if own.any() else 0.0 for own, one in zip(left_out.T, casadi.vertsplit(x), strict=True)]
    return total + casadi.vertcat(*(sum(one for one, out in zip(lost, row, strict=True) if out) for row in left_out))


def _within(value: Any, low: float, high: float) -> Any:
    """NaN stays NaN, as in the model."""
    value = value if not np.isfinite(low) else _choice(value < low, low, value)
    return value if not np.isfinite(high) else _choice(value > high, high, value)


def _active(stage: Stage, sums: Any) -> Any:
    with warnings.catch_warnings():  # CasADi says that numpy's functions of its values may be others one day
        warnings.simplefilter("ignore", FutureWarning)
        return stage.neuron.value(sums)


def _lagged(stage: Stage, scaled: Sequence[Any], past: Sequence[Any]) -> tuple[list[Any], Any]:
    """Outputs of a model over lagged regressors, and what makes its next state of them."""
    import casadi

    form, layout = stage.lagged
    known = [*scaled, *past]
    x = casadi.vertcat(*(known[layout.column(channel, lag)] for channel, own in enumerate(form.lags) for lag in own))
    total = _product(form.linear, x) + form.constant if x.numel() else casadi.SX(form.constant)
    if form.neurons:
        hidden = _active(stage, _product(form.hidden_weights, x) + form.hidden_bias)
        readout = form.readout
        if form.gated:
            hidden, readout = hidden * (_product(form.gates, x) + form.readout[0]), np.ones_like(form.readout)
        total += _product(readout, hidden)

    def following(outputs: Sequence[Any]) -> list[Any]:
        together = [*scaled, *outputs, *past]
        return [together[column] for column in layout.next_columns()]

    return casadi.vertsplit(total), following


def _space(stage: Stage, scaled: Sequence[Any], past: Sequence[Any]) -> tuple[list[Any], Any]:
    """Outputs of a state space, and its next state, which hangs on no output."""
    import casadi

    form = stage.state_space
    z = casadi.vertcat(*past, *scaled)

    def summed(table: NDArray[np.float64], constant: NDArray[np.float64], neurons: Neurons) -> Any:
        total = _product(table, z) + constant
        if len(neurons):
            hidden = _active(stage, _product(neurons.weights, z) + neurons.bias)
            total += _product(neurons.readout, hidden)
        return total

    outputs = casadi.vertsplit(summed(form.readout, form.constant, form.output_neurons))
    outputs = [_choice(one < 0, -one, one) for one in outputs] if form.rectified else outputs
    following: list[Any] = []
    if form.n_state:
        change = casadi.vertsplit(summed(form.change, form.drift, form.state_neurons))
        following = [_within(one + moved, -form.bound, form.bound) for one, moved in zip(past, change, strict=True)]
    return outputs, lambda _: following


def _equations(stage: Stage, scaled: Sequence[Any], past: Sequence[Any]) -> tuple[list[Any], Any]:
    """Outputs of equations, and their next state, which hangs on no output."""
    import casadi

    form, layout = stage.equations
    known, n, n_c = [*scaled, *past], form.n_state, form.n_continuous

    def sample(channel: int, lag: int) -> Any:
        return known[form.n_inputs + layout.lines[channel].column(lag)] if lag else scaled[channel]

    u = [sum(sample(channel, lag) * weight for channel, lag, weight in parts) for parts in form.given]
    x = list(past[:n])
    total = sum(x) if x else 0
    lost = _choice(total < np.inf, _choice(total > -np.inf, 0, np.nan), np.nan)  # by a state that is no number
    updates = _listed(form.updates, x, u)
    now = x[:n_c]
    for part in range(form.substeps if n_c else 0):
        at, moved = now, [0.0] * n_c
        for share, ahead, behind in form.stages:
            slope = _listed(form.slopes, [*at, *x[n_c:]], [*u, casadi.SX((part + behind) / form.substeps)])
            moved = [one + share * form.step * own for one, own in zip(moved, slope, strict=True)]
            at = [one + ahead * own for one, own in zip(now, slope, strict=True)]
        now = [one + own for one, own in zip(now, moved, strict=True)]
    after = [one + lost for one in (*now, *updates)]
    outputs = [one + lost for one in _listed(form.outputs, after if form.ahead else x, u)]
    following = after + [known[column] for column in layout.next_columns()]
    return outputs, lambda _: following


def _listed(listing: Listing, x: Sequence[Any], u: Sequence[Any]) -> list[Any]:
    """The results of a listing."""
    import casadi

    values: list[Any] = []
    given = {STATE: x, INPUT: u}

    def read(one: Any) -> Any:
        return casadi.SX(one) if isinstance(one, float) else given.get(one.kind, values)[one.at]

    for one in listing.instructions:
        points = (one.points,) if one.points else ()
        values.append(one.operation.casadi(casadi, *map(read, one.reads), *points))
    return [read(one) for one in listing.results]
