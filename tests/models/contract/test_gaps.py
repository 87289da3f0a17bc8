"""Masked samples: nothing depends on what stands there, and a prediction knows behind them what can be known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import sysid
from sysid.models import Start, StartKind
from sysid.models.channels.history import bridged
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.validation.evaluation import evaluate
from sysid.validation.residuals import analyse_residuals

N = 400
RNG = np.random.default_rng(1)
U = np.repeat(RNG.uniform(-1.0, 1.0, N // 5), 5)
E = 0.1 * RNG.standard_normal(N)
Y, GAPS = np.zeros(N), np.zeros(N, dtype=bool)
for _k in range(1, N):
    Y[_k] = 0.8 * Y[_k - 1] + 0.2 * U[_k - 1] + E[_k] + 0.5 * E[_k - 1]
for _first, _last in ((90, 93), (150, 170), (300, 301)):
    GAPS[_first:_last] = True


def _record(filling: float, masked: np.ndarray = GAPS) -> TraceSet:
    channels = tuple(Channel(name=name, unit="1") for name in "uy")
    values = np.column_stack([U, np.where(masked, filling, Y)])
    trace = Trace(name="r", sample_time=0.1, channels=channels, values=values, usable=~masked)
    return TraceSet(name="s", traces=(trace,), roles={"r": Role.ESTIMATION})


STRUCTURES = {
    "ARX": (sysid.ARX(na=1, nb=(1,), nk=(1,)), None),
    "ARMAX": (sysid.ARMAX(na=1, nb=(1,), nk=(1,), nc=1), None),
    "state space": (sysid.LinearStateSpace(states=1), None),
    "NARX": (sysid.NARX(input_delays="1:1", output_delays=1, neurons=1), sysid.Training(max_iterations=3, starts=1)),
    "polynomial": (sysid.PolynomialNARX(input_delays="1:1", output_delays=1, degree=1, terms=2), None),
}


@pytest.mark.parametrize(("structure", "training"), STRUCTURES.values(), ids=STRUCTURES)
def test_nothing_depends_on_what_stands_in_a_gap(structure: object, training: object) -> None:
    found = []
    for filling in (0.0, 99.0):
        record = _record(filling)
        fit = sysid.fit(record, "u -> y", structure, training, stability=sysid.StabilityOptions(count=0))  # type: ignore[arg-type]
        case = evaluate(fit.model, record, Start(), repeats=0).cases["r"]
        whites = analyse_residuals(fit.model, record.traces, Start())
        found.append([case.free_run.mse, case.one_step.mse, whites.variance])
    assert_array_equal(found[0], found[1])


def test_behind_a_gap_a_predictor_goes_on_from_its_own_prediction() -> None:
    record = _record(99.0)
    model = sysid.fit(record, "u -> y", sysid.ARX(na=1, nb=(1,), nk=(1,))).model
    case = evaluate(model, record, Start(), repeats=0).cases["r"]
    b, a = model.coefficients
    y = Y[89]
    for k in range(90, 94):
        y = a * y + b * U[k - 1] + model.intercept
    assert_allclose(case.predicted[93 - case.first], y, atol=1e-9)


def test_a_gap_is_bridged_by_a_line_in_each_column() -> None:
    output = np.array([[0.0, 5.0], [9.0, 9.0], [2.0, 9.0], [3.0, 8.0]])
    usable = np.array([[True, True], [False, False], [True, False], [True, True]])
    assert bridged(output, usable).tolist() == [[0.0, 5.0], [1.0, 6.0], [2.0, 7.0], [3.0, 8.0]]
    assert bridged(output, np.zeros((4, 2), dtype=bool)) is output


def test_nor_on_what_stands_in_a_gap_of_a_measured_beginning() -> None:
    start, masked, found = Start(kind=StartKind.MEASURED, n_measured=5), np.arange(N) // 2 == 2, []
    for filling in (0.0, 99.0):
        record = _record(filling, masked)
        fit = sysid.fit(record, "u -> y", sysid.ARX(na=1, nb=(1,), nk=(1,)), start=start)
        case = evaluate(fit.model, record, start, repeats=0).cases["r"]
        found.append([case.free_run.mse, case.one_step.mse])
    assert_array_equal(found[0], found[1])
