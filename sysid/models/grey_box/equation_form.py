"""The form that a grey box lowers to: its free run from a history, the state before one, and what differs by case."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.models.channels.ends import read_now
from sysid.models.channels.history import History
from sysid.models.contract.column_recursion import ColumnEquation, ColumnRecursion
from sysid.models.contract.form import no_prediction
from sysid.models.contract.state_descent import StateSearch
from sysid.models.grey_box.case_search import shown
from sysid.models.grey_box.case_values import CaseValues
from sysid.models.grey_box.equation_programs import EquationPrograms
from sysid.models.orders.activations import PLAIN
from sysid.models.orders.lags import Lags

Array = NDArray[np.float64]

FARTHEST = 10.0
"""How far from its level a state may be expected, in its scales."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EquationForm(EquationPrograms):
    """Equations that begin at what a history says of their states, in the units of the equations.

    A history gives the state thus. One sample is a system that has stood there: states that are declared have their
    level, the others are at equilibrium, those that this leaves open where the output is the sample's
    (:func:`~sysid.models.grey_box.state_search.at_rest`). Where it holds more, the state before its oldest sample
    minimises the error of the free run over the history, near that at rest; the model runs on through it.

    Args:
        several: Whether outputs have columns.
        low: None: the equations hold what they hold.
        high: Likewise.
        cases: What is known of parameters that differ by case; ``None`` where none does.
    """

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
    def constants(self) -> tuple[str, ...]:  # type: ignore[override]  # read only: a form is frozen
        """Names of parameters that differ by case."""
        return () if self.cases is None else self.cases.names

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
