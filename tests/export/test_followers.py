"""Where a committee is told to begin all its members begin, in every file that has a beginning of its own."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from sysid.composite import committee
from sysid.export import EXPORTERS, Surrogate
from sysid.export.c.exporter import _library
from sysid.export.measured_run import check_able, run_measured
from sysid.models import NARX, Start, StartKind
from tests.export.cascades import build_committee, wired_narx
from tests.export.languages.test_matlab import matlab, prefix_of, session  # noqa: F401

BEGUN = np.array([20.0, 41.0])
"""Another level than declared, of the outputs in their order."""


@pytest.fixture(scope="module", params=[False, True], ids=["the first answers", "the mean"])
def surrogate(request: pytest.FixtureRequest) -> Surrogate:
    return Surrogate.of(build_committee(2, mean=request.param), {"STP": (0.0, 80.0)}, outputs=["BC", "BP"])


@pytest.fixture(scope="module")
def state(surrogate: Surrogate) -> np.ndarray:
    """The state that such a beginning is; in it no member stands where it is declared to be."""
    first = np.array([60.0])
    state = surrogate.at_rest(first, surrogate.rest(first, BEGUN))
    names = [line.channel for line in surrogate.lines if line.channel.startswith(("BC", "BP_"))]
    assert len(set(names)) >= 3
    declared = surrogate.at_rest(first)
    for line in surrogate.lines:
        if line.channel.startswith(("BC_1", "BC_2", "BP_1", "BP_2")) and line.length:
            assert state[line.first] != declared[line.first], line.channel
    return state


def test_the_c_source_begins_all_of_them(surrogate: Surrogate, state: np.ndarray, tmp_path) -> None:
    file = EXPORTERS["c"].write(surrogate, tmp_path)[0]
    init = _library(file, tmp_path)[f"{surrogate.identifier}_init"]
    found = np.zeros(surrogate.state_size)
    places = [ctypes.c_void_p(one.ctypes.data) for one in (found, np.array([60.0]), BEGUN)]
    init(*places)
    np.testing.assert_allclose(found, state, rtol=1e-12, atol=1e-12)


def test_the_function_for_matlab_begins_all_of_them(surrogate: Surrogate, state: np.ndarray, matlab, tmp_path) -> None:  # noqa: F811
    matlab.write(surrogate, tmp_path)
    told = ", ".join(str(level) for level in BEGUN)
    (tmp_path / "begin.m").write_text(
        f"function [y, state, flags] = begin(u, ~)\nstate = {prefix_of(surrogate)}_rest(u(1, :), [{told}]);\n"
        f"[y, ~, flags] = {prefix_of(surrogate)}_run(u, state);\nend\n",
        encoding="utf-8",
    )
    process, u = session(), np.full((20, 1), 60.0)
    place = process.add(sorted(tmp_path.glob("*.m")))
    y, found, _ = process.run(place, "begin", u, np.zeros(surrogate.state_size), 2)
    np.testing.assert_allclose(found, state, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(y, surrogate.simulate(u, BEGUN), rtol=0.0, atol=1e-9)


def test_all_of_a_mean_begin_as_it_was_measured() -> None:
    """Without its spread nothing limits it, and it may begin by what was measured, as its members do."""
    structure = NARX(input_delays="0:1", output_delays=1, neurons=4)
    models = [wired_narx("STP -> BC", structure, seed) for seed in (1, 2)]
    surrogate = Surrogate.of(committee(models, mean=["BC"]).upstream_of(["BC"]))
    u, measured = np.full((12, 1), 60.0), {"BC": np.linspace(20.0, 25.0, 12)}
    start = Start(kind=StartKind.MEASURED, n_measured=5)
    check_able(surrogate.source, ["BC"], start, where="start")
    run = run_measured(surrogate, u, measured, start).computed[
        :, [port.name for port in surrogate.computed].index("BC")
    ]
    alone = [run_measured(Surrogate.of(one), u, measured, start).computed[:, 0] for one in models]
    np.testing.assert_allclose(run, np.mean(alone, axis=0), rtol=0.0, atol=1e-12)
    assert abs(run[5] - surrogate.simulate(u)[5, -1]) > 0.01
