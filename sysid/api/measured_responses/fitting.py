"""Fits to measured frequency responses: read one, fit a transfer function to it, draw both, write it as files."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from contextlib import suppress
from typing import Any

from sysid.api.estimates import FrequencyResponse
from sysid.api.measured_responses.left_out import left_out_errors
from sysid.api.measured_responses.orders import FEWEST, MOST, ResponseOrderSearch, search_orders_of
from sysid.api.measured_responses.problem import ResponseProblem, Weighting
from sysid.api.measured_responses.response_fit import ResponseFit, response_fit
from sysid.errors import ConfigError, UserError
from sysid.estimation import TransferFunctionTraining
from sysid.models import Domain, Mapping, TransferFunction
from sysid.traces.measured_response import MeasuredResponse


def response_data(
    source: Any,
    *,
    columns: Dict[str, str] | None = None,
    units: Dict[str, str] | None = None,
    name: str | None = None,
) -> MeasuredResponse:
    """A measured frequency response, from a file or a table; see :func:`sysid.ingest.responses.read_response`.

    Args:
        source: A file (CSV, Excel, MATLAB ...), a frame, or a dict of columns; their names say what they hold and in
            which unit, ``"freq [Hz]"``, ``"mag [dB]"``, ``"phase [deg]"``, or real and imaginary parts, or complex
            numbers; and ``"coherence"``.
        columns: Which column holds what, where their names do not say it: ``{"frequency": "f", "gain": "A"}``.
        units: Of ``frequency``, ``gain`` and ``phase``, where the columns do not say them; ``-deg`` and ``-rad`` of
            lags that are positive.
        name: What it is called.

    Returns:
        The response, its frequencies rising, in rad/s.

    Raises:
        UserError: If it cannot be read: what, where, and what to do.

    Warns:
        GuessedWarning: If a unit was guessed.

    Example:
        >>> swept = response_data({"freq [Hz]": [1, 10, 100], "mag [dB]": [0, -3, -20], "phase [deg]": [-6, -45, -84]})
        >>> print(swept)
        frequency response response: 3 points from 1 to 100 Hz
    """
    from sysid.ingest.responses import read_response

    return read_response(source, columns=columns, units=units, name=name)


def fit_response(
    response: MeasuredResponse | FrequencyResponse,
    structure: TransferFunction | None = None,
    mapping: str | Mapping | None = None,
    *,
    sample_time: float | None = None,
    weighting: str | Weighting = Weighting.NONE,
    units: Dict[str, str] | None = None,
    training: TransferFunctionTraining | None = None,
) -> ResponseFit:
    """Fit a transfer function to a measured frequency response (``tfest(frd, np, nz)``).

    Args:
        response: Of :func:`response_data`; or one of :func:`sysid.frequency_response`, of one input.
        structure: With one number of poles and zeros; a response has no level, so that it has no intercept. By default
            continuous ones of one to six poles are compared; see :func:`sysid.search_response_orders`.
        mapping: What input and output are called; ``"u -> y"`` by default.
        sample_time: Of the model in seconds, of which a dead time is a multiple. A continuous one has by default some
            20 samples in a period of the highest frequency, and so that they make the dead time that was found.
        weighting: What counts of the error at each frequency: ``"none"``, ``"relative"``, ``"root"`` or
            ``"coherence"``; see :class:`Weighting`.
        units: Of the input and the output, by name; ``"1"`` by default.
        training: How to fit.

    Returns:
        The fit.

    Raises:
        ConfigError: If the structure is no transfer function of one input, or an option does not apply.
        TraceError: If the orders do not fit the data.
        FitDivergedError: If no start gives a finite model.

    Example:
        >>> import numpy as np
        >>> w = np.geomspace(0.1, 100.0, 50)
        >>> swept = response_data({"w [rad/s]": w, "H": 3.0 / (1.0 + 0.2j * w)})
        >>> fit = fit_response(swept, TransferFunction(poles=(1,), zeros=(0,), delays=(0,), domain="continuous"))
        >>> round(fit.fit_percent, 3), fit.model.poles(0).round(6).tolist()
        (100.0, [(-5+0j)])
    """
    problem = ResponseProblem.of(
        response, mapping, sample_time=sample_time, weighting=weighting, units=units, training=training
    )
    if structure is None:
        return search_orders_of(problem).fit
    if not isinstance(structure, TransferFunction):
        raise ConfigError(
            "a frequency response is fitted by a transfer function",
            where="structure",
            expected="TransferFunction(poles=(2,), zeros=(1,), domain='continuous')",
            got=type(structure).__name__,
            remedy="give one; other structures are fitted to samples over time",
        )
    return fitted_structure(problem, structure)


def fitted_structure(problem: ResponseProblem, structure: TransferFunction) -> ResponseFit:
    """The fit of a structure, and how far it is off at frequencies that are left out of it.

    Args:
        problem: The response, and what counts of its errors.
        structure: Its orders.

    Returns:
        The fit.

    Raises:
        UserError: As :func:`fit_response` does.
    """
    found = problem.fitted(structure)
    with suppress(UserError):  # points that are just enough for all of them to be fitted
        return response_fit(problem, found, left_out_errors(problem, structure, found))
    return response_fit(problem, found)


def search_response_orders(
    response: MeasuredResponse | FrequencyResponse,
    poles: tuple[int, int] = (FEWEST, MOST),
    zeros: int | None = None,
    mapping: str | Mapping | None = None,
    *,
    delays: tuple[int, ...] | None = None,
    domain: str | Domain = Domain.CONTINUOUS,
    sample_time: float | None = None,
    weighting: str | Weighting = Weighting.NONE,
    units: Dict[str, str] | None = None,
    training: TransferFunctionTraining | None = None,
) -> ResponseOrderSearch:
    """How many poles and zeros does a measured frequency response ask for?

    Each fifth frequency in turn is left out of the fits, and the structure with the least error there is the best, with
    BIC's price of a parameter on top; see :mod:`sysid.api.measured_responses.orders`. The number of poles rises until
    two more say nothing.

    Args:
        response: As for :func:`fit_response`, as are those that are not named here.
        poles: The least and the largest number.
        zeros: Of all of them; by default one less than poles, and of the best number of poles fewer and as many, too.
        mapping: What input and output are called.
        delays: The dead time in samples; searched by default.
        domain: ``"continuous"`` or ``"discrete"``.
        sample_time: Of the models in seconds.
        weighting: What counts of the errors, in the fits and of those left out.
        units: Of the input and the output.
        training: How to fit.

    Returns:
        The search: its best structure, that one's fit, and a table.

    Raises:
        ConfigError: If the range is none, nothing can be fitted, or an option does not apply.

    Example:
        >>> import numpy as np
        >>> w = np.geomspace(0.1, 100.0, 50)
        >>> swept = response_data({"w [rad/s]": w, "H": 3.0 / (1.0 + 0.2j * w)})
        >>> found = search_response_orders(swept, poles=(1, 3), delays=(0,), sample_time=0.01)
        >>> found.best.poles, found.best.zeros
        ((1,), (0,))
    """
    problem = ResponseProblem.of(
        response, mapping, sample_time=sample_time, weighting=weighting, units=units, training=training
    )
    return search_orders_of(problem, poles, zeros, domain=Domain(domain), delays=delays)
