"""How far a fit to a frequency response is off at frequencies that were left out of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.api.measured_responses.problem import ResponseProblem
from sysid.estimation import FitResult, TransferFunctionTraining
from sysid.models import TransferFunction, TransferFunctionModel

FOLDS = 5
"""Parts of the frequencies, of which one is left out."""


def left_out_errors(problem: ResponseProblem, structure: TransferFunction, fit: FitResult) -> NDArray[np.float64]:
    """The weighted squared error of each point in a fit without it and others as far apart.

    Args:
        problem: The response, and what counts of its errors.
        structure: What was fitted.
        fit: The fit to all points; its dead time is kept.

    Returns:
        Shape ``(n_points,)``.

    Raises:
        UserError: If the points that are left are too few.
    """
    model = fit.model
    assert isinstance(model, TransferFunctionModel)  # noqa: S101 - no other is fitted to a response
    if not model.stable:  # within the stable region its poles would not be begun where they are
        problem = replace(problem, training=replace(problem.training or TransferFunctionTraining(), stable=False))
    w, fixed = problem.measured.frequency, replace(structure, delays=model.delays)
    part, errors = np.arange(len(w)) % FOLDS, np.empty(len(w))
    for fold in range(FOLDS):
        out = part == fold
        found = problem.fit_at(fixed, model.sample_time, begin=model, kept=~out).model
        assert isinstance(found, TransferFunctionModel)  # noqa: S101 - as above
        errors[out] = np.abs(found.response(0, w[out]) - problem.measured.values[out]) ** 2
    return np.asarray(problem.weights * errors)
