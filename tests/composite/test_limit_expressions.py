"""Limits that are expressions: fixed submodels in every instance, which hold what they are limits of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.composite import Composite, fixed_model, with_fixed
from sysid.composite.members import assembled
from sysid.errors import ConfigError
from sysid.models import Limit, Mapping
from sysid.traces import Channel, Trace
from tests.composite.composites import models, pipe, trace


def held(**limits: Limit) -> Composite:
    return pipe(limits=limits)


def test_an_expression_holds_the_output_in_every_instance():
    between = Limit(low="min(STP, 0.5*AR[k-1] + 30)", high="max(BP, 70)")
    composite = held(AR=between, BP9=Limit(high="clamp(2*STP, 75, 80)"))
    assert [one.outputs for one in composite.fixed] == [["AR low", "AR low9"], ["AR high", "AR high9"], ["BP9 high"]]
    assert composite.limits["AR"] == Limit(low="AR low", high="AR high")
    record = trace()
    fixed = {one.output: fixed_model(one, record) for one in composite.fixed}
    whole = assembled(composite, {**models(), **fixed})
    run, levels = whole.simulate_trace(record), whole.levels(record.columns(whole.inputs)[0])
    for there in ("", "9"):
        level = levels[whole.wiring.channels.index(f"AR{there}")]
        held_at, before = run[f"AR{there}"], np.concatenate([[level], run[f"AR{there}"][:-1]])
        low, high = np.minimum(run["STP"], 0.5 * before + 30.0), np.maximum(run[f"BP{there}"], 70.0)
        np.testing.assert_allclose(run[f"AR low{there}"], low, rtol=1e-13)
        np.testing.assert_array_equal(run[f"AR high{there}"], high)
        assert np.all(held_at >= run[f"AR low{there}"])
        assert np.all((held_at <= high) | (held_at == run[f"AR low{there}"]))
    assert run["BP9"].max() <= 80.0
    assert {run.units[one] for one in ("AR low", "AR high9", "BP9 high")} == {"psi"}


def test_what_a_limit_says_of_a_trace_has_the_unit_of_what_it_limits():
    channels = tuple(Channel(name=name, unit="psi") for name in ("STP", "BP", "AR", "BP9", "AR9"))
    record = Trace(name="t", sample_time=0.1, channels=channels, values=np.full((3, 5), 4.0))
    (seen,) = with_fixed(held(AR=Limit(high="2*BP")).fixed, [record])
    assert seen["AR high9"].tolist() == [8.0] * 3
    assert seen.channel("AR high").unit == "psi"


def test_names_and_numbers_stay_as_they_are():
    limits = {"AR": Limit(low=12.0, high="BP"), "BP": Limit(high="STP")}
    composite = held(**limits)
    assert (composite.fixed, composite.limits) == ((), limits)
    odd = replace(composite.members[0], mapping=Mapping(inputs=("STP-1",), output="BP"))
    assert Composite(members=(odd,), limits={"BP": Limit(high="STP-1")}).fixed == ()


@pytest.mark.parametrize(
    ("text", "says"),
    [("min(BP", "arguments of min do not end"), ("foo(BP)", "no function foo"), ("net(BP, neurons=2)", "net within")],
)
def test_what_is_no_expression_names_its_output(text, says):
    with pytest.raises(ConfigError, match=f"(?s){says}.*limits of AR"):
        held(AR=Limit(low=text))
