"""The table of estimators by itself; what its doors have in common is in ``tests/workbench/test_doors.py``."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
import scipy

from sysid.errors import ConfigError
from sysid.estimation import StabilityOptions, Training
from sysid.estimation.estimators import ESTIMATORS, JOINING, estimator_of
from sysid.estimation.fitting import fit
from sysid.models import ARX, NARX, Mapping, NeuralStateSpace, Start
from sysid.traces import Trace
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
ORDERS = ARX(na=1, nb=(1,), nk=(1,))
NETWORK = NARX(input_delays=1, output_delays=1, neurons=1)


def trace(pole: float = 0.9) -> Trace:
    u, y = np.random.default_rng(0).normal(size=120), np.zeros(120)
    for t in range(119):
        y[t + 1] = pole * y[t] + 0.1 * u[t]
    return trace_of({"u": u, "y": y}, sample_time=0.5)


@pytest.mark.parametrize("structure", [NETWORK, NeuralStateSpace(states=1, neurons=1)], ids=["NARX", "NSS"])
def test_a_plain_fit_loads_nothing_heavy(structure, monkeypatch) -> None:
    """``scipy.signal`` alone takes some 40 MB with all that it loads, a tenth of what a million samples need."""
    for name in ("signal", "stats"):
        monkeypatch.delattr(scipy, name, raising=False)
    for name in ("scipy.signal", "scipy.stats", "pandas", "matplotlib", "mlflow", "torch"):
        monkeypatch.setitem(sys.modules, name, None)  # whoever imports it fails
    record = trace()
    noise = np.column_stack([np.zeros(120), 0.5 * np.random.default_rng(1).normal(size=120)])
    noisy = replace(record, values=record.values + np.cumsum(noise, axis=0))  # so that it is asked what is wrong
    found = fit([noisy], MAPPING, structure, training=Training(max_iterations=3, starts=1), stability=None)
    assert found.notes, "nothing was asked"


def test_a_structure_without_a_row_is_refused() -> None:
    with pytest.raises(ConfigError, match="no estimator belongs to the structure") as caught:
        estimator_of(object())  # type: ignore[arg-type]
    assert "VectorNARX" in str(caught.value.expected)


def test_a_row_says_what_its_function_knows() -> None:
    assert {kind for kind, row in ESTIMATORS.items() if row.selects} == {
        "GreyBox",
        "HammersteinWiener",
        "PolynomialNARX",
        "VectorGreyBox",
        "WienerHammerstein",
        "NARX",
        "NSS",
        "TransferFunction",
        "VectorNARX",
        "VectorNSS",
    }
    assert {kind for kind, row in ESTIMATORS.items() if row.resumes} == {"NARX", "VectorNARX"}
    assert set(JOINING) == {"NARX"}
    assert {kind for kind, row in ESTIMATORS.items() if row.linear} == {
        "ARX",
        "TransferFunction",
        "ProcessModel",
        "SS",
        "OE",
        "BJ",
        "ARMAX",
        "VectorARX",
        "VectorSS",
    }


def test_a_fit_without_intervals_says_which_reason_it_has() -> None:
    short = fit([trace()], MAPPING, NETWORK, Training(max_iterations=2))
    given = fit([trace()], MAPPING, NETWORK, Training(max_iterations=2, regularisation=0.1))
    reasons = [[note for note in found.notes if note.startswith("No interval")] for found in (short, given)]
    assert "training ended before there was evidence" in reasons[0][0]
    assert reasons[1] == ["No interval of the output: regularisation: 0.1 was given, not found by the evidence."]


@pytest.mark.parametrize(("structure", "training"), [(ORDERS, None), (NETWORK, Training(max_iterations=5, starts=1))])
def test_remarks_that_are_made_of_the_chosen_fit_alone_are_those_that_any_fit_has(
    structure: ARX | NARX, training: Training | None
) -> None:
    """Of many fits one is looked at; what its records say of it takes longer than most fits."""
    checked = StabilityOptions(count=5)
    whole = fit([trace()], MAPPING, structure, training, stability=checked)
    bare = fit([trace()], MAPPING, structure, training, stability=checked, remarks=False)
    assert set(bare.notes) < set(whole.notes)
    found = estimator_of(structure).remarked(bare, [trace()], MAPPING, training, start=Start())
    assert (found.notes, found.warnings, found.status) == (whole.notes, whole.warnings, whole.status)
    assert (found.posterior is None) == (whole.posterior is None)
