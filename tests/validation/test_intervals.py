"""What an interval is asked of; what it holds is in the tests of posteriors."""

from __future__ import annotations

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError
from sysid.validation import predict_interval


def test_of_a_model_an_output_each_is_asked_by_its_name() -> None:
    rng = np.random.default_rng(0)
    u, y = rng.standard_normal(80), rng.standard_normal((80, 2))
    traces = sysid.data((u, y), sample_time=1.0)
    fit = sysid.fit(traces, "u -> y1+y2", sysid.ARX(na=1, nb=1, nk=1))
    with pytest.raises(ConfigError, match="an interval is of one model") as refused:
        predict_interval(fit, traces.traces[0])  # type: ignore[arg-type]  # on purpose
    assert 'fit["y1"]' in str(refused.value.remedy)
    found = predict_interval(fit["y1"], traces.traces[0])
    assert found.first + len(found.output) == 80
