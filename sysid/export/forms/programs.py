"""A grey box as exporters see it: lists of operations over states and inputs, with every parameter a number."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.equations.graph import Program, computed
from sysid.export.forms.operations import OPERATIONS, Operation
from sysid.kernels import register_machine as machine
from sysid.models import History, VectorScaling
from sysid.models.channels.ends import Ends
from sysid.models.grey_box.equation_form import EquationForm

STATE, INPUT, VALUE = "x", "u", "v"


@dataclass(frozen=True)
class Place:
    """A number that an operation reads.

    Args:
        kind: A state, an input of the programs, or what an operation before gives.
        at: Which one.
    """

    kind: str
    at: int


Read = Place | float


@dataclass(frozen=True, kw_only=True)
class Instruction:
    """One operation.

    Args:
        number: The machine's number of the operation.
        reads: What it reads, in order.
        points: Of a table.
    """

    number: int
    reads: tuple[Read, ...]
    points: tuple[tuple[float, float], ...] = ()

    @property
    def operation(self) -> Operation:
        """What it is in every target."""
        return OPERATIONS[self.number]


@dataclass(frozen=True, kw_only=True)
class Listing:
    """A program with its parameters filled in, and what hangs on no state or input computed.

    Args:
        instructions: In the order in which they run; each gives the value that stands at its place.
        results: What is asked for.
    """

    instructions: tuple[Instruction, ...]
    results: tuple[Read, ...]

    @classmethod
    def of(cls, program: Program, form: EquationForm) -> Listing:
        """A program of a model.

        Args:
            program: The program.
            form: The model's form, which has its parameters and tables.

        Returns:
            The listing.
        """
        low, (n_theta, n, m) = form.lowered, program.sizes
        numbers = [*map(float, program.constants), *map(float, form.filled[: n_theta - 1])]
        inputs = [Place(INPUT, j) for j in range(m + 1)]  # behind them the share of the way that lies behind
        known: list[Read] = [*numbers, inputs[m], *(Place(STATE, i) for i in range(n)), *inputs[:m]]
        found: list[Instruction] = []
        for number, *registers, own in program.code.tolist():
            reads = tuple(known[one] for one in registers[: len(OPERATIONS[number].slopes)])
            points: tuple[tuple[float, float], ...] = ()
            if number == machine.TABLE:
                begin, count = low.places[own]
                points = tuple((float(x), float(y)) for x, y in low.table[begin : begin + count])
            value = _value(number, reads, points)
            if value is None:
                found.append(Instruction(number=number, reads=reads, points=points))
                known.append(Place(VALUE, len(found) - 1))
            else:
                known.append(value)
        return cls(instructions=tuple(found), results=tuple(known[one] for one in program.results.tolist()))


def _value(number: int, reads: Sequence[Read], points: Sequence[tuple[float, float]]) -> float | None:
    """What an operation gives over numbers alone; ``None`` where it reads anything else, or gives no finite number."""
    given = [one for one in reads if isinstance(one, float)]
    if len(given) < len(reads):
        return None
    x, y = [at for at, _ in points], [at for _, at in points]
    found = float(np.interp(given[0], x, y)) if points else computed(number, given)
    return found if math.isfinite(found) else None


@dataclass(frozen=True, kw_only=True, eq=False)
class ProgramForm:
    r"""``dx/dt = f(x, u)`` by steps of the solver, ``x(k+1) = g(x, u)``, ``y = h(x, u)``, all in units.

    The state is the states, those with a rate first, and the past samples of the inputs that are read.

    Args:
        ends: Names, units and values at rest of what goes in and comes out.
        lowered: What the model runs.
        spare: Whether it has a state that is always 0: files want one number beside past samples of inputs.
    """

    ends: Ends
    lowered: EquationForm
    spare: bool = False

    low = -math.inf
    """Lower bound of the output: none."""
    high = math.inf
    """Upper bound of the output: none."""

    @cached_property
    def rates(self) -> Listing:
        """``f``."""
        return Listing.of(self.lowered.lowered.rates, self.lowered)

    @cached_property
    def slopes(self) -> Listing:
        """What a step goes along: ``f``, or the mean slope of an implicit step."""
        return Listing.of(self.lowered.lowered.slopes, self.lowered)

    @property
    def stages(self) -> tuple[tuple[float, float, float], ...]:
        """Of each stage of a step how much its slope counts, how many seconds ahead the next is, what lies behind."""
        method = self.lowered.lowered.method
        rows = np.column_stack([method[:, 0] / method[:, 0].sum(), method[:, 1] * self.step, method[:, 2]])
        return tuple((counts, ahead, behind) for counts, ahead, behind in rows.tolist())

    @property
    def ahead(self) -> bool:
        """Whether a sample begins with the way to it, and slopes read behind the inputs the share that lies behind."""
        return self.lowered.lowered.ahead

    @cached_property
    def updates(self) -> Listing:
        """``g``."""
        if not self.lowered.lowered.states:
            return Listing(instructions=(), results=(0.0,) * self.spare)
        return Listing.of(self.lowered.lowered.updates, self.lowered)

    @cached_property
    def outputs(self) -> Listing:
        """``h``."""
        return Listing.of(self.lowered.lowered.outputs, self.lowered)

    @property
    def run(self) -> dict[str, Listing]:
        """What is run, by name."""
        return {"slopes": self.slopes, "updates": self.updates, "outputs": self.outputs}

    @property
    def stands(self) -> dict[str, Listing]:
        """What tells whether anything changes at a state, by name."""
        return {"rates": self.rates, "updates": self.updates, "outputs": self.outputs}

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return self.lowered.lowered.states or ("none",) * self.spare

    @property
    def n_state(self) -> int:
        """Number of states."""
        return len(self.states)

    @property
    def n_continuous(self) -> int:
        """States with a rate, the first ones."""
        return self.lowered.lowered.n_continuous

    @property
    def substeps(self) -> int:
        """Steps of the solver from sample to sample."""
        return self.lowered.substeps

    @property
    def step(self) -> float:
        """Seconds of one of them."""
        return self.lowered.step

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return len(self.ends.inputs)

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return len(self.ends.outputs)

    @property
    def offset(self) -> tuple[float, ...]:
        """Of every input and output: none, equations are in units."""
        return (0.0,) * (self.n_inputs + self.n_outputs)

    @property
    def scale(self) -> tuple[float, ...]:
        """Of every input and output: none."""
        return (1.0,) * (self.n_inputs + self.n_outputs)

    @cached_property
    def given(self) -> tuple[tuple[tuple[int, int, float], ...], ...]:
        """Each input of the programs as a weighted sum: channel, samples ago, weight."""
        found = []
        for channel, lag in self.lowered.lowered.lagged:
            whole = math.floor(lag)
            rest = lag - whole
            now = ((channel, whole, 1.0 - rest),)
            found.append((*now, (channel, whole + 1, rest)) if rest else now)
        return tuple(found)

    @cached_property
    def depths(self) -> tuple[int, ...]:
        """Past samples that are kept of each input."""
        found = [0] * self.n_inputs
        for parts in self.given:
            for channel, lag, _ in parts:
                found[channel] = max(found[channel], lag)
        return tuple(found)

    @cached_property
    def declared(self) -> tuple[float | None, ...]:
        """Of each state where a record begins that begins at rest; ``None`` for one that is where nothing changes."""
        terms = self.lowered.terms
        if not self.lowered.lowered.states:
            return (0.0,) * self.spare
        levels = terms.held(terms.level)
        return tuple(float(level) if known else None for level, known in zip(levels, terms.declared, strict=True))

    def state_after(self, history: History) -> NDArray[np.float64]:
        """The states after some samples, as the model finds them, shape ``(n_states,)``."""
        return self.lowered.state(history) if self.lowered.lowered.states else np.zeros(self.n_state)

    @property
    def searches(self) -> bool:
        """Whether the state at rest has to be searched for: where a state has no declared beginning."""
        return None in self.declared

    def history_at(self, inputs: NDArray[np.float64], outputs: NDArray[np.float64]) -> History:
        """A system that has stood at some inputs and outputs, in their units."""
        several = isinstance(self.lowered.scaling, VectorScaling)
        return History.at_rest(inputs=inputs, output=outputs if several else float(outputs[0]))
