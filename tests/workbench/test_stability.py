"""What a pipeline does with the check of a free run: who is asked, what is said, where the sequences come from."""

from dataclasses import replace

import numpy as np
import pytest

from sysid.estimation import FitResult, Loop, Status
from sysid.models import ARX, ARXModel, Mapping
from sysid.traces import Channel, Trace
from sysid.workbench.stability import StabilityCheck, StabilityConfig

MAPPING = Mapping.parse("u -> y")


def model(pole: float = 0.9) -> ARXModel:
    return ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([abs(1.0 - pole), pole]), intercept=0.0,
        mapping=MAPPING, sample_time=0.5, input_units=("V",), output_unit="V", rest_output=0.0,
    )  # fmt: skip


def trace(seed: int = 0) -> Trace:
    u = np.repeat(np.random.default_rng(seed).choice([0.0, 0.5, 1.0], 10), 200)
    u[:200] = 0.0
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    values = np.column_stack([u, model().simulate(u[:, None])])
    return Trace(name=f"trace {seed}", sample_time=0.5, channels=channels, values=values)


def fit(of: ARXModel, status: Status = Status.CONVERGED) -> FitResult:
    return FitResult(model=of, status=status, loop=Loop.CLOSED, history={}, train_time_s=0.0)


def check(declared=(), **fields) -> StabilityCheck:
    return StabilityCheck.of(StabilityConfig(count=20, **fields), MAPPING, [trace()], declared)


def test_a_stable_fit_keeps_its_status_and_says_what_was_found():
    found = check().applied(fit(model()))
    assert found.status is Status.CONVERGED
    assert found.stability is not None
    assert found.stability["sequences"] == 20
    assert found.notes[-1] == found.stability["text"]
    assert FitResult.from_dict(found.to_dict()).stability == found.stability


def test_an_unstable_fit_says_so_in_its_status():
    found = check().applied(fit(model(1.05)))
    assert found.status is Status.UNSTABLE
    assert found.stability is not None
    assert found.stability["unbounded"] == 20


def test_an_interrupted_fit_stays_interrupted_so_that_it_is_done_again():
    assert check().applied(fit(model(1.05), Status.INTERRUPTED)).status is Status.INTERRUPTED


def test_each_model_is_run_once():
    one = check()
    first, again = model(), model(1.05)
    assert (one.passes(first), one.passes(first), one.passes(again)) == (True, True, False)
    assert len(one.found) == 2
    assert one.applied(fit(again)).status is Status.UNSTABLE
    assert len(one.found) == 2


def test_a_count_of_zero_asks_nothing():
    nothing = StabilityCheck.of(StabilityConfig(count=0), MAPPING, [trace()], ())
    assert nothing.passes(model(1.05))
    assert nothing.applied(fit(model(1.05))).stability is None


def test_declared_traces_are_run_as_they_are():
    declared = check(declared=[trace(seed) for seed in (1, 2, 3)], sequences="random-commands")
    found = declared.applied(fit(model()))
    assert found.stability is not None
    assert (found.stability["sequences"], found.stability["largest_plateau_error"]) == (3, pytest.approx(0.0, abs=1e-9))
    assert "random-commands" in found.stability["source"]


def test_traces_too_short_for_excursions_are_not_checked():
    short = replace(trace(), values=trace().values[:10])
    nothing = StabilityCheck.of(StabilityConfig(), MAPPING, [short], ())
    assert nothing.applied(fit(model())).stability is None


@pytest.mark.parametrize(
    ("choose", "loop", "asked"),
    [
        pytest.param(True, Loop.CLOSED, True, id="a closed loop gives way to a stable one"),
        pytest.param(True, Loop.OPEN, False, id="an open loop is not made to run free"),
        pytest.param(False, Loop.CLOSED, False, id="the pipeline takes the best as it is"),
    ],
)
def test_who_is_asked_to_be_stable(choose: bool, loop: Loop, asked: bool) -> None:
    check = StabilityCheck(config=StabilityConfig(choose=choose), sequences=None)
    assert (check.vet(loop) is not None) == asked
