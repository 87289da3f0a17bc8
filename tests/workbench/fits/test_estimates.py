"""How long a fit will take is measured on little of it."""

from __future__ import annotations

import numpy as np
import pytest

import sysid
from sysid.estimation.stability import check
from sysid.traces import Role
from sysid.workbench.fits.config import FitConfig, PipelineConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.fits.estimates import FEW_SEQUENCES, how_long


def test_the_check_of_a_free_run_is_timed_on_a_few_of_its_sequences(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    real = check.check_stability
    monkeypatch.setattr(check, "check_stability", lambda *a, **named: asked.append(named["count"]) or real(*a, **named))
    u = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, 30), 10)
    y = np.convolve(u, 0.1 * 0.9 ** np.arange(300))[:300]
    traces = sysid.data((u, y), sample_time=1.0)
    structure = sysid.NARX(input_delays=1, output_delays=1, neurons=2)
    fit = FitConfig(name="a", structure=structure)
    config = PipelineConfig(name="p", data="d", mapping="u -> y", fits=(fit,))
    assert traces.with_role(Role.ESTIMATION)
    found = how_long(fit, config, Data(traces=traces, selection=()))
    assert asked == [1, FEW_SEQUENCES], "what only the first check does, as to load what is compiled, is not counted"
    assert found.seconds is not None
    assert found.seconds > 0.0
