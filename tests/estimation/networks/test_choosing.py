"""Of candidates alike one that forgets where it began is chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.estimation.networks.starts.choosing import choose
from sysid.estimation.networks.starts.multistart import Place


class Check:
    """A free run is stable and hangs on where it began on so many sequences, both by the model's name."""

    def __init__(self, apart: dict[str, int], unstable: str = "") -> None:
        self.by_name, self.unstable = apart, unstable

    def __call__(self, model: Any) -> bool:
        return model not in self.unstable.split()

    def apart(self, model: Any) -> int:
        return self.by_name.get(model, 0)


def candidate(name: str, error: float, *, score: float = np.nan, usable: bool = True) -> Any:
    """The error is the root of that of the scaled output; the evidence goes with it."""
    curve = [SimpleNamespace(mse=error**2)]
    solution = SimpleNamespace(status=SimpleNamespace(usable=usable), curve=curve, evidence=object())
    return SimpleNamespace(
        number=ord(name), cautious=False, outside=0, place=Place.BY_EVIDENCE, away=np.nan, score=score, model=name,
        solution=solution, log_evidence=-error, loss=error**2,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("errors", "check", "chosen"),
    [
        ({"a": 1e-4, "b": 2e-3, "c": 9e-3}, Check({"a": 0, "b": 3}), "a"),
        ({"a": 1e-4, "b": 2e-3, "c": 9e-3}, Check({"a": 1}), "b"),  # both follow the record to a hundredth
        ({"a": 1e-4, "b": 2e-3, "c": 9e-3}, Check({"a": 1}, unstable="b"), "a"),  # one of three is no majority
        ({"a": 1e-4, "b": 2e-3, "c": 9e-3, "d": 9e-3}, Check({"a": 1}, unstable="b"), "c"),
        ({"a": 1e-4, "b": 2e-3, "c": 9e-3}, Check({"a": 90, "b": 80}), "a"),  # the system may integrate or lock
        ({"a": 1e-4, "b": 2e-2}, Check({"a": 1}), "a"),  # far worse
        ({"a": 2e-2, "b": 2.3e-2}, Check({"a": 1}), "b"),  # with noise, less than 20 % worse
        ({"a": 2e-2, "b": 2.5e-2}, Check({"a": 1}), "a"),
        ({"a": 1e-4, "b": 2e-3}, Check({"b": 1}, unstable="a"), "b"),
    ],
)
def test_of_those_alike_one_is_chosen_that_forgets_where_it_began(
    errors: dict[str, float], check: Check, chosen: str
) -> None:
    """Of a record without noise all follow it to a hundredth; beyond it one had a second place to stand."""
    best = min(name for name in errors if check(name))
    found = choose([candidate(name, error) for name, error in errors.items()], "evidence", check)
    assert found.chosen.model == chosen
    assert found.forgetful is (chosen != best)


def test_selection_traces_say_which_are_alike() -> None:
    def choice(*scores: float) -> str:
        some = [candidate(name, 1e-4, score=score) for name, score in zip("abc", scores, strict=False)]
        return str(choose(some, "selection", Check({"a": 2})).chosen.model)

    assert choice(1.0e-6, 1.4e-6) == "b"
    assert choice(1.0e-6, 1.5e-6) == "a"


def test_what_did_not_improve_and_what_nobody_asks_is_no_candidate() -> None:
    some = [candidate("a", 1e-4), candidate("b", 2e-4, usable=False), candidate("c", 3e-4)]
    assert choose(some, "evidence", Check({"a": 1})).chosen.model == "c"
    assert choose(some, "evidence", lambda _: True).chosen.model == "a"
    assert choose(some, "evidence").chosen.model == "a"
