"""Orders and lags: whole numbers within bounds, refused by name before they take memory."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any

import pytest

from sysid.errors import ConfigError
from sysid.models import ARX, NARX, NeuralStateSpace, PolynomialNARX, TransferFunction, VectorNARX
from sysid.models.orders.lags import MOST, parse_lags

NO_ORDERS = [float("inf"), float("nan"), 1e30, 2.5, True, None, "two", -1, 10**7, 10**5000, [[[]]], {"a": 1}]
FIELDS: dict[str, tuple[type, dict[str, Any]]] = {
    "na": (ARX, {"na": 1, "nb": (1,), "nk": (1,)}),
    "nb": (ARX, {"na": 1, "nb": (1,), "nk": (1,)}),
    "nk": (ARX, {"na": 1, "nb": (1,), "nk": (1,)}),
    "poles": (TransferFunction, {"poles": (2,), "zeros": (1,), "delays": (1,)}),
    "zeros": (TransferFunction, {"poles": (2,), "zeros": (1,), "delays": (1,)}),
    "input_delays": (NARX, {"input_delays": 2, "output_delays": 2, "neurons": 2}),
    "output_delays": (NARX, {"input_delays": 2, "output_delays": 2, "neurons": 2}),
    "neurons": (NARX, {"input_delays": 2, "output_delays": 2, "neurons": 2}),
    "states": (NeuralStateSpace, {"states": 2, "neurons": 2}),
}


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("value", NO_ORDERS, ids=lambda value: f"{value!r:.20}" if value != 10**5000 else "10**5000")
def test_what_is_no_order_is_refused_in_words(name: str, value: object) -> None:
    structure, fields = FIELDS[name]
    for given in (value, [value]):
        with pytest.raises(ConfigError) as caught:
            structure(**fields | {name: given})
        assert caught.value.remedy
        assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("spec", ["0:10000000", 10**8, [1, 10**8], "0:1e7", f"{10**9}:{10**9 + 1}"])
def test_a_range_of_lags_is_bounded_before_it_is_made(spec: Any) -> None:
    with pytest.raises(ConfigError, match="none above 10,000"):
        parse_lags(spec, first=0, where="input_delays")


def test_the_largest_range_is_taken() -> None:
    assert len(parse_lags(f"1:{MOST}", first=1, where="x")) == MOST


def test_one_number_is_the_order_of_one_input() -> None:
    assert ARX(na=1, nb=2, nk=0) == ARX(na=1, nb=(2,), nk=(0,))  # type: ignore[arg-type]  # as a pipeline writes it
    assert TransferFunction(poles=2, zeros=1, delays=3) == TransferFunction(poles=(2,), zeros=(1,), delays=(3,))  # type: ignore[arg-type]


@pytest.mark.parametrize("first", [0, 1])
def test_a_number_of_no_lags_is_refused_with_the_lag_that_can_be_written(first: int) -> None:
    with pytest.raises(ConfigError) as refused:
        parse_lags(0, first=first, where="delays")
    (written,) = re.findall(r"\[\d+\]", str(refused.value.remedy))
    assert parse_lags(json.loads(written), first=first, where="delays") == (first,)


@pytest.mark.parametrize("kind", [NARX, VectorNARX, PolynomialNARX])
@pytest.mark.parametrize("spec", [[], (), iter(())], ids=["a list", "a tuple", "an iterator"])
def test_no_lags_of_the_output_are_a_model_of_inputs_alone(kind: type, spec: Any) -> None:
    fields = {} if kind is PolynomialNARX else {"neurons": 3}
    network = kind(input_delays="0:2", output_delays=spec, **fields)
    assert network == kind(input_delays="0:2", output_delays=network.output_delays, **fields)
    assert network.output_delays in {(), ((),)}


@pytest.mark.parametrize(
    "read",
    [
        pytest.param(lambda: NARX(input_delays=[], output_delays=[], neurons=3), id="network"),
        pytest.param(lambda: NARX(input_delays=[0], output_delays=[], neurons=3).lags(0), id="network, no input"),
        pytest.param(lambda: VectorNARX(input_delays=[0], output_delays=[], neurons=3).lags(0, 2), id="two outputs"),
        pytest.param(lambda: PolynomialNARX(input_delays=[], output_delays=[]), id="polynomial"),
        pytest.param(lambda: PolynomialNARX(input_delays=[0], output_delays=[]).lags(0), id="polynomial, no input"),
    ],
)
def test_a_model_that_reads_nothing_is_refused(read: Callable[[], object]) -> None:
    with pytest.raises(ConfigError, match="a model of no lags reads nothing"):
        read()
