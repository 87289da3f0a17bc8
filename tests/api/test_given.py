"""Every word of the short way takes a data set, a record or a list of records, and says so of anything else."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError
from sysid.traces import Trace
from tests.traces.made import trace_of

ARX = sysid.ARX(na=1, nb=1, nk=1)
WORDS: dict[str, Callable[[Any], Any]] = {
    "fit": lambda given: sysid.fit(given, "u -> y", ARX),
    "compare": lambda given: sysid.compare(given, sysid.fit(record("e"), "u -> y", ARX)),
    "save": lambda given: sysid.save(sysid.fit(record("e"), "u -> y", ARX), given, "nowhere"),
    "search_orders": lambda given: sysid.search_orders(given, "u -> y", max_na=1, max_nb=1, max_nk=1),
    "advise": sysid.advise,
    "impulse_response": lambda given: sysid.impulse_response(given, lags=5),
    "frequency_response": sysid.frequency_response,
    "auto": sysid.auto,
}


def record(name: str) -> Trace:
    """A lag of the first order."""
    u = np.random.default_rng(len(name)).choice([-1.0, 1.0], 200)
    y = np.zeros(200)
    for k in range(1, 200):
        y[k] = 0.8 * y[k - 1] + 0.2 * u[k - 1]
    return trace_of({"u": u, "y": y}, name=name, sample_time=0.1, units={"u": "V", "y": "m"})


@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize(
    ("given", "got", "remedy"),
    [
        ("mine.csv", "a str", 'sysid.load("mine.csv")'),
        (np.zeros((10, 2)), "a ndarray", "sysid.data"),
        ([np.zeros(3), "x"], "a list of ndarray and str", "sysid.data"),
        (None, "a NoneType", "sysid.data"),
    ],
    ids=["path", "array", "list of arrays", "none"],
)
def test_anything_else_is_refused_with_a_remedy(word: str, given: object, got: str, remedy: str) -> None:
    with pytest.raises(ConfigError, match=f"sysid.{word} takes a data set") as refused:
        WORDS[word](given)
    assert (refused.value.got, remedy in str(refused.value)) == (got, True)


@pytest.mark.parametrize("word", ["fit", "compare", "search_orders", "advise", "impulse_response"])
def test_one_record_or_several_will_do(word: str) -> None:
    for given in (record("e"), [record("e"), record("more")]):
        WORDS[word](given)


def test_records_without_a_set_are_fitted_as_one_of_them() -> None:
    one, several = record("e"), [record("e"), record("more")]
    by_list, by_set = (sysid.fit(given, "u -> y", ARX) for given in (several, sysid.fit(several, "u -> y", ARX).traces))
    assert by_list.model.a == by_set.model.a
    assert sysid.fit(one, "u -> y", ARX).traces.name == "e"
    with pytest.raises(sysid.errors.TraceError, match="the same name"):
        sysid.fit([one, one], "u -> y", ARX)


SET = record("e")
WRONG: dict[str, tuple[Callable[[], Any], str]] = {
    "mapping and structure": (lambda: sysid.fit(SET, ARX, "u -> y"), "mapping and structure are swapped"),
    "a class for both": (lambda: sysid.fit(SET, sysid.ARX, None), "a structure stands where the mapping belongs"),
    "mapping first": (lambda: sysid.fit("u -> y", SET, ARX), r"the data set comes first: sysid.fit\(traces"),
    "structure first": (lambda: sysid.fit(ARX, SET, "u -> y"), "the data set comes first"),
    "fit first": (lambda: sysid.compare(sysid.fit(SET, "u -> y", ARX), SET), r"comes first: sysid.compare"),
    "a class": (lambda: sysid.fit(SET, "u -> y", sysid.ARX), "the class ARX(.|\n)*with its numbers"),
    "a kind": (lambda: sysid.fit(SET, "u -> y", "ARX"), "no estimator belongs to the structure"),
    "orders": (lambda: sysid.fit(SET, "u -> y", [1, 1, 1]), "as in ARX"),
    "a model to begin with": (
        lambda: sysid.fit(SET, "u -> y", ARX, initial=sysid.fit(SET, "u -> y", ARX).model),
        "initial is a fit(.|\n)*not its model",
    ),
    "no stability": (lambda: sysid.fit(SET, "u -> y", ARX, stability=False), "count=0 asks nothing"),
    "a set to run over": (
        lambda: sysid.fit(SET, "u -> y", ARX).simulate(sysid.data([(SET["u"], SET["y"])] * 2, sample_time=0.1)),
        r"write traces\[",
    ),
    "a frame to load": (lambda: sysid.load({"u": [1.0]}), "sysid.data"),
    "a fit to read": (lambda: sysid.read_bundle(None), "takes a name or a path"),
}


@pytest.mark.parametrize("what", WRONG)
def test_arguments_in_each_others_place_are_told_by_name(what: str) -> None:
    """Each was a trace of Python, or was called no mapping."""
    call, words = WRONG[what]
    with pytest.raises(ConfigError, match=words):
        call()
