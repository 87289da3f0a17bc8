"""Parity: a file that does not reproduce its model is refused."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.errors import ParityError
from sysid.export import EXPORTERS, check_parity, parity_cases
from sysid.export.parity import largest_difference
from sysid.models import NARX, Start, StartKind


@pytest.mark.parametrize(
    ("output", "expected", "difference"),
    [
        pytest.param([1.0, 2.0], [1.0, 2.0], 0.0, id="equal"),
        pytest.param([1.0, 2.5], [1.0, 2.0], 0.5, id="one differs"),
        pytest.param([1.0, np.nan], [1.5, np.nan], 0.5, id="both not a number"),
        pytest.param([1.0, np.nan], [1.0, 2.0], np.inf, id="only the file not a number"),
        pytest.param([1.0, 2.0], [1.0, np.nan], np.inf, id="only the model not a number"),
        pytest.param([np.inf], [np.inf], 0.0, id="the same infinity"),
        pytest.param([np.inf], [-np.inf], np.inf, id="opposite infinities"),
        pytest.param([], [], 0.0, id="no samples"),
    ],
)
def test_largest_difference(output, expected, difference):
    assert largest_difference(np.array(output), np.array(expected)) == difference


@pytest.mark.parametrize(
    "begin",
    [Start(), Start(kind=StartKind.FIRST_SAMPLE), Start(kind=StartKind.MEASURED, n_measured=2)],
    ids=["at rest", "first sample", "measured, shorter than the lags"],
)
def test_files_of_the_model_pass_for_every_start(format_name, fit, traces, begin, tmp_path):
    cases = parity_cases(fit.model, traces, begin)
    for file in EXPORTERS[format_name].write(fit.model, tmp_path):
        parity = check_parity(file, tmp_path, fit.model, cases, 1e-9)
        assert parity.largest_difference <= parity.tolerance == 1e-9
        assert parity.case in traces.names
        assert parity.unit == "psi"
        assert parity.samples == sum(len(trace) for trace in traces) - 3 * begin.n_measured


def test_files_of_another_model_are_refused_with_the_worst_case(format_name, fit, traces, narx, tmp_path):
    other = narx(NARX(input_delays=4, output_delays=4, neurons=20), seed=99)
    cases = parity_cases(fit.model, traces, Start())
    worst = max(cases, key=lambda case: np.abs(other.simulate(case.inputs, case.history) - case.output).max())
    for file in EXPORTERS[format_name].write(other, tmp_path):
        with pytest.raises(ParityError, match=f"(?s){file.name} does not reproduce.*case {worst.name}"):
            check_parity(file, tmp_path, fit.model, cases, 1e-9)
