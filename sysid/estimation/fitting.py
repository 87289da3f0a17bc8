"""The door of the estimators: any structure is fitted, or refused, by its row of their table.

Python, pipelines, sweeps and assemblies fit through :func:`fit` and refuse through :func:`check`, so that the same
request has the same answer at every door.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from typing import Any

from sysid.errors import ConfigError, shortened
from sysid.estimation.estimator import Options
from sysid.estimation.estimators import estimator_of
from sysid.estimation.least_squares.checkpoint import Checkpoint
from sysid.estimation.networks.training import FitProgress
from sysid.estimation.results.result import FitResult
from sysid.estimation.stability.check import StabilityOptions
from sysid.models import AbstractModel, AbstractStructure, Mapping, Start
from sysid.traces import Trace


def check_given(initial: object, stability: object) -> None:
    """Refuse what is no fit to begin with, and what says nothing of how a free run is checked.

    Args:
        initial: What was given as a fit to start from.
        stability: What was given as options.

    Raises:
        ConfigError: If either is something else.
    """
    if not isinstance(initial, FitResult | None):
        raise ConfigError(
            "initial is a fit",
            where="initial",
            expected="what a fit has given",
            got=shortened(initial, limit=60),
            remedy="give the fit itself, and not its model or its structure",
        )
    if not isinstance(stability, StabilityOptions | None):
        raise ConfigError(
            "stability says how the free run is checked",
            where="stability",
            expected="StabilityOptions",
            got=shortened(stability, limit=60),
            remedy="write StabilityOptions(count=...); count=0 asks nothing",
        )


def check(
    structure: AbstractStructure,
    mapping: Mapping,
    *,
    training: object = None,
    initial: AbstractStructure | None = None,
) -> None:
    """Refuse what does not go together, before any data are read.

    Args:
        structure: What is to be fitted.
        mapping: Which channels go in, which come out.
        training: Its options, if any are given.
        initial: The structure of the fit that it is to start from, if there is one.

    Raises:
        ConfigError: If the structure is not for these channels, an option does not apply, or it cannot start there.
    """
    estimator_of(structure).check(training, initial, structure, mapping)


def fit(
    traces: Sequence[Trace],
    mapping: Mapping,
    structure: AbstractStructure,
    training: Options | None = None,
    *,
    start: Start | None = None,
    rest_output: float | Dict[str, float] | None = None,
    selection: Sequence[Trace] = (),
    initial: FitResult | None = None,
    stability: StabilityOptions | None = StabilityOptions(),  # noqa: B008 - frozen
    resume: Checkpoint | None = None,
    remarks: bool = True,
    on_checkpoint: Callable[[Checkpoint], None] = lambda _: None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit any structure by its estimator, and check the fit's free run.

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which come out; one comes out, unless the structure has several outputs.
        structure: What is fitted.
        training: Options of the class in the structure's row.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit, or by name; the mean of the traces' first samples by default.
        selection: Traces that choose between starts.
        initial: A fit to start from: of the same structure, a smaller one, or an ARX model over its lags.
        stability: How the free run is checked, by default over 1,000 random sequences; ``None`` checks nothing.
        resume: Where the fit of a single start was put aside; it goes on as if it had not been.
        remarks: Whether the posterior of a linear fit is made, and what the records say of the fit is told; the
            estimator's ``remarked`` makes them of a fit that has none.
        on_checkpoint: Given the checkpoint from which the chosen start can go on; never called where there is none.
        on_progress: Called after every iteration, from the threads that train.

    Returns:
        The fit; its status is ``UNSTABLE`` where its free run is.

    Raises:
        ConfigError: If what is asked does not go together.
        ChannelError: If a trace lacks a channel of the mapping.
    """
    row = estimator_of(structure)
    check_given(initial, stability)
    if not structure.several_outputs:
        mapping.check_single(row.name)
    begun = None if initial is None else initial.model.structure
    row.check(training, begun, structure, mapping)
    if initial is not None:
        _check_terms(initial.model, mapping, traces[0].sample_time)
    return row.run(
        traces,
        mapping,
        structure,
        training,
        stability,
        start=start or Start(),
        rest_output=_rest(rest_output, mapping, structure),
        selection=selection,
        initial=initial,
        resume=resume,
        remarks=remarks,
        on_checkpoint=on_checkpoint,
        on_progress=on_progress,
    )


def _rest(
    given: float | Dict[str, float] | None, mapping: Mapping, structure: AbstractStructure
) -> float | Dict[str, float] | None:
    """Outputs at rest as the estimator takes them: by name for several outputs, else one number."""
    if structure.several_outputs:
        return given if isinstance(given, Dict) or given is None else {mapping.output: given}
    return given.get(mapping.output) if isinstance(given, Dict) else given


def _check_terms(model: AbstractModel, mapping: Mapping, sample_time: float) -> None:
    """Refuse an initial fit whose lags are others' samples."""
    other = model.mapping != mapping
    if other or not math.isclose(model.sample_time, sample_time, rel_tol=1e-9):
        raise ConfigError(
            f"the initial fit {'is of another mapping' if other else 'has another sample time'}",
            where="initial",
            expected=f"{mapping}, every {sample_time:g} s",
            got=f"{model.mapping}, every {model.sample_time:g} s",
            remedy="start from a fit of this mapping, its inputs in this order and its samples as far apart, or leave "
            "initial out",
        )


def with_stability(fitted: FitResult, traces: Sequence[Trace], stability: StabilityOptions | None) -> FitResult:
    """A fit that was made without a check, with the check that :func:`fit` would have made of it.

    Args:
        fitted: The fit.
        traces: The estimation traces.
        stability: How its free run is checked.

    Returns:
        The fit, with what was found.
    """
    model = fitted.model
    if stability is None:
        return fitted
    return estimator_of(model.structure).stability.of(stability, model.mapping, traces).applied(fitted)


def seedless(options: Options | None) -> dict[str, Any] | None:
    """Options as plain values without the seed, to see whether two fits were asked for the same.

    Args:
        options: The options.

    Returns:
        Their fields.
    """
    return None if options is None else {**dataclasses.asdict(options), "seed": None}
