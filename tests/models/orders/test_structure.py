"""One number for a field that has one for each input stands for all of them; the doors are in ``test_doors.py``."""

from typing import Any

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError
from sysid.estimation.estimators import ESTIMATORS
from sysid.models import structure_from_dict

ONE: dict[str, tuple[dict[str, Any], str]] = {
    "ARX": ({"na": 1, "nb": 2, "nk": 0}, "ARX [1; 2 2 2; 0 0 0]"),
    "ARMAX": ({"na": 1, "nb": 1, "nc": 1, "nk": 1}, "ARMAX [1; 1 1 1; 1; 1 1 1]"),
    "OE": ({"nb": 1, "nf": 1, "nk": 1}, "OE [1 1 1; 1 1 1; 1 1 1]"),
    "BJ": ({"nb": 1, "nc": 1, "nd": 1, "nf": 1, "nk": 1}, "BJ [1 1 1; 1; 1; 1 1 1; 1 1 1]"),
    "TransferFunction": ({"poles": 1, "zeros": 0}, "TF [1 1 1; 0 0 0; 1 1 1]"),
    "ProcessModel": ({"type": "P1"}, "P1 P1 P1"),
    "SS": ({"states": 1, "nk": 1}, "SS 1 nk 1 1 1"),
    "VectorSS": ({"states": 1, "nk": 1}, "VectorSS 1 nk 1 1 1"),
}


@pytest.mark.parametrize(("kind", "fields", "label"), [(kind, *row) for kind, row in ONE.items()], ids=list(ONE))
def test_one_number_is_for_all_inputs_and_the_fit_says_what_it_became(
    kind: str, fields: dict[str, Any], label: str
) -> None:
    rng = np.random.default_rng(0)
    u, y = rng.normal(size=(300, 3)), np.zeros(300)
    for t in range(1, 300):
        y[t] = 0.8 * y[t - 1] + u[t - 1] @ [1.0, 2.0, 0.5] + 0.01 * rng.normal()
    traces = sysid.data((u, y), sample_time=1.0)
    fit = sysid.fit(traces, "u1+u2+u3 -> y", structure_from_dict({"kind": kind, **fields}), start="estimated")
    assert fit.model.structure.label == label


def test_every_structure_with_a_number_for_each_input_takes_one_for_all() -> None:
    assert {kind for kind, row in ESTIMATORS.items() if row.structure.per_input} == set(ONE)


def test_one_number_stands_beside_several() -> None:
    assert sysid.ARX(na=1, nb=[1, 2, 1], nk=1).label == "ARX [1; 1 2 1; 1 1 1]"
    assert sysid.TransferFunction(poles=2, zeros=[1, 0], delays=3).label == "TF [2 2; 1 0; 3 3]"


def test_a_network_may_begin_at_a_linear_model_with_one_number() -> None:
    network = sysid.NARX(input_delays=1, output_delays=1, neurons=1).lagged(3)
    assert network.contains(sysid.ARX(na=1, nb=1, nk=1).lagged(3))


def test_a_number_for_each_of_two_is_none_for_three_and_one_for_none() -> None:
    with pytest.raises(ConfigError, match="expected: 3 values of nb, one for each input, or one for all"):
        sysid.ARX(na=1, nb=[1, 2], nk=1).for_inputs(3)
    with pytest.raises(ConfigError, match=r"nb: \[\] and nk: \[\]"):
        sysid.ARX(na=1, nb=1, nk=1).for_inputs(0)


def test_a_list_that_is_too_short_is_a_slip() -> None:
    with pytest.raises(ConfigError, match="not the orders of an ARX model"):
        sysid.ARX(na=1, nb=[1, 2, 1], nk=[1])
