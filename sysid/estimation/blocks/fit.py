"""Block-oriented models of traces: equations from the best linear model, fitted as any grey box.

What a structure with fewer states has found is one of its starts (:mod:`sysid.estimation.blocks.grown`): states that a
record does not need make poles of the linear model that belong to no block, and every start from these may end worse
than the smaller structure does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.estimation.blocks.equations import hammerstein_wiener, wiener_hammerstein
from sysid.estimation.blocks.first_block import searched
from sysid.estimation.blocks.grown import grown
from sysid.estimation.blocks.linear_start import LinearStart, integrating_start, linear_start, parted, shifted, whole
from sysid.estimation.blocks.sections import Block
from sysid.estimation.clock import now
from sysid.estimation.grey_box.fit import fit_equations, raced_equations
from sysid.estimation.grey_box.layout import Begun
from sysid.estimation.grey_box.readying import built_template
from sysid.estimation.networks.training import FitProgress, Training, check_hidden_states
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import FitResult
from sysid.models import BuiltModel, GreyBox, HammersteinWiener, Mapping, Start, WienerHammerstein
from sysid.models.blocks.block_oriented import BlockStructure
from sysid.models.blocks.curve_starts import TURNS, CurveStart, curve_start
from sysid.models.blocks.curves import Text
from sysid.traces import Trace

STARTS = 4
"""Starts of a fit that asks for none: for two blocks, ways to part the linear model; else draws of the curves."""

LINEAR = 0.2
"""Share of a fit's time that each of its linear models may take."""

SMALLER = 0.3
"""Share of a fit's iterations and time for the structure with fewer states, and that of its starts' half."""

OWN = 0.4
"""Share of the time for the starts of the linear model among themselves, where there are those of fewer states too."""

SLOWER = 2.0
"""How much slower than the slowest of the linear model the slowest pole is that is added."""

Array = NDArray[np.float64]

NETWORK, LINE = "network", 50
"""Kind of a curve that has weights, and places along a straight line at which one is told that it is none."""

TURNING = 3
"""Blocks that are moved to where a curve behind them that may turn back leaves least."""

UNSCALED = (0.0, 1.0, 1.0)
"""Norms of the network of a curve whose argument ranges from -1 to 1."""

check_training = partial(check_hidden_states, "a block-oriented model")
"""Refuses options that do not apply to hidden states."""


def fit_blocks(
    traces: Sequence[Trace],
    mapping: Mapping,
    structure: BlockStructure,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    selection: Sequence[Trace] = (),
    vet: Callable[[Any], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit a linear block with curves around it, or a curve between two linear blocks, by the least free-run error.

    The starts of two blocks are ways to part the best linear model around the curve, the most promising first.

    Args:
        traces: Estimation traces; never concatenated.
        mapping: Which channels go in, which comes out.
        structure: The structure.
        training: How to train; options for lagged regressors do not apply.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.
        selection: Traces that choose between starts.
        vet: Whether a model's free run is stable.
        on_progress: Called after every iteration, from the threads that train.

    Returns:
        The fit, with the uncertainty of its parameters and the posterior of its output.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If an option does not apply.
        TraceError: If no sample counts, or there is no linear model to start from.
    """
    records = _Records(traces=traces, mapping=mapping, start=start or Start(), rest_output=rest_output)
    race = _Race.of(records, structure, (training or Training()).with_starts(STARTS), began=now())
    found = fit_equations(
        *race.template, race.training, (records.traces, selection, records.start),
        begins=race.begins, scattered=race.scattered, began=race.began, vet=vet, on_progress=on_progress,
    )  # fmt: skip
    return with_equations(found)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Records:
    """The records, and how they are looked at."""

    traces: Sequence[Trace]
    mapping: Mapping
    start: Start
    rest_output: float | None

    def linear(self, structure: BlockStructure, states: int, *, seconds: float, rectified: bool = False) -> LinearStart:
        """The best linear model."""
        return linear_start(
            self.late(structure), self.mapping, states, start=self.start, rest_output=self.rest_output,
            output="absolute" if rectified else "plain", seconds=seconds,
        )  # fmt: skip

    def late(self, structure: BlockStructure) -> list[Trace]:
        """The records without dead times."""
        return shifted(self.traces, self.mapping, structure.lags(len(self.mapping.inputs)))

    def signals(self, structure: BlockStructure, begun: LinearStart) -> tuple[Array, Array]:
        """Inputs and output of the longest record as the linear model has them."""
        longest = max(self.late(structure), key=len)
        return (
            begun.scaling.scale_inputs(longest.columns(self.mapping.inputs)),
            begun.scaling.scale_output(longest[self.mapping.output]),
        )

    def template(self, structure: BlockStructure, grey: GreyBox) -> tuple[BuiltModel, tuple[Experiment, ...]]:
        """The model before its fit, and the records as they are fitted."""
        return built_template(
            self.traces, self.mapping, grey, built_of=structure, start=self.start, rest_output=self.rest_output
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Ways:
    """Where fits of a structure begin.

    Args:
        greys: The same equations, whose parameters begin otherwise; the most promising first.
        weights: Of their networks; empty for networks that do nothing.
        scattered: Names of the parameters around which further starts are drawn.
        slowest: The longest time constant of the linear model, in samples.
        nets: Networks among the curves.
    """

    greys: Sequence[GreyBox]
    weights: Sequence[Array]
    scattered: frozenset[str]
    slowest: float
    nets: int = 1

    @property
    def names(self) -> list[str]:
        """Of the parameters."""
        return [one.name for one in self.greys[0].free]

    @property
    def begins(self) -> list[Begun]:
        """The same as starts."""
        return [
            Begun(parameters=np.array([one.start for one in grey.free]), weights=weights, norms=UNSCALED * self.nets)
            for grey, weights in zip(self.greys, self.weights, strict=True)
        ]


def _hammerstein_wiener_ways(
    records: _Records, structure: HammersteinWiener, training: Training, settles: bool
) -> _Ways:
    seconds, mapping = LINEAR * training.max_time_s, records.mapping
    rectified = structure.output.kind == "absolute"
    begun = records.linear(structure, structure.states, seconds=seconds, rectified=rectified)
    begun = replace(begun, settles=settles)
    ways = [begun]
    if begun.integrates and not rectified:
        stepping = integrating_start(
            records.late(structure), mapping, structure.states, start=records.start, scaling=begun.scaling,
            seconds=seconds,
        )  # fmt: skip
        ways.insert(0, stepping)
    direct = [lag == 0 for lag in structure.lags(len(mapping.inputs))]
    greys = [hammerstein_wiener(structure, mapping, one, whole(one, direct=direct)) for one in ways]
    weights, curves = [np.zeros(0)] * len(greys), (*structure.curves(len(mapping.inputs)), structure.output)
    line = np.linspace(-1.0, 1.0, LINE)
    for block, level, like in _turning(records, structure, training, begun, direct):
        greys.append(hammerstein_wiener(structure, mapping, level, block, like.bends))
        straight = [one.weights(line, line) for one in curves[:-1]] if len(like.weights) else []
        weights.append(np.concatenate([*straight, like.weights]))
    return _Ways(
        greys=[grey for grey, _ in greys], weights=weights, scattered=greys[0][1], slowest=begun.slowest,
        nets=sum(one.kind == NETWORK for one in curves),
    )  # fmt: skip


def _turning(
    records: _Records, structure: HammersteinWiener, training: Training, begun: LinearStart, direct: Sequence[bool]
) -> list[tuple[Block, LinearStart, CurveStart]]:
    """Blocks that are sought with a curve behind them that may turn back: of a square no linear model knows."""
    if begun.integrates or structure.output.kind not in TURNS or training.n_starts < 2:
        return []
    w, y = records.signals(structure, begun)
    pairs = searched(
        [whole(begun, direct=direct)], 0, (w, y), direct=direct, slowest=begun.slowest,
        rng=np.random.default_rng(training.seed), until=now() + LINEAR * training.max_time_s, moved=TURNING,
    )  # fmt: skip
    found = []
    for _, pair in pairs[: training.n_starts // 2]:
        like = curve_start(structure.output, pair.x, y[: len(pair.x)])
        if like is not None:
            block = replace(pair.before, gains=like.scale * pair.before.gains, direct=like.scale * pair.before.direct)
            found.append((block, replace(begun, level=like.level), like))
    return found


def _wiener_hammerstein_ways(
    records: _Records, structure: WienerHammerstein, training: Training, settles: bool
) -> _Ways:
    seconds, mapping = LINEAR * training.max_time_s, records.mapping
    begun = replace(records.linear(structure, structure.first + structure.second, seconds=seconds), settles=settles)
    direct = [lag == 0 for lag in structure.lags(len(mapping.inputs))]
    signals = records.signals(structure, begun)
    rng = np.random.default_rng(training.seed)
    pairs = parted(begun, structure.first, signals, direct=direct, rng=rng, seconds=seconds)[: training.n_starts]
    found = [wiener_hammerstein(structure, mapping, begun, pair) for pair in pairs]
    return _Ways(
        greys=[grey for grey, _ in found], weights=[weights for _, weights in found], scattered=frozenset(),
        slowest=begun.slowest,
    )  # fmt: skip


def _ways(records: _Records, structure: BlockStructure, training: Training, *, settles: bool = False) -> _Ways:
    if isinstance(structure, WienerHammerstein):
        return _wiener_hammerstein_ways(records, structure, training, settles)
    assert isinstance(structure, HammersteinWiener)  # noqa: S101 - there is no third
    return _hammerstein_wiener_ways(records, structure, training, settles)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Race:
    """A structure as it is trained: its model before the fit with the records, its training, and its starts."""

    template: tuple[BuiltModel, tuple[Experiment, ...]]
    training: Training
    data: tuple[Sequence[Trace], Sequence[Trace], Start]
    begins: Sequence[Begun]
    scattered: frozenset[str]
    began: float

    @classmethod
    def of(cls, records: _Records, structure: BlockStructure, training: Training, *, began: float) -> _Race:
        """The race of a structure, after that of what it contains."""
        ways = _ways(records, structure, training)
        own = cls.between(records, structure, training, ways, began=began)
        smaller, cheaper = structure.smaller, _cheaper(training)
        if smaller is None or now() - began >= SMALLER * training.max_time_s:
            return own  # where the smaller one begins takes as long to find as this one's starts did
        try:
            found, loss = cls.of(records, smaller, cheaper, began=now()).run()
        except TraceError:  # it has no free run where it begins: the larger one has starts of its own
            return own
        more = _grown(found, smaller, structure, training, ways)
        if not more:  # one integrates, and the other does not: a pole that is not needed may lie anywhere
            if replace(own, training=cheaper, began=now()).run()[1] < loss:
                return own
            ways = _ways(records, structure, training, settles=True)
            more = _grown(found, smaller, structure, training, ways)
            own = cls.between(records, structure, training, ways, began=began)
        # Among themselves first: early on a start at a minimum, the smaller one's, is ahead of any that will pass it.
        shorter = replace(training, max_time_s=OWN * training.max_time_s)
        begins = [_begun(replace(own, training=shorter, began=now()).run()[0]), *more]
        return replace(own, training=replace(training, starts=len(begins)), begins=begins)

    @classmethod
    def between(
        cls, records: _Records, structure: BlockStructure, training: Training, ways: _Ways, *, began: float
    ) -> _Race:
        """The race of the starts of the linear model."""
        return cls(
            template=records.template(structure, ways.greys[0]),
            training=training,
            data=(records.traces, (), records.start),
            begins=ways.begins,
            scattered=ways.scattered,
            began=began,
        )

    def run(self) -> tuple[BuiltModel, float]:
        """The best, and its loss."""
        return raced_equations(
            *self.template, self.training, self.data, begins=self.begins, scattered=self.scattered, began=self.began
        )


def _cheaper(training: Training) -> Training:
    """The training of a structure with fewer states."""
    return replace(
        training,
        starts=(training.n_starts + 1) // 2,
        max_iterations=max(round(SMALLER * training.max_iterations), 1),
        max_time_s=SMALLER * training.max_time_s,
    )


def _begun(found: BuiltModel) -> Begun:
    """What was found as a start."""
    weights = found.theta[len(found.grey.free) :]
    return Begun(parameters=np.array(list(found.parameters.values())), weights=weights, norms=found.norms)


def _grown(
    found: BuiltModel, smaller: BlockStructure, structure: BlockStructure, training: Training, ways: _Ways
) -> list[Begun]:
    """Starts at which the structure is what one with fewer states has found, the states more at some radii.

    There are none where the equations differ by more than these states.
    """
    inputs, begins = found.mapping.inputs, []
    text = Text(taken=frozenset((*inputs, *found.mapping.outputs)))
    for pole in _poles(ways.slowest)[: None if training.n_starts > 1 else 1]:
        values = grown(found.parameters, smaller, structure, n_inputs=len(inputs), pole=pole, name=text.name)
        if set(values) != set(ways.names):
            return []
        parameters = np.array([values[one] for one in ways.names])
        weights = found.theta[len(found.grey.free) :]
        begins.append(Begun(parameters=parameters, weights=weights, norms=found.norms))
    return begins


def _poles(slowest: float) -> list[float]:
    """Poles that are added: of a time constant between the fastest and the slowest, and of these."""
    longest = max(SLOWER * slowest, 2.0)
    return [float(np.exp(-1.0 / constant)) for constant in (np.sqrt(longest), longest, 1.0)]


def with_equations(found: FitResult) -> FitResult:
    """A fit whose notes have its equations, with the numbers that were found."""
    model = found.model
    assert isinstance(model, BuiltModel)  # noqa: S101 - the template is one
    return replace(found, notes=(*found.notes, *model.equations.splitlines()))
