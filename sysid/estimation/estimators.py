"""The table of estimators: for each kind of structure how it is fitted, what it takes, and how the fit is checked.

A new structure is a file in :mod:`sysid.models`, a file with its estimator, and a row here;
:mod:`sysid.estimation.fitting` is the door through which all are asked.
"""

from __future__ import annotations

from functools import partial

from sysid.errors import ConfigError, shortened
from sysid.estimation.blocks.fit import STARTS as BLOCK_STARTS
from sysid.estimation.blocks.fit import check_training as check_block_training
from sysid.estimation.blocks.fit import fit_blocks
from sysid.estimation.blocks.polynomial_narx import check_training as check_polynomial_narx
from sysid.estimation.blocks.polynomial_narx import fit_polynomial_narx
from sysid.estimation.estimator import Estimator
from sysid.estimation.grey_box.fit import STARTS as GREY_STARTS
from sysid.estimation.grey_box.fit import check_training as check_grey_training
from sysid.estimation.grey_box.fit import fit_grey_box
from sysid.estimation.linear.arx import fit_arx
from sysid.estimation.linear.polynomial.fit import PolynomialTraining, fit_polynomial
from sysid.estimation.linear.process.fit import fit_process
from sysid.estimation.linear.state_space.fit import fit_state_space
from sysid.estimation.linear.state_space.training import StateSpaceTraining
from sysid.estimation.linear.transfer_function.fit import fit_transfer_function
from sysid.estimation.linear.transfer_function.training import TransferFunctionTraining
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
from sysid.estimation.networks.training import Training, check_lagged
from sysid.estimation.networks.warm_start import check_initial
from sysid.estimation.stability.check import (
    PoleCheck,
)
from sysid.models import (
    ARMAX,
    ARX,
    BJ,
    NARX,
    OE,
    AbstractStructure,
    GreyBox,
    HammersteinWiener,
    LinearStateSpace,
    NeuralStateSpace,
    PolynomialNARX,
    ProcessModel,
    TransferFunction,
    VectorARX,
    VectorGreyBox,
    VectorNARX,
    VectorNeuralStateSpace,
    VectorStateSpace,
    WienerHammerstein,
)

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
            each=True,
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
