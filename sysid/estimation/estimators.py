"""The table of estimators: for each kind of structure how it is fitted, what it takes, and how the fit is checked.

Python, pipelines, sweeps and assemblies fit through :func:`fit` and refuse through :func:`check`, so that the same
request has the same answer at every door. A new structure is a file in :mod:`sysid.models`, a file with its estimator,
and a row here.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from functools import partial
from typing import Any

from sysid.errors import ConfigError, shortened
from sysid.estimation.blocks.fit import STARTS as BLOCK_STARTS
from sysid.estimation.blocks.fit import check_training as check_block_training
from sysid.estimation.blocks.fit import fit_blocks
from sysid.estimation.blocks.polynomial_narx import check_training as check_polynomial_narx
from sysid.estimation.blocks.polynomial_narx import fit_polynomial_narx
from sysid.estimation.estimator import Estimator, Options
from sysid.estimation.grey_box.fit import STARTS as GREY_STARTS
from sysid.estimation.grey_box.fit import check_training as check_grey_training
from sysid.estimation.grey_box.fit import fit_grey_box
from sysid.estimation.least_squares.checkpoint import Checkpoint
from sysid.estimation.linear.arx import fit_arx
from sysid.estimation.linear.polynomial.fit import PolynomialTraining, fit_polynomial
from sysid.estimation.linear.process.fit import fit_process
from sysid.estimation.linear.state_space.fit import fit_state_space
from sysid.estimation.linear.state_space.training import StateSpaceTraining
from sysid.estimation.linear.transfer_function import fit_transfer_function
from sysid.estimation.linear.transfer_function_training import TransferFunctionTraining
from sysid.estimation.linear.vector_arx import fit_vector_arx
from sysid.estimation.linear_posteriors import (
    arx_posterior,
    polynomial_posterior,
    process_posterior,
    state_space_posterior,
    transfer_function_posterior,
    vector_arx_posterior,
)
from sysid.estimation.networks.narx import fit_narx
from sysid.estimation.networks.neural.state_space import (
    STARTS,
    check_neural_initial,
    check_training,
    fit_neural_state_space,
)
from sysid.estimation.networks.training import FitProgress, Training, check_lagged
from sysid.estimation.networks.warm_start import check_initial
from sysid.estimation.results.result import FitResult
from sysid.estimation.stability.check import (
    PoleCheck,
    StabilityOptions,
)
from sysid.models import (
    ARMAX,
    ARX,
    BJ,
    NARX,
    OE,
    AbstractModel,
    AbstractStructure,
    GreyBox,
    HammersteinWiener,
    LinearStateSpace,
    Mapping,
    NeuralStateSpace,
    PolynomialNARX,
    ProcessModel,
    Start,
    TransferFunction,
    VectorARX,
    VectorGreyBox,
    VectorNARX,
    VectorNeuralStateSpace,
    VectorStateSpace,
    WienerHammerstein,
)
from sysid.traces import Trace

GROWING = "the free run grows without bound, and with it every error of a parameter"
ENDED = "training ended before there was evidence of how well the records determine the weights (some 20 iterations)"
OF_STATES = f"{GROWING}, or a subspace method alone gave it, whose covariance is not known"
OF_POLYNOMIALS = f"{GROWING}, or its noise is integrated and drifts as far"
LINEAR_START = "a linear model finds its own start"

_linear = partial(Estimator, begins=LINEAR_START, stability=PoleCheck)
_trained = partial(Estimator, training=Training, no_posterior=ENDED)

ESTIMATORS: dict[str, Estimator] = {
    row.kind: row
    for row in (
        _linear(structure=ARX, name="an ARX model", fit=fit_arx, posterior=arx_posterior, no_posterior=GROWING),
        _linear(
            structure=VectorARX,
            name="an ARX model of several outputs",
            fit=fit_vector_arx,
            posterior=vector_arx_posterior,
            no_posterior=GROWING,
        ),
        *(
            _trained(
                structure=structure,
                name=name,
                fit=fit_narx,
                check_training=partial(check_lagged, name),
                initial=check_initial,
                joins=structure is NARX,
                unites=True,
                twice=True,
            )
            for structure, name in ((NARX, "a NARX network"), (VectorNARX, "a NARX network of several outputs"))
        ),
        *(
            _trained(
                structure=structure,
                name=name,
                fit=fit_neural_state_space,
                check_training=check_training,
                initial=check_neural_initial,
                starts=STARTS,
                unites=True,
                each=True,
            )
            for structure, name in (
                (NeuralStateSpace, "a neural state space"),
                (VectorNeuralStateSpace, "a neural state space of several outputs"),
            )
        ),
        *(
            _trained(
                structure=structure,
                name=name,
                fit=fit_grey_box,
                check_training=check_grey_training,
                begins="a grey box begins at the starts of its parameters",
                starts=GREY_STARTS,
                each=True,
            )
            for structure, name in (
                (GreyBox, "a grey box"),
                (VectorGreyBox, "a grey box of several outputs"),
            )
        ),
        *(
            _trained(
                structure=structure,
                name=name,
                fit=fit_blocks,
                check_training=check_block_training,
                begins="a block-oriented model begins at the best linear one",
                starts=BLOCK_STARTS,
            )
            for structure, name in (
                (HammersteinWiener, "a Hammerstein-Wiener model"),
                (WienerHammerstein, "a Wiener-Hammerstein model"),
            )
        ),
        _trained(
            structure=PolynomialNARX,
            name="a polynomial NARX model",
            fit=fit_polynomial_narx,
            check_training=check_polynomial_narx,
            begins="a polynomial NARX model begins at the terms that explain most one step ahead",
        ),
        _linear(
            structure=TransferFunction,
            name="a transfer function",
            fit=fit_transfer_function,
            training=TransferFunctionTraining,
            of_residuals="A transfer function here has no model of the noise: one step ahead it does what it does in "
            "free run, and its residuals need not be white, only independent of the inputs.",
            posterior=transfer_function_posterior,
            no_posterior=f"{GROWING}, or it was fitted through a predictor, whose covariance is not known",
        ),
        _linear(
            structure=ProcessModel,
            name="a process model",
            fit=fit_process,
            of_residuals="A process model has no model of the noise: one step ahead it does what it does in free run, "
            "and its residuals need not be white, only independent of the inputs.",
            posterior=process_posterior,
            no_posterior=GROWING,
        ),
        *(
            _linear(
                structure=structure,
                name=name,
                fit=fit_state_space,
                training=StateSpaceTraining,
                posterior=state_space_posterior,
                no_posterior=OF_STATES,
            )
            for structure, name in (
                (LinearStateSpace, "a linear state space"),
                (VectorStateSpace, "a linear state space of several outputs"),
            )
        ),
        *(
            _linear(
                structure=structure,
                name=name,
                fit=fit_polynomial,
                training=PolynomialTraining,
                posterior=polynomial_posterior,
                no_posterior=OF_POLYNOMIALS,
            )
            for structure, name in ((OE, "an OE model"), (BJ, "a Box-Jenkins model"), (ARMAX, "an ARMAX model"))
        ),
    )
}
"""By kind of structure how it is fitted."""

JOINING = tuple(kind for kind, row in ESTIMATORS.items() if row.joins)
"""Kinds whose models can be members of a whole."""


def estimator_of(structure: AbstractStructure) -> Estimator:
    """The row of a structure.

    Args:
        structure: The structure.

    Returns:
        Its row.

    Raises:
        ConfigError: If no estimator belongs to it.
    """
    found = ESTIMATORS.get(getattr(structure, "kind", ""))
    if found is None or not isinstance(structure, found.structure):
        raise ConfigError(
            "no estimator belongs to the structure",
            where="structure",
            expected=", ".join(row.structure.__name__ for row in ESTIMATORS.values()),
            got=f"the class {structure.__name__}" if isinstance(structure, type) else shortened(structure, limit=60),
            remedy="choose one of these, with its numbers, as in ARX(na=2, nb=2, nk=1)",
        )
    return found


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
