"""Each stage of a surrogate as tables over what it reads: what products over several stages are put together from.

A stage, lagged or with hidden states, becomes one block: terms, which are differences of readings as in
:class:`sysid.export.forms.incremental.IncrementalForm`, and rows over these terms: neurons, gates, outputs and states.
Equations are a block too, whose terms are what their programs read, and which has no tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.export.forms.incremental import IncrementalForm, Term
from sysid.export.forms.programs import ProgramForm
from sysid.export.forms.stage import Stage
from sysid.export.forms.state_space import StateSpaceForm
from sysid.export.surrogate import Surrogate
from sysid.export.wide.terms import BlockTerms, InputTerm, Now, Past, Reading, affine
from sysid.kernels.neurons import NEURONS, Neuron
from sysid.models.orders.activations import PLAIN


@dataclass(frozen=True, kw_only=True, eq=False)
class OwnLimit:
    """A limit of an output that is another output of the same stage.

    Args:
        row: The output.
        upper: Whether it may not be above.
        other: The output that is the limit.
        slope: From the other's scaled numbers to its own.
        shift: The same.
    """

    row: int
    upper: bool
    other: int
    slope: float
    shift: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Block:
    """One stage. Rows of outputs come before those of states.

    Args:
        stage: The stage.
        readings: What it reads, each once.
        selection: From readings to terms, shape ``(n_terms, n_readings)``.
        shift: Added to the terms.
        hidden: Of neurons over terms, and their bias behind it: shape ``(n_neurons, n_terms + 1)``, as all tables.
        gates: What each neuron is multiplied with; ``None`` without gates.
        readout: Of rows over neurons.
        linear: Of rows over terms.
        last: Of rows over terms: what is added to what the row gives; zeros where it gives the number itself.
        upper: Of rows over terms: channels that they may not be above; ``inf`` for none.
        lower: The same from below, and numbers that count after such a channel.
        low: Between this and ``high`` rows are held first.
        high: See ``low``.
        own: Limits within the stage.
        neuron: What neurons make of their sums.
        rectified: Whether outputs are absolute values.
    """

    stage: Stage
    readings: tuple[Reading, ...]
    selection: NDArray[np.float64]
    shift: NDArray[np.float64]
    hidden: NDArray[np.float64]
    gates: NDArray[np.float64] | None
    readout: NDArray[np.float64]
    linear: NDArray[np.float64]
    last: NDArray[np.float64]
    upper: NDArray[np.float64]
    lower: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    own: tuple[OwnLimit, ...]
    neuron: Neuron
    rectified: bool

    @property
    def computes(self) -> bool:
        """Whether it is equations: programs over its terms, in place of tables."""
        return isinstance(self.stage.form, ProgramForm)

    @property
    def n_outputs(self) -> int:
        """Rows that are outputs."""
        return self.stage.form.n_outputs

    @property
    def rows(self) -> int:
        """Rows of outputs and states."""
        return len(self.linear)

    @property
    def neurons(self) -> int:
        """Number of neurons."""
        return len(self.hidden)

    @property
    def now(self) -> list[int]:
        """What is computed and read at this sample."""
        return [one.channel for one in self.readings if isinstance(one, Now)]


def block_of(surrogate: Surrogate, stage: Stage, *, keeps: bool) -> Block:
    """A stage as a block.

    Args:
        surrogate: The whole.
        stage: The stage.
        keeps: Whether what rounding takes from a sum is kept, and differences are taken before anything is weighted.

    Returns:
        The block.
    """
    terms = BlockTerms(surrogate, stage, rates=keeps)
    kinds = {StateSpaceForm: _space, ProgramForm: _equations}
    tables = kinds.get(type(stage.form), _lagged)(terms, stage)
    rows, m = len(tables.linear), stage.form.n_outputs
    if keeps and stage.remainders:
        first = surrogate.state_size + stage.first_remainder
        kept = [terms.add([(Past(first + at), 1.0)]) for at in range(stage.remainders)]
        tables.add(dict(zip(range(rows - stage.remainders, rows), kept, strict=True)))
    low, high = (np.full(rows, side) for side in (-tables.bound, tables.bound))
    low[:m], high[:m] = stage.form.low, stage.form.high
    held = _limits(terms, stage, low, high)
    n = len(terms.rows)
    selection, shift = terms.tables()
    return Block(
        stage=stage,
        readings=tuple(terms.readings),
        selection=selection,
        shift=shift,
        hidden=_wide(tables.hidden, n),
        gates=None if tables.gates is None else _wide(tables.gates, n),
        readout=tables.readout,
        linear=_wide(tables.linear, n),
        last=_units(tables.last, rows, n),
        upper=_limit_table(held, rows, n, upper=True),
        lower=_limit_table(held, rows, n, upper=False),
        low=low,
        high=high,
        own=tuple(one for one in held if isinstance(one, OwnLimit)),
        neuron=tables.neuron or stage.neuron,
        rectified=tables.rectified,
    )


@dataclass(kw_only=True, eq=False)
class _Tables:
    """Tables of a stage over the terms that its model has, the constants last; see :class:`Block`."""

    hidden: NDArray[np.float64]
    gates: NDArray[np.float64] | None
    readout: NDArray[np.float64]
    linear: NDArray[np.float64]
    last: dict[int, int]
    bound: float = np.inf
    rectified: bool = False
    neuron: Neuron | None = None

    def add(self, terms: dict[int, int]) -> None:
        """Add terms to rows as they are: of each row one, behind those there are."""
        self.linear = np.insert(self.linear, [-1] * len(terms), 0.0, axis=1)
        for row, term in terms.items():
            self.linear[row, term] = 1.0


def _with_constant(weights: NDArray[np.float64], constant: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([weights, np.asarray(constant)[:, np.newaxis]], axis=1)


def _wide(table: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """A table over more terms."""
    spare = np.zeros((len(table), n + 1 - table.shape[1]))
    return np.concatenate([table[:, :-1], spare, table[:, -1:]], axis=1)


def _units(places: dict[int, int], rows: int, n: int) -> NDArray[np.float64]:
    table = np.zeros((rows, n + 1))
    for row, term in places.items():
        table[row, term] = 1.0
    return table


def _lagged(terms: BlockTerms, stage: Stage) -> _Tables:
    form = stage.lagged[0]
    incremental = IncrementalForm.of(form)
    places = {term: terms.lagged(term) for term in (*incremental.inputs, *incremental.outputs)}
    outputs = range(form.n_outputs)
    return _Tables(
        hidden=_with_constant(incremental.hidden_weights, form.hidden_bias),
        gates=_with_constant(incremental.gates, form.readout[0]) if form.gated else None,
        readout=np.ones((1, form.neurons)) if form.gated else form.readout,
        linear=_with_constant(incremental.linear, form.constant),
        last={j: places[Term(channel=form.n_inputs + j, lag=1)] for j in outputs} if form.adds else {},
    )


def _space(terms: BlockTerms, stage: Stage) -> _Tables:
    form = stage.state_space
    for i in range(form.n_state):
        terms.add([(Past(stage.first + i), 1.0)])
    for i, source in enumerate(stage.sources):
        terms.now(source, form.offset[i], form.scale[i])
    q, m, neurons = len(form.output_neurons), form.n_outputs, (form.output_neurons, form.state_neurons)
    readout = np.zeros((m + form.n_state, q + len(form.state_neurons)))
    readout[:m, :q], readout[m:, q:] = (one.readout for one in neurons)
    return _Tables(
        hidden=_with_constant(
            np.concatenate([one.weights for one in neurons]), np.concatenate([one.bias for one in neurons])
        ),
        gates=None,
        readout=readout,
        linear=_with_constant(np.concatenate([form.readout, form.change]), np.concatenate([form.constant, form.drift])),
        last={m + i: i for i in range(form.n_state)},
        bound=form.bound,
        rectified=form.rectified,
    )


def _equations(terms: BlockTerms, stage: Stage) -> _Tables:
    """Terms alone: the states, then what the programs read of inputs."""
    form, layout = stage.equations
    for i in range(form.n_state):
        terms.add([(Past(stage.first + i), 1.0)])
    for parts in form.given:
        read: list[tuple[Reading, float]] = []
        shift = 0.0
        for channel, lag, weight in parts:
            line, source = layout.lines[channel], stage.sources[channel]
            if source < terms.n_inputs:
                first = stage.first + line.first if line.length else -1
                read.append((InputTerm(-1, lag, source, 0.0, 1.0, first, line.length), weight))
            elif lag:
                read.append((Past(stage.first + line.column(lag)), weight))
            else:
                slope, own = affine(terms.surrogate, source, 0.0, 1.0)
                read.append((Now(source - terms.n_inputs), slope * weight))
                shift += own * weight
        terms.add(read, shift)
    rows = form.n_outputs + form.n_state
    nothing = np.zeros((rows, form.n_state + len(form.given) + 1))
    return _Tables(
        hidden=nothing[:0], gates=None, readout=nothing[:, :0], linear=nothing, last={}, neuron=NEURONS[PLAIN]
    )


@dataclass(frozen=True, kw_only=True)
class _Limit:
    """A limit that counts after a channel has held a row: a term, or a number."""

    row: int
    upper: bool
    term: int | None
    value: float


def _limits(
    terms: BlockTerms, stage: Stage, low: NDArray[np.float64], high: NDArray[np.float64]
) -> list[_Limit | OwnLimit]:
    """The declared limits: the upper holds first, then the lower, which wins where they cross.

    Those that are known beforehand are put into ``low`` and ``high``; the others are given back.
    """
    form, n = stage.form, stage.form.n_inputs
    found: list[_Limit | OwnLimit] = []
    for j, sides in enumerate(stage.limits):
        offset, scale = form.offset[n + j], form.scale[n + j]
        before = len(found)
        for side in sides:
            value = (side.value - offset) / scale
            if side.column is None and len(found) == before:
                hold = np.minimum if side.upper else np.maximum
                low[j], high[j] = hold(low[j], value), hold(high[j], value)
            elif side.column in stage.targets:
                slope, shift = affine(terms.surrogate, side.column, offset, scale)
                other = stage.targets.index(side.column)
                found.append(OwnLimit(row=j, upper=side.upper, other=other, slope=slope, shift=shift))
            else:
                term = None if side.column is None else terms.now(side.column, offset, scale)
                found.append(_Limit(row=j, upper=side.upper, term=term, value=value))
    return found


def _limit_table(held: Sequence[_Limit | OwnLimit], rows: int, n: int, *, upper: bool) -> NDArray[np.float64]:
    """Limits of rows over terms; infinite where there is none."""
    table = np.zeros((rows, n + 1))
    table[:, -1] = np.inf if upper else -np.inf
    for one in held:
        if isinstance(one, _Limit) and one.upper is upper:
            table[one.row] = 0.0
            if one.term is None:
                table[one.row, -1] = one.value
            else:
                table[one.row, one.term] = 1.0
    return table


def levels_of(blocks: Sequence[Block]) -> list[int]:
    """How many blocks must have been computed before each, one after the other."""
    made: dict[int, int] = {}
    levels = []
    for block in blocks:
        level = 1 + max((made[channel] for channel in block.now), default=-1)
        levels.append(level)
        first = len(made)
        made.update({first + j: level for j in range(block.n_outputs)})
    return levels
