"""Block-oriented models of traces: equations from the best linear model, fitted as any grey box."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.blocks.equations import hammerstein_wiener, wiener_hammerstein
from sysid.estimation.blocks.linear_start import LinearStart, integrating_start, linear_start, parted, shifted, whole
from sysid.estimation.clock import now
from sysid.estimation.grey_box.fit import built_template, fit_equations
from sysid.estimation.networks.training import FitProgress, Training, check_hidden_states
from sysid.estimation.result import FitResult
from sysid.models import BuiltModel, GreyBox, HammersteinWiener, Mapping, Start, WienerHammerstein
from sysid.models.block_oriented import BlockStructure
from sysid.traces import Trace

STARTS = 4
"""Starts of a fit that asks for none: for two blocks, ways to part the linear model; else draws of the curves."""

LINEAR = 0.2
"""Share of a fit's time that each of its linear models may take."""

check_training = partial(check_hidden_states, "a block-oriented model")
"""Refuses options that do not apply to hidden states."""


def fit_hammerstein_wiener(
    traces: Sequence[Trace],
    mapping: Mapping,
    structure: HammersteinWiener,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    selection: Sequence[Trace] = (),
    vet: Callable[[Any], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit a linear block with curves around it by the least error of the free run.

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
    began, training = now(), (training or Training()).with_starts(STARTS)
    rectified = structure.output.kind == "absolute"
    begun = _begun(
        traces, mapping, structure, structure.states, start=start, rest_output=rest_output, rectified=rectified,
        seconds=LINEAR * training.max_time_s,
    )  # fmt: skip
    lags, ways = structure.lags(len(mapping.inputs)), [begun]
    if begun.integrates and not rectified:
        late = shifted(traces, mapping, lags)
        stepping = integrating_start(
            late, mapping, structure.states, start=start or Start(), scaling=begun.scaling,
            seconds=LINEAR * training.max_time_s,
        )  # fmt: skip
        ways.insert(0, stepping)
    direct = [lag == 0 for lag in lags]
    (grey, curved), *others = [hammerstein_wiener(structure, mapping, one, whole(one, direct=direct)) for one in ways]
    template, experiments = built_template(
        traces, mapping, grey, built_of=structure, start=start or Start(), rest_output=rest_output
    )
    found = fit_equations(
        template, experiments, training, (traces, selection, start or Start()),
        others=_starts_of([one for one, _ in others]), scattered=curved, began=began, vet=vet, on_progress=on_progress,
    )  # fmt: skip
    return with_equations(found)


def fit_wiener_hammerstein(
    traces: Sequence[Trace],
    mapping: Mapping,
    structure: WienerHammerstein,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    selection: Sequence[Trace] = (),
    vet: Callable[[Any], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit a curve between two linear blocks; see :func:`fit_hammerstein_wiener`.

    The starts are ways to part the best linear model around the curve, the most promising first.
    """
    began = now()
    training = (training or Training()).with_starts(STARTS)
    begun = _begun(
        traces, mapping, structure, structure.first + structure.second, start=start, rest_output=rest_output,
        seconds=LINEAR * training.max_time_s,
    )  # fmt: skip
    direct = [lag == 0 for lag in structure.lags(len(mapping.inputs))]
    longest = max(shifted(traces, mapping, structure.lags(len(mapping.inputs))), key=len)
    signals = (
        begun.scaling.scale_inputs(longest.columns(mapping.inputs)),
        begun.scaling.scale_output(longest[mapping.output]),
    )
    rng = np.random.default_rng(training.seed)
    seconds = LINEAR * training.max_time_s
    ways = parted(begun, structure.first, signals, direct=direct, rng=rng, seconds=seconds)[: training.n_starts]
    greys = [wiener_hammerstein(structure, mapping, begun, pair)[0] for pair in ways]
    template, experiments = built_template(
        traces, mapping, greys[0], built_of=structure, start=start or Start(), rest_output=rest_output
    )
    found = fit_equations(
        template, experiments, training, (traces, selection, start or Start()),
        others=_starts_of(greys[1:]), scattered=frozenset(), began=began, vet=vet, on_progress=on_progress,
    )  # fmt: skip
    return with_equations(found)


def _starts_of(greys: Sequence[GreyBox]) -> list[NDArray[np.float64]]:
    """Where the parameters of the same equations begin otherwise."""
    return [np.array([one.start for one in grey.free]) for grey in greys]


def with_equations(found: FitResult) -> FitResult:
    """A fit whose notes have its equations, with the numbers that were found."""
    model = found.model
    assert isinstance(model, BuiltModel)  # noqa: S101 - the template is one
    return replace(found, notes=(*found.notes, *model.equations.splitlines()))


def _begun(
    traces: Sequence[Trace],
    mapping: Mapping,
    structure: BlockStructure,
    states: int,
    *,
    start: Start | None,
    rest_output: float | None,
    seconds: float,
    rectified: bool = False,
) -> LinearStart:
    late = shifted(traces, mapping, structure.lags(len(mapping.inputs)))
    output = "absolute" if rectified else "plain"
    return linear_start(
        late, mapping, states, start=start or Start(), rest_output=rest_output, output=output, seconds=seconds
    )
