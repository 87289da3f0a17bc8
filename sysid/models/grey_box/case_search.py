"""The values of parameters by case that the first samples of a record show, where nobody fitted the case."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.models.channels.history import History
from sysid.models.contract.state_descent import LEAST_NOISE, StateSearch

if TYPE_CHECKING:
    from sysid.models.grey_box.equation_form import EquationForm

Array = NDArray[np.float64]

NOT_SHOWN = 0.5
"""Share of the variance that was expected of a value, above which the samples do not show it."""


def shown(form: EquationForm, history: History, record: str) -> tuple[float, ...]:
    """The values with which the free run over a history comes closest to its outputs, the state before it free too.

    Args:
        form: With parameters by case.
        history: More than one sample.
        record: Its name, for the error.

    Returns:
        One value for each parameter by case, in units.

    Raises:
        TraceError: If the samples do not show one of them: it would be what other cases have.
    """
    cases, terms, known = form.cases, form.terms, history.known
    assert cases is not None  # noqa: S101 - asked for by who calls
    u = form.given(history.inputs, history.inputs[:1])
    output = history.output.reshape(len(history.output), -1)
    open_, n = np.flatnonzero(~terms.fixed), len(cases.places)
    rest = form.with_constants(cases.expected).resting(u[0], output[0])
    p = int(cases.places.max()) + 1

    def misfit(xi: Array, derived: bool) -> tuple[Array, Array]:
        moved, x = form.with_constants(cases.expected + cases.scale * xi[:n]), rest.copy()
        x[open_] = terms.level[open_] + terms.scale[open_] * xi[n:]
        if derived:
            S = np.zeros((len(x), p + len(open_)))
            S[open_, p + np.arange(len(open_))] = terms.scale[open_]
            y, J = moved.moved(u, x, S, p)
            J = np.concatenate([J[:, :, cases.places] * cases.scale, J[:, :, p:]], axis=2)
            J /= form.output_scale[:, None]
        else:
            y, J = moved.run(u, x), np.empty((len(u), 0, 0))
        return ((y - output) / form.output_scale)[known].ravel(), J[known].reshape(-1, n + len(open_) * derived)

    scale = np.concatenate([cases.scale, terms.scale[open_]])
    level = np.concatenate([cases.expected, terms.level[open_]])
    low, high = (
        (np.concatenate(pair) - level) / scale
        for pair in ((cases.low, terms.low[open_]), (cases.high, terms.high[open_]))
    )
    expected = np.concatenate([np.zeros(n), (rest[open_] - terms.level[open_]) / terms.scale[open_]])
    found = StateSearch(misfit=misfit, low=low, high=high, expected=expected).found()
    away, J = misfit(found, True)
    noise = max(float(np.linalg.norm(away)) / max(len(away) - len(found), 1) ** 0.5, LEAST_NOISE)
    left = np.linalg.inv(J.T @ J / noise**2 + np.eye(len(found))).diagonal()[:n]
    for name, share in zip(cases.names, left, strict=True):
        if not share < NOT_SHOWN:
            raise TraceError(
                f"the first {len(output)} samples of {record} do not show its {name}",
                where=record,
                expected="samples in which the output moves with it",
                got=f"{100.0 * min(share, 1.0):.0f} % of its variance left",
                remedy=f"write start: {{measured: {2 * len(output)}}}, or more; or name {record} in cases: beside a "
                "record of the same case",
            )
    return tuple(float(value) for value in cases.expected + cases.scale * found[:n])
