"""JAX: a step and a free run as pure functions with exact derivatives, and the step as a StableHLO file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Run, Runner, given, step_by_step
from sysid.export.flags import Flag
from sysid.export.forms.programs import INPUT, STATE, Listing, ProgramForm
from sysid.export.forms.stage import Side, Stage
from sysid.export.forms.state_space import Neurons, StateSpaceForm
from sysid.export.surrogate import Surrogate
from sysid.extras import need
from sysid.models import AbstractModel, Cascade

FILE = "step.jax"
PLATFORMS = ("cpu", "cuda", "rocm", "tpu")
"""What the file is lowered for: the same text for all of them."""

Step = Callable[[Any, Any], tuple[Any, Any, Any]]
"""From inputs and state to outputs, the state after and flags."""


class JaxExporter(AbstractExporter):
    """Writes ``step.jax``: ``(u, state) -> (y, state_out, flags)`` of any number of cars, with its derivative."""

    name = "jax"
    packages: ClassVar[tuple[str, ...]] = ("jax",)

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Write the function by ``jax.export``: StableHLO, which JAX keeps readable for years."""
        import jax
        from jax import export

        with jax.enable_x64(True), _without_places():
            (cars,) = export.symbolic_shape("cars")
            shapes = [
                jax.ShapeDtypeStruct((cars, length), np.float64)
                for length in (len(surrogate.inputs), surrogate.state_size)
            ]
            function = jax.jit(jax.vmap(jax_step(surrogate)))
            exported = export.export(function, platforms=PLATFORMS)(*shapes)
            (folder / FILE).write_bytes(bytes(exported.serialize(vjp_order=1)))
        details = {"jax": version("jax"), "platforms": list(PLATFORMS)}
        return (ExportedFile(name=FILE, format=self.name, kind=Kind.STEP, details=details),)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Load the function; it is compiled once for a number of cars."""
        self.check()
        import jax
        from jax import export

        step = jax.jit(export.deserialize(bytearray((folder / file.name).read_bytes())).call)

        def run(inputs: NDArray[Any], state: NDArray[Any] | None) -> Run:
            with jax.enable_x64(True):
                y, after, flags = (np.asarray(value) for value in step(inputs, given(state)))
            return Run(output=y, state=after, flags=flags)

        return step_by_step(run)


def jax_step(source: AbstractModel | Cascade | Surrogate) -> Step:
    """One step as a pure function, for ``jax.jit``, ``jax.grad``, ``jax.vmap`` and loops of your own.

    Args:
        source: A model, a cascade, or a surrogate with declared ranges.

    Returns:
        ``step(u, state) -> (y, state_out, flags)``: ``u`` of shape ``(n_inputs,)`` and ``y`` of ``(n_outputs,)`` in
        their units, ``state`` of shape ``(n_state,)`` as :meth:`sysid.export.Surrogate.at_rest` gives it, ``flags`` a
        whole number (:class:`sysid.export.Flag`). Where a limit or bound holds an output, its derivatives are those
        of the limit.

    Raises:
        MissingExtraError: If JAX is not installed.
        ConfigError: If the model cannot be exported; when the function is called, if JAX computes in float32.
    """
    need("jax", "a model as functions of JAX")
    surrogate = _surrogate(source)

    def step(u: Any, state: Any) -> tuple[Any, Any, Any]:
        import jax
        import jax.numpy as jnp

        if not jax.config.jax_enable_x64:
            raise ConfigError(
                "JAX computes in float32, in which a long free run loses the model",
                expected="float64",
                got="jax_enable_x64 = False",
                remedy='call jax.config.update("jax_enable_x64", True) first',
            )
        u, state = jnp.asarray(u, dtype=np.float64), jnp.asarray(state, dtype=np.float64)
        one = _Step(surrogate, [u[i] for i in range(len(surrogate.inputs))], state)
        for stage in surrogate.stages:
            one.add(stage)
        after = jnp.concatenate(one.after)
        for late in surrogate.late:
            after = after.at[late.place].set((one.known[late.column] - late.offset) / late.scale)
        return jnp.stack([one.known[column] for column in surrogate.columns]), after, one.flags()

    return step


def jax_run(source: AbstractModel | Cascade | Surrogate) -> Step:
    """A free run as a pure function: :func:`jax_step` in ``jax.lax.scan``.

    Args:
        source: As for :func:`jax_step`.

    Returns:
        ``run(u, state) -> (y, state_out, flags)``: ``u`` of shape ``(n_samples, n_inputs)``, ``y`` of
        ``(n_samples, n_outputs)``, ``flags`` of ``(n_samples,)``; the state is that of :func:`jax_step`.

    Raises:
        MissingExtraError: If JAX is not installed.
        ConfigError: As for :func:`jax_step`.
    """
    step = jax_step(source)

    def run(u: Any, state: Any) -> tuple[Any, Any, Any]:
        import jax
        import jax.numpy as jnp

        def sample(state: Any, u: Any) -> tuple[Any, tuple[Any, Any]]:
            y, state, flags = step(u, state)
            return state, (y, flags)

        after, (y, flags) = jax.lax.scan(sample, jnp.asarray(state, dtype=np.float64), jnp.asarray(u))
        return y, after, flags

    return run


@contextmanager
def _without_places() -> Iterator[None]:
    """No lines of source code in what is lowered: they differ from one machine to another, and the file would too."""
    import jax

    before = jax.config.jax_traceback_in_locations_limit
    jax.config.update("jax_traceback_in_locations_limit", 0)
    try:
        yield
    finally:
        jax.config.update("jax_traceback_in_locations_limit", before)


def _surrogate(source: AbstractModel | Cascade | Surrogate) -> Surrogate:
    return source if isinstance(source, Surrogate) else Surrogate.of(source)


class _Step:
    """A step under construction.

    Args:
        surrogate: What is written.
        u: The inputs in units, scalars.
        state: The state, shape ``(n_state,)``.
    """

    def __init__(self, surrogate: Surrogate, u: Sequence[Any], state: Any) -> None:
        import jax.numpy as jnp

        self.surrogate, self.state, self.given = surrogate, state, list(u)
        self.known: list[Any] = [jnp.where(jnp.isinf(one), np.nan, one) for one in u]
        self.after: list[Any] = []
        self.raised: dict[Flag, list[Any]] = {flag: [] for flag in Flag}

    def add(self, stage: Stage) -> None:
        """Add a stage: what it computes, and its state."""
        import jax.numpy as jnp

        form, n = stage.form, stage.form.n_inputs
        offset, scale = np.array(form.offset), np.array(form.scale)
        past = self.state[stage.first : stage.first + stage.state.size]
        sources = [self.known[source] for source in stage.known_sources]
        scaled = (jnp.stack(sources) - offset[:n]) / scale[:n] if n else jnp.zeros(0)
        kinds = {StateSpaceForm: _space, ProgramForm: _equations}
        computed, following = kinds.get(type(form), _lagged)(stage, scaled, past)
        bounded = _within(computed, form.low, form.high)
        values = bounded * scale[n:] + offset[n:]
        outputs = []
        for j, sides in enumerate(stage.limits):
            held, reached = self._limited(values[j], sides)
            beyond = held != values[j]
            outputs.append(
                jnp.where(beyond, (held - offset[n + j]) / scale[n + j], bounded[j]) if sides else bounded[j]
            )
            if stage.told[j]:
                self.raised[Flag.IN_DOUBT if stage.doubts[j] else Flag.AT_LIMIT].append(reached)
            for bound in (form.low, form.high):
                if np.isfinite(bound):
                    self.raised[Flag.AT_BOUND].append((bounded[j] == bound) & ~reached)
            self.known.append(held)
        self.after.append(following(jnp.stack(outputs)))

    def _limited(self, value: Any, sides: Sequence[Side]) -> tuple[Any, Any]:
        """A value within its declared limits, and whether it is at one."""
        import jax.numpy as jnp

        limits = []
        for side in sides:
            limit = np.float64(side.value) if side.column is None else self.known[side.column]
            value = jnp.where(value > limit if side.upper else value < limit, limit, value)
            limits.append(limit)
        return value, _any([value == limit for limit in limits])

    def flags(self) -> Any:
        """The sum of the bits that are raised."""
        import jax.numpy as jnp

        for port, value in zip(self.surrogate.inputs, self.given, strict=True):
            if port.range is not None:
                self.raised[Flag.OUTSIDE_RANGE] += [value < port.low, value > port.high]
        self.raised[Flag.NOT_A_NUMBER] = [jnp.isnan(value) for value in self.known]
        bits = [_any(causes) * np.int32(flag) for flag, causes in self.raised.items()]
        return jnp.sum(jnp.stack(bits), dtype=np.int32)


def _any(causes: Sequence[Any]) -> Any:
    import jax.numpy as jnp

    return jnp.any(jnp.stack(causes)) if causes else jnp.asarray(False)


def _within(value: Any, low: float, high: float) -> Any:
    """NaN stays NaN, as in the model; beyond a bound derivatives are 0."""
    import jax.numpy as jnp

    value = jnp.where(value < low, np.float64(low), value) if np.isfinite(low) else value
    return jnp.where(value > high, np.float64(high), value) if np.isfinite(high) else value


def _lagged(stage: Stage, scaled: Any, past: Any) -> tuple[Any, Callable[[Any], Any]]:
    """Outputs of a model over lagged regressors, and what makes its next state of them."""
    import jax.numpy as jnp

    form, layout = stage.lagged
    columns = [layout.column(channel, lag) for channel, own in enumerate(form.lags) for lag in own]
    x = jnp.concatenate([scaled, past])[np.array(columns, dtype=np.int32)]
    total = form.linear @ x + form.constant
    if form.neurons:
        hidden, readout = form.neuron.jax()(form.hidden_weights @ x + form.hidden_bias), form.readout
        if form.gated:
            hidden, readout = hidden * (form.gates @ x + form.readout[0]), np.ones_like(form.readout)
        total = total + readout @ hidden

    def following(outputs: Any) -> Any:
        return jnp.concatenate([scaled, outputs, past])[np.array(layout.next_columns(), dtype=np.int32)]

    return total, following


def _space(stage: Stage, scaled: Any, past: Any) -> tuple[Any, Callable[[Any], Any]]:
    """Outputs of a state space, and its next state, which hangs on no output."""
    import jax.numpy as jnp

    form = stage.state_space
    z = jnp.concatenate([past, scaled])

    def summed(table: NDArray[np.float64], constant: NDArray[np.float64], neurons: Neurons) -> Any:
        total = table @ z + constant
        if len(neurons):
            total = total + neurons.readout @ form.neuron.jax()(neurons.weights @ z + neurons.bias)
        return total

    outputs = summed(form.readout, form.constant, form.output_neurons)
    outputs = jnp.where(outputs < 0, -outputs, outputs) if form.rectified else outputs
    change = summed(form.change, form.drift, form.state_neurons)
    after = _within(past + change, -form.bound, form.bound)
    return outputs, lambda _: after


def _equations(stage: Stage, scaled: Any, past: Any) -> tuple[Any, Callable[[Any], Any]]:
    """Outputs of equations, and their next state, which hangs on no output."""
    import jax
    import jax.numpy as jnp

    form, layout = stage.equations
    n, n_c = form.n_state, form.n_continuous
    known = jnp.concatenate([scaled, past])

    def sample(channel: int, lag: int) -> Any:
        return known[form.n_inputs + layout.lines[channel].column(lag)] if lag else scaled[channel]

    u = [sum(sample(channel, lag) * weight for channel, lag, weight in parts) for parts in form.given]
    x = past[:n]
    lost = jnp.where(jnp.isfinite(jnp.sum(x)), 0.0, np.nan)  # by a state that is no number

    def substep(now: Any, part: Any) -> tuple[Any, None]:
        at, total = now, 0.0
        for share, ahead, behind in form.stages:
            slope = _listed(form.slopes, jnp.concatenate([at, x[n_c:]]), [*u, (part + behind) / form.substeps])
            total = total + share * form.step * slope
            at = now + ahead * slope
        return now + total, None

    now = jax.lax.scan(substep, x[:n_c], jnp.arange(form.substeps, dtype=np.float64))[0] if n_c else x[:0]
    after = jnp.concatenate([now, _listed(form.updates, x, u)]) + lost
    outputs = _listed(form.outputs, after if form.ahead else x, u) + lost
    following = jnp.concatenate([after, known[np.array(layout.next_columns(), dtype=np.int32)]])
    return outputs, lambda _: following


def _listed(listing: Listing, x: Any, u: Sequence[Any]) -> Any:
    """The results of a listing, as an array."""
    import jax.numpy as jnp

    values: list[Any] = []
    given = {STATE: x, INPUT: u}

    def read(one: Any) -> Any:
        return one if isinstance(one, float) else given.get(one.kind, values)[one.at]

    for one in listing.instructions:
        points = (one.points,) if one.points else ()
        values.append(one.operation.jax(jnp, *map(read, one.reads), *points))
    found = [jnp.asarray(read(one), dtype=np.float64) for one in listing.results]
    return jnp.stack(found) if found else jnp.zeros(0)
