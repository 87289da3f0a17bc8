"""The form that a grey box lowers to: programs, parameters, free run, and the state before a record."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.equations import Lowered
from sysid.errors import TraceError
from sysid.kernels import equation_run
from sysid.kernels import register_machine as machine
from sysid.models.activations import PLAIN
from sysid.models.case_search import shown
from sysid.models.case_values import CaseValues
from sysid.models.column_recursion import ColumnEquation, ColumnRecursion
from sysid.models.ends import read_now
from sysid.models.form import AbstractForm, no_prediction
from sysid.models.history import History
from sysid.models.lags import Lags
from sysid.models.scaling import Scaling, VectorScaling
from sysid.models.state_search import LARGEST, StateSearch, at_rest

Array = NDArray[np.float64]

FARTHEST = 10.0
"""How far from its level a state may be expected, in its scales."""

INTEGRATES = 1e-7
"""Singular value of what changes from sample to sample, in states' scales, up to which there is no equilibrium."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StateTerms:
    """What is known of the states of some equations, one entry for each state.

    Args:
        level: An ordinary value, in its unit.
        scale: How far it ordinarily goes from there.
        low: Least value before a record.
        high: Greatest value before a record.
        declared: Whether a record that begins at rest begins at its level; at equilibrium otherwise.
        fixed: Whether every record begins at its level.
    """

    level: Array
    scale: Array
    low: Array
    high: Array
    declared: NDArray[np.bool_]
    fixed: NDArray[np.bool_]

    def held(self, x: Array) -> Array:
        """A state within its bounds."""
        return np.asarray(np.clip(x, self.low, self.high))


@dataclass(frozen=True, kw_only=True, eq=False)
class EquationForm(AbstractForm):
    r"""``dx/dt = f(x, u, p)``, ``x(k+1) = g(x, u, p)``, ``y = h(x, u, p)``, in the units of the equations.

    A history gives the state thus. One sample is a system that has stood there: states that are declared have their
    level, the others are at equilibrium, those that this leaves open where the output is the sample's
    (:func:`~sysid.models.state_search.at_rest`). Where it holds more, the state before its oldest sample minimises the
    error of the free run over the history, near that at rest; the model runs on through it.

    Args:
        lowered: The programs.
        theta: Parameters ``[free | weights | fixed | norms]``.
        scaling: Of the outputs; the equations themselves are in units.
        terms: What is known of the states.
        substeps: Steps of the solver from sample to sample.
        sample_time: Seconds.
        widths: Of each switch, in the unit of its argument; 0 is exact.
        several: Whether outputs have columns.
        low: None: the equations hold what they hold.
        high: Likewise.
        cases: What is known of parameters that differ by case; ``None`` where none does.
    """

    lowered: Lowered
    theta: Array
    scaling: Scaling | VectorScaling
    terms: StateTerms
    substeps: int
    sample_time: float
    widths: Array
    several: bool = False
    low: float = -math.inf
    high: float = math.inf
    cases: CaseValues | None = None
    predicts: bool = field(default=False, init=False)

    @property
    def numbers(self) -> Array:
        """Parameters and what is known of the states."""
        return np.concatenate([self.theta, self.terms.level, self.terms.scale, [float(self.substeps)]])

    @property
    def memory(self) -> int:
        """Twice as many samples as states and parameters by case, and one more."""
        n_constants = 0 if self.cases is None else len(self.cases.places)
        return 2 * (self.lowered.n_states + n_constants) + 1

    @cached_property
    def columns(self) -> ColumnRecursion | None:
        """What it is in the compiled pass of a cascade: one output that is a function of whole lags of the inputs."""
        low = self.lowered
        if low.states or self.cases is not None or self.n_outputs > 1 or any(lag % 1 for _, lag in low.lagged):
            return None
        program, n_inputs = low.outputs, self.n_inputs
        lags = [sorted(int(lag) for channel, lag in low.lagged if channel == i) for i in range(n_inputs)]
        order = [low.lagged.index((i, lag)) for i, own in enumerate(lags) for lag in own]
        place = np.arange(program.first + len(program.code), dtype=np.uint64)
        given = program.first - len(order)
        place[given + np.array(order, dtype=np.int64)] = np.arange(given, program.first)
        code = program.code.copy()
        code[:, 1:4] = place[code[:, 1:4]]
        return ColumnRecursion(
            lags=Lags(inputs=(*map(tuple, lags), ()), output=()),
            neurons=0,
            theta=np.zeros(1),
            linear=False,
            gated=False,
            offset=(0.0,) * (n_inputs + 1),
            scale=(1.0,) * (n_inputs + 1),
            low=-math.inf,
            high=math.inf,
            activation=PLAIN,
            equation=ColumnEquation(
                numbers=np.concatenate([program.constants, self.filled[: program.sizes[0]]]),
                code=code,
                result=int(place[program.results[0]]),
                places=low.places,
                table=low.table,
                free=slice(len(program.constants), len(program.constants) + low.n_estimated)
                if low.n_estimated
                else slice(0, 0),
            ),
        )

    def reads_now(self, inputs: tuple[str, ...]) -> frozenset[str]:
        """Inputs that are read at the sample of the output; all of equations that remember."""
        return frozenset(inputs) if self.columns is None else read_now(inputs, self.columns.lags.inputs)

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return len(self.scaling.input_scale)

    @property
    def constants(self) -> tuple[str, ...]:  # type: ignore[override]  # read only: a form is frozen
        """Names of parameters that differ by case."""
        return () if self.cases is None else self.cases.names

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return len(self.lowered.outputs.results)

    @cached_property
    def programs(self) -> tuple[object, object, object]:
        """Slopes, updates and outputs, as the machine takes them."""
        low = self.lowered
        return low.slopes.arrays, low.updates.arrays, low.outputs.arrays

    @property
    def step(self) -> float:
        """Seconds of one step of the solver."""
        return self.sample_time / self.substeps

    @cached_property
    def filled(self) -> Array:
        """What stands in the programs' registers: parameters, the step, and the share of the way behind, here none."""
        return np.append(self.theta, [self.step, 0.0])

    @cached_property
    def output_scale(self) -> Array:
        """Of each output, in its unit."""
        return np.atleast_1d(np.asarray(self.scaling.output_scale, dtype=np.float64))

    @property
    def _own(self) -> tuple[object, ...]:
        return self.lowered.method, self.substeps, self.step, self.lowered.ahead, *self._tables

    @property
    def _tables(self) -> tuple[object, ...]:
        return self.widths, self.lowered.places, self.lowered.table

    def simulate(self, inputs: Array, history: History) -> Array:
        """Free run; see the base class."""
        form = self.of_case(history)
        return form._shaped(form.run(form.given(inputs, history.inputs), form.state(history)))

    def predict(
        self,
        inputs: Array,  # noqa: ARG002 - nothing is predicted from any of them
        output: Array,  # noqa: ARG002
        history: History,  # noqa: ARG002
        steps: int,  # noqa: ARG002
    ) -> Array:
        """None: the noise is added to the output, and says nothing about the next; see the base class."""
        raise no_prediction("a grey box")

    def followed(self, history: History) -> Array:
        """The free run over a history itself; see the base class."""
        form = self.of_case(history)
        return form._shaped(form.run(form.given(history.inputs, history.inputs[:1]), form._begun(history)))

    def cased(self, history: History, case: str) -> History:
        """The history before a record, with the values of its case: known, or shown by the samples of the history.

        Args:
            history: The samples.
            case: Name of the record.

        Returns:
            The history; as it is where no parameter differs by case.

        Raises:
            ConfigError: If the case was not fitted, and the history is a single sample.
            TraceError: If the samples of one that was not fitted do not show a value.
        """
        if self.cases is None:
            return history
        row = self.cases.row(case)
        if row is not None:
            return replace(history, case=case, constants=tuple(map(float, self.cases.values[row])))
        if len(history.output) == 1:
            raise self.cases.unknown(case)
        return replace(history, case=case, constants=shown(self, history, case))

    def of_case(self, history: History) -> EquationForm:
        """The form with the values that a history has of the parameters by case; itself where there are none."""
        if self.cases is None:
            return self
        constants = history.constants or self.cased(history, history.case).constants
        return self.with_constants(np.array(constants))

    def with_constants(self, values: Array) -> EquationForm:
        """The form of one case.

        Args:
            values: Of each parameter by case, in its unit.

        Returns:
            A form in which none differs by case any more.
        """
        assert self.cases is not None  # noqa: S101 - asked for by who calls
        theta = self.theta.copy()
        theta[self.cases.places] = values
        return replace(self, theta=theta, cases=None)

    def state(self, history: History) -> Array:
        """The state after some samples.

        Args:
            history: The samples, oldest first, in units; a single one is a system at rest.

        Returns:
            Shape ``(n_states,)``.
        """
        x = self._begun(history)
        if len(history.output) > 1:
            self.run(self.given(history.inputs, history.inputs[:1]), x)
        return x

    def _shaped(self, y: Array) -> Array:
        return y if self.several else y[:, 0]

    def _begun(self, history: History) -> Array:
        """The state before the oldest sample of a history; of a single one, the state after it."""
        output = history.output.reshape(len(history.output), -1)
        x = self.resting(self.given(history.inputs[:1], history.inputs[:1])[0], output[0])
        if len(output) == 1:
            return x
        return self.estimated(self.given(history.inputs, history.inputs[:1]), output, x, history.known)

    def given(self, inputs: Array, before: Array) -> Array:
        """What the programs read of some inputs.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
            before: Inputs before them, the oldest held where they are too few, shape ``(n_past, n_inputs)``.

        Returns:
            Shape ``(n_samples, n_lagged)``.

        Raises:
            TraceError: If there are fewer inputs than the equations read.
        """
        inputs = np.asarray(inputs, dtype=np.float64)
        needed = max((channel + 1 for channel, _ in self.lowered.lagged), default=0)
        if inputs.ndim != 2 or inputs.shape[1] < needed:
            raise TraceError(
                "the inputs do not fit the model",
                expected=f"inputs and history of shape (n, {needed})",
                got=f"shape {inputs.shape}",
                remedy="give one column per input of the mapping, in its order",
            )
        depth = self.lowered.depth
        missing = max(0, depth - len(before))
        past = np.concatenate([np.repeat(before[:1], missing, axis=0), before])[len(before) + missing - depth :]
        return self.lowered.given(np.concatenate([past, inputs]), len(inputs))

    def run(self, u: Array, x: Array, path: Array | None = None) -> Array:
        """Output over some inputs; ``x`` becomes the state after them.

        Args:
            u: What :meth:`given` gives.
            x: State before the first sample, shape ``(n_states,)``; overwritten.
            path: Overwritten by the states before each sample, where somebody asks, shape ``(n_samples, n_states)``.

        Returns:
            Shape ``(n_samples, n_outputs)``, in units.
        """
        y = np.empty((len(u), self.n_outputs))
        path = np.empty((0, len(x))) if path is None else path
        equation_run.free_run(self.programs, self.filled, x, u, *self._own, y, path)
        return y

    def moved(self, u: Array, x: Array, S: Array, p: int) -> tuple[Array, Array]:
        """Output over some inputs and its derivatives; ``x`` and ``S`` become those after them.

        Args:
            u: What :meth:`given` gives.
            x: State before the first sample; overwritten.
            S: Its derivatives, shape ``(n_states, n_columns)``; overwritten.
            p: How many parameters have columns, the first of all.

        Returns:
            Output of shape ``(n_samples, n_outputs)``, in units, and ``(n_samples, n_outputs, n_columns)``.
        """
        y, J = np.empty((len(u), self.n_outputs)), np.empty((len(u), self.n_outputs, S.shape[1]))
        equation_run.sensitivities(self.programs, self.filled, p, x, S, u, *self._own, y, J)
        return y, J

    def probed(self, u: Array, path: Array) -> Array:
        """Arguments of networks and switches along a path of states.

        Args:
            u: What :meth:`given` gives.
            path: Shape ``(n_samples, n_states)``.

        Returns:
            Shape ``(n_samples, n_probes)``.
        """
        found = np.empty((len(u), len(self.lowered.probes.results)))
        machine.values(self.lowered.probes.arrays, self.filled, path, u, *self._tables, found)
        return found

    def resting(self, u: Array, output: Array) -> Array:
        """The state of a system that has stood for ever.

        Args:
            u: What the programs read, shape ``(n_lagged,)``.
            output: Its outputs, in their units, shape ``(n_outputs,)``.

        Returns:
            Shape ``(n_states,)``; as near to equilibrium as there is one.
        """
        return at_rest(lambda x: self._standing(x, u), output, self.output_scale, self.terms)[0]

    def resting_moves(self, u: Array, output: Array, p: int) -> tuple[Array, Array]:
        """The state at rest, and how it moves with the first parameters.

        Args:
            u: What the programs read, shape ``(n_lagged,)``.
            output: Its outputs, in their units.
            p: How many parameters.

        Returns:
            Shapes ``(n_states,)`` and ``(n_states, p)``.
        """
        x, moves = at_rest(lambda x: self._standing(x, u, p), output, self.output_scale, self.terms)
        return x, moves

    def rates_by_state(self, x: Array, u: Array) -> Array:
        """How the rates move with the states.

        Args:
            x: State, shape ``(n_states,)``.
            u: What the programs read, shape ``(n_lagged,)``.

        Returns:
            Shape ``(n_continuous, n_states)``.
        """
        return self._derived(self.lowered.rates, x, u, 0)[1]

    def _standing(
        self, x: Array, u: Array, p: int = 0
    ) -> tuple[tuple[Array, Array, Array], tuple[Array, Array, Array]]:
        """What changes at a state, and the outputs there, each with its derivatives by state and parameters."""
        low = self.lowered
        changes = [self._derived(program, x, u, p) for program in (low.rates, low.updates)]
        change, by_state, by_parameter = (np.concatenate(parts) for parts in zip(*changes, strict=True))
        first = low.n_continuous
        change[first:] -= x[first:]
        by_state[first:, first:] = self._settling(by_state[first:, first:])
        return (change, by_state, by_parameter), self._derived(low.outputs, x, u, p)

    def _settling(self, by_state: Array) -> Array:
        """How what changes from sample to sample moves with the states; a rounding off an integrator is one.

        A pole that is off 1 by a rounding has an equilibrium where no plant ever was.
        """
        found = by_state - np.eye(len(by_state))
        if not len(found) or not np.all(np.abs(found) < LARGEST):
            return found
        scale = self.terms.scale[-len(found) :]
        left, sizes, right = np.linalg.svd(found * scale / scale[:, None])
        small = sizes < INTEGRATES
        if small.any():
            found -= (left[:, small] * sizes[small]) @ right[small] * scale[:, None] / scale
        return np.asarray(found)

    def _derived(self, program: object, x: Array, u: Array, p: int) -> tuple[Array, Array, Array]:
        results = len(program.results)  # type: ignore[attr-defined]  # a Program
        r, Jx, Jp = np.empty(results), np.empty((results, len(x))), np.empty((results, p))
        machine.derivatives(program.arrays, self.filled, p, x, u, *self._tables, r, Jx, Jp)  # type: ignore[attr-defined]
        return r, Jx, Jp

    def estimated(self, u: Array, output: Array, rest: Array, known: NDArray[np.bool_]) -> Array:
        """The state before some samples that their outputs show, near the one expected.

        Args:
            u: What :meth:`given` gives.
            output: Outputs, in units, shape ``(n_samples, n_outputs)``.
            rest: State expected, shape ``(n_states,)``.
            known: Which samples are not masked, shape ``(n_samples,)``.

        Returns:
            Shape ``(n_states,)``.
        """
        if not (~self.terms.fixed).any() or not known.any():
            return rest
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            runs = np.isfinite(self.run(u, rest.copy())).all()
        # From a state at which the run grows without bound no search begins: over few samples it has no time to.
        for few in (1, 2, 4, 8) if not runs else ():
            if few < len(u) and known[:few].any():
                rest = self._shown(u[:few], output[:few], rest, known[:few])
        return self._shown(u, output, rest, known)

    def _shown(self, u: Array, output: Array, rest: Array, known: NDArray[np.bool_]) -> Array:
        """The state that some samples show, by a search from the one expected."""
        terms = self.terms
        free = np.flatnonzero(~terms.fixed)

        def misfit(xi: Array, derived: bool) -> tuple[Array, Array]:
            x = rest.copy()
            x[free] = terms.level[free] + terms.scale[free] * xi
            if not derived:
                y, J = self.run(u, x), np.empty((0, 0, 0))
            else:
                S = np.zeros((len(x), len(free)))
                S[free, np.arange(len(free))] = terms.scale[free]
                y, J = self.moved(u, x, S, 0)
            away = (y - output) / self.output_scale
            scaled = (J / self.output_scale[:, None])[known] if derived else J
            return away[known].ravel(), scaled.reshape(-1, len(free))

        low, high = ((bound[free] - terms.level[free]) / terms.scale[free] for bound in (terms.low, terms.high))
        # An equilibrium far from where states ordinarily are, as of a plant that nearly integrates, is no expectation.
        expected = np.clip((rest[free] - terms.level[free]) / terms.scale[free], -FARTHEST, FARTHEST)
        found = StateSearch(misfit=misfit, low=low, high=high, expected=expected).found()
        x = rest.copy()
        x[free] = terms.level[free] + terms.scale[free] * found
        return x

    def with_theta(self, theta: Array) -> EquationForm:
        """The same form with other parameters of those that are estimated."""
        whole = self.theta.copy()
        whole[: len(theta)] = theta
        return replace(self, theta=whole)
