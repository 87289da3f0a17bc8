"""What a bundle says of its free run."""

from __future__ import annotations

import numpy as np

from sysid.export.stability import check_free_run
from sysid.models import ARX, ARXModel, Mapping
from sysid.traces import Role, TraceSet
from tests.estimation.linear_systems import trace_of


def test_an_export_does_not_call_an_integrator_unstable() -> None:
    """Its excursions leave what was recorded, as the fit's own check knows."""
    u = np.repeat(np.random.default_rng(0).normal(size=12), 5)
    trace = trace_of(u[:, None], np.concatenate([[0.0], np.cumsum(0.1 * u)[:-1]]), name="e")
    traces = TraceSet(name="t", traces=(trace,), roles={"e": Role.ESTIMATION})
    model = ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(1,)), coefficients=np.array([0.1, 1.0]), intercept=0.0,
        mapping=Mapping.parse("u1 -> y"), sample_time=1.0, input_units=("1",), output_unit="1", rest_output=0.0,
    )  # fmt: skip
    found = check_free_run(model, traces)
    assert found is not None
    assert found.unbounded == 0
