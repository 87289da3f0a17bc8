"""Limits that act: counted in free run, over the cases and the random sequences."""

from __future__ import annotations

import numpy as np

from sysid.composite.limits_held import holding
from sysid.models import NARX, Cascade, Limit, Mapping, NARXModel, Scaling
from sysid.traces import Channel, Trace


def twice(limits: dict[str, Limit]) -> Cascade:
    """``y`` is twice ``u``, ``z`` is ``y``, held between limits."""

    def gain(name: str, output: str, value: float) -> NARXModel:
        return NARXModel(
            network=NARX(input_delays=[[0]], output_delays=1, neurons=0),
            theta=np.array([0.0, value, 0.0]),
            scaling=Scaling.identity(1),
            mapping=Mapping(inputs=(name,), output=output),
            sample_time=1.0,
            input_units=("cm",),
            output_unit="cm",
            rest_output=0.0,
            clamp=np.inf,
        )

    return Cascade(models=(gain("u", "y", 2.0), gain("y", "z", 1.0)), limits=limits)


def trace(*values: float) -> Trace:
    """A trace of the input."""
    return Trace(
        name="t", sample_time=1.0, channels=(Channel(name="u", unit="cm"),), values=np.array(values)[:, None]
    )  # fmt: skip


def test_each_side_is_counted_over_all_traces():
    whole = twice({"y": Limit(low=0.0, high=4.0), "z": Limit(high="u")})
    found = holding(whole, ["y", "z"], [trace(-1.0, 1.0, 3.0, 3.0), trace(1.0, 1.0)], [trace(3.0)])
    y, z = found
    assert (y.output, y.unit, y.low, y.high) == ("y", "cm", 0.0, 4.0)
    assert (y.cases.low, y.cases.high, y.cases.samples) == (1, 2, 6)
    assert y.sequences is not None
    assert (y.sequences.low, y.sequences.high, y.sequences.samples) == (0, 1, 1)
    assert (z.low, z.high) == (None, "u")
    assert z.cases.high == 6, "y is never below u, where it is held at 0 neither"


def test_without_random_sequences_there_is_no_figure_of_them():
    (found,) = holding(twice({"y": Limit(low=0.0)}), ["y", "z"], [trace(1.0)], [])
    assert found.sequences is None


def test_a_whole_without_limits_has_nothing_to_tell():
    assert holding(twice({}), ["y"], [trace(1.0)], []) == []
