"""The mean of several cascades, against the mean of their free runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.errors import ChannelError, ConfigError
from sysid.models import Cascade, Limit, cascade_from_dict, mean_of
from tests.models.cascades import CASCADES, command, network


def other(cascade: Cascade) -> Cascade:
    """The same wiring with slightly other weights."""
    return replace(cascade, models=tuple(replace(model, **_scaled(model)) for model in cascade.models))


def _scaled(model) -> dict[str, np.ndarray]:
    name = "coefficients" if hasattr(model, "coefficients") else "theta"
    return {name: 0.97 * getattr(model, name)}


@pytest.mark.parametrize("name", CASCADES)
def test_it_puts_out_the_mean_of_their_free_runs(name: str) -> None:
    parts = [CASCADES[name], other(CASCADES[name]), other(other(CASCADES[name]))]
    wanted = parts[0].outputs[-2:]
    u = command(inputs=len(parts[0].inputs))

    run = mean_of(parts, wanted).simulate(u)

    for output in wanted:
        alone = [one.simulate(u)[output] for one in parts]
        assert not np.allclose(alone[0], alone[1], atol=1e-3)
        assert_allclose(run[output], np.mean(alone, axis=0), rtol=0.0, atol=1e-10)
        assert_allclose([run[f"{output}_{k}"] for k in (1, 2, 3)], alone, rtol=0.0, atol=1e-10)


def test_it_is_a_cascade_like_any_other() -> None:
    parts = [CASCADES["limits"], other(CASCADES["limits"])]
    mean, u = mean_of(parts, ["BC"]), command()
    assert mean.inputs == ("STP",)
    assert mean.limits["BC_2"] == Limit(low=0.0, high="BP_2")
    assert cascade_from_dict(mean.to_dict()).to_dict() == mean.to_dict()
    assert mean.upstream_of(["BC_1"]).outputs == ("BP_1", "AR_1", "BC_1")
    assert_allclose(mean.simulate_batch(np.stack([u, u[::-1]]))["BC"][0], mean.simulate(u)["BC"], atol=1e-9)


def test_one_alone_is_itself() -> None:
    assert mean_of([CASCADES["gates"]], ["BC"]) is CASCADES["gates"]


def test_no_two_channels_get_one_name() -> None:
    one = Cascade(models=(network("BP_1 -> BP", seed=1),))
    mean = mean_of([one, other(one)], ["BP"])
    assert mean.inputs == ("BP_1",)
    assert mean.outputs == ("BP__1", "BP__2", "BP")


def test_what_cannot_be_averaged_is_refused() -> None:
    three = CASCADES["three networks"]
    with pytest.raises(ChannelError, match="ER"):
        mean_of([three, three], ["ER"])
    psi = network("STP -> BP")
    bars = replace(psi, output_unit="bar")
    with pytest.raises(ConfigError, match="unit"):
        mean_of([Cascade(models=(psi,)), Cascade(models=(bars,))], ["BP"])
