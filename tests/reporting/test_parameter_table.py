"""The table of the parameters of equations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid.estimation import FitResult, Loop, Status
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import FittedProcess, Mapping, ProcessModel, Scaling
from sysid.reporting.fit_records import FitRecord
from sysid.reporting.sections.parameter_table import parameter_tables
from tests.export.grey_boxes import GREY_BOXES

KNOWN = Uncertainty(
    names=("top [V]", "rate"), values=np.array([3.0, 0.5]), covariance=np.array([[0.25, 0.0], [0.0, np.nan]]),
    noise_variance=1.0, profile=np.array([[2.25, np.inf], [0.125, 0.75]]),
)  # fmt: skip
STORED = FitResult(
    model=GREY_BOXES["tanks"](), status=Status.CONVERGED, loop=Loop.CLOSED, train_time_s=1.0, history={},
    uncertainty=KNOWN,
)  # fmt: skip


def test_it_has_both_kinds_of_intervals_and_says_where_there_is_none() -> None:
    (table,) = parameter_tables(FitRecord.model_construct(name="sensor", cases={}), STORED)
    assert [name for name, _ in table.head][-2:] == ["95 % interval", "95 % interval"]
    assert [[cell.text for cell in row] for row in table.rows] == [
        ["top [V]", "3.0000", "0.500", "2.0200 to 3.9800", "2.2500 to infinite"],
        ["rate", "0.50000", "none", "none", "0.12500 to 0.75000"],
    ]


def test_parameters_of_a_process_model_have_their_units() -> None:
    model = FittedProcess.of(
        ProcessModel(type="P1D"), [np.array([2.0, 3.0, 0.5])], constant=1.0, level=np.zeros(1),
        scaling=Scaling.identity(1), mapping=Mapping.parse("u -> y"), sample_time=0.5, input_units=("V",),
        output_unit="m", rest_output=1.0,
    )  # fmt: skip
    known = Uncertainty(
        names=("K", "Tp1", "Td", "constant"), values=np.array([2.0, 3.0, 0.5, 1.0]),
        covariance=np.diag([0.01, 0.04, np.nan, 0.01]), noise_variance=1.0,
    )  # fmt: skip
    fit = FitRecord.model_construct(name="valve", cases={})
    (table,) = parameter_tables(fit, replace(STORED, model=model, uncertainty=known))
    assert [row[0].text for row in table.rows] == ["K [m/V]", "Tp1 [s]", "Td [s]", "constant [m]"]
    assert table.rows[2][3].text == "none"


def test_without_profiles_there_is_one_and_without_names_no_table() -> None:
    fit = FitRecord.model_construct(name="sensor", cases={})
    (table,) = parameter_tables(fit, replace(STORED, uncertainty=replace(KNOWN, profile=None)))
    assert {len(row) for row in (table.head, *table.rows)} == {4}
    assert parameter_tables(fit, replace(STORED, uncertainty=None)) == []
