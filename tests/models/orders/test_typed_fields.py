"""Structures and options are held to their types, whoever gives them."""

from __future__ import annotations

import dataclasses
import inspect
import math
from typing import Any

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.estimation.estimators import ESTIMATORS
from sysid.estimation.networks.together.options import JointTraining
from sysid.estimation.stability.check import StabilityOptions
from sysid.models import NARX, HammersteinWiener, VectorNARX
from sysid.models.blocks.curves import Curve
from sysid.models.orders.lags import is_one_set

GIVEN = (
    -1,
    1.5,
    math.nan,
    1,
    True,
    "1",
    "no",
    None,
    [],
    (1, 2),
    {},
    b"1",
    np.float64(1.0),
    np.bool_(True),
    10**30,
    np.array(2),
    np.arange(2),
)
PLAIN: dict[str, dict[str, Any]] = {
    **{kind: {"na": 1, "nb": 1, "nk": 1} for kind in ("ARX", "VectorARX")},
    "ARMAX": {"na": 1, "nb": 1, "nc": 1, "nk": 1},
    "OE": {"nb": 1, "nf": 1, "nk": 1},
    "BJ": {"nb": 1, "nc": 1, "nd": 1, "nf": 1, "nk": 1},
    **{kind: {"input_delays": 1, "output_delays": 1, "neurons": 2} for kind in ("NARX", "VectorNARX")},
    **{kind: {"states": 1} for kind in ("SS", "VectorSS")},
    **{kind: {"states": 1, "neurons": 2} for kind in ("NSS", "VectorNSS")},
    "TransferFunction": {"poles": 1, "zeros": 0, "delays": 1},
    "ProcessModel": {"type": "P1D"},
    "HammersteinWiener": {"states": 1, "input": "piecewise 3"},
    "WienerHammerstein": {"first": 1, "second": 1, "curve": "polynomial 3"},
    "PolynomialNARX": {"input_delays": 1, "output_delays": 1, "degree": 2},
}
OPTIONS = {row.training for row in ESTIMATORS.values() if row.training is not None} | {JointTraining, StabilityOptions}


@pytest.mark.parametrize("kind", PLAIN)
def test_a_structure_is_made_or_refused_and_its_switches_are_true_or_false(kind: str) -> None:
    """A switch that was "no" was on; a number of NumPy where a lag belongs was a trace."""
    made = ESTIMATORS[kind].structure
    for field in dataclasses.fields(made):
        for value in GIVEN:
            try:
                structure = made(**{**PLAIN[kind], field.name: value})
            except ConfigError:
                continue
            assert structure.label
            assert field.type != "bool" or isinstance(getattr(structure, field.name), bool)


@pytest.mark.parametrize("options", sorted(OPTIONS, key=lambda one: one.__name__), ids=lambda one: one.__name__)
def test_an_option_is_taken_or_refused_and_no_number_is_something_else(options: Any) -> None:
    """A limit of nan was never reached, one of text was a trace from within a fit."""
    held = {"int": int, "float": int | float, "bool": bool}
    for field in dataclasses.fields(options):
        plain = field.type.removesuffix(" | None")
        for value in GIVEN:
            try:
                made = options(**{field.name: value})
            except ConfigError:
                continue
            if plain not in held or (value is None and field.type.endswith("| None")):
                continue
            taken = getattr(made, field.name)
            assert isinstance(taken, held[plain])
            assert plain == "bool" or not isinstance(taken, bool)
            assert not math.isnan(taken)
            assert taken >= 0 or field.name not in {"seed", "max_time_s", "tolerance"}


def test_lags_of_numpy_are_lags() -> None:
    assert NARX(input_delays=np.arange(1, 4), output_delays=np.int64(2), neurons=2) == NARX(
        input_delays=[1, 2, 3], output_delays=2, neurons=2
    )
    assert VectorNARX(input_delays=np.array(1), output_delays=np.arange(1, 3), neurons=2) == VectorNARX(
        input_delays=1, output_delays=[1, 2], neurons=2
    )
    assert [is_one_set(one) for one in (np.int64(2), "0:1", [[1], [1, 2]])] == [True, True, False]


@pytest.mark.parametrize(
    "curve",
    [
        Curve(kind="piecewise"),
        Curve(kind="network", size=-1),
        Curve(kind="polynomial", size=2.5),  # type: ignore[arg-type]
        Curve(kind="saturation", limits=(1.0, 0.0)),
        Curve(kind="none", size=3),
        Curve(kind="table"),
        Curve(kind="cubic"),
    ],
    ids=str,
)
def test_a_curve_that_is_made_by_hand_is_looked_at_as_one_that_is_written(curve: Curve) -> None:
    with pytest.raises(ConfigError, match="not a static curve"):
        HammersteinWiener(states=1, input=curve)


def test_curves_that_can_be_written_can_be_made() -> None:
    written = ("none", "piecewise 4", {"saturation": [0, 5]}, {"table": [[0, 0], [1, 2]]}, "absolute", "dead zone")
    for one in written:
        curve = Curve.parse(one, "input")
        assert Curve.parse(curve, "input") == curve


def test_help_shows_the_fields() -> None:
    fields = {"input_delays", "output_delays", "neurons", "feedthrough", "gated", "activation", "limits"}
    assert set(inspect.signature(NARX).parameters) == fields
    assert list(inspect.signature(JointTraining).parameters)[:2] == ["max_iterations", "max_time_s"]
