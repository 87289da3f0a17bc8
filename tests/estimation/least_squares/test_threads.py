"""Everything that estimates works in one BLAS thread, whoever asks, and leaves the number of threads as it was."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

import sysid
from sysid.traces import TraceSet


def threads() -> dict[str, int]:
    """Of each BLAS that is loaded, NumPy's and SciPy's own."""
    return {row["filepath"]: row["num_threads"] for row in threadpool_info() if row["user_api"] == "blas"}


@pytest.fixture
def two() -> Iterator[dict[str, int]]:
    """Two threads of each, as a machine with two cores has them."""
    with threadpool_limits(2, "blas"):
        found = threads()
        assert len(found) >= 2
        assert set(found.values()) == {2}
        yield found


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The most threads of any BLAS at each call of a factorisation."""
    found = list[int]()

    def spied(does: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **named: Any) -> Any:
            if len(found) < 20:
                found.append(max(threads().values()))
            return does(*args, **named)

        return call

    for name in ("cholesky", "lstsq", "qr", "svd", "eigh", "solve_triangular"):
        monkeypatch.setattr(scipy.linalg, name, spied(getattr(scipy.linalg, name)))
    return found


def record() -> TraceSet:
    u = np.repeat(np.random.default_rng(0).normal(size=20), 10)
    return sysid.data((u, np.convolve(u, 0.1 * 0.9 ** np.arange(200))[:200]), sample_time=0.1)


WORDS: dict[str, Callable[[TraceSet], object]] = {
    "advise": lambda traces: sysid.advise(traces, "u -> y"),
    "impulse_response": lambda traces: sysid.impulse_response(traces, "u -> y"),
    "search_orders": lambda traces: sysid.search_orders(traces, "u -> y"),
    "fit": lambda traces: sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=1)),
}


@pytest.mark.parametrize("word", WORDS)
def test_a_word_works_in_one_thread_of_every_blas(word: str, two: dict[str, int], seen: list[int]) -> None:
    WORDS[word](record())
    assert set(seen) == {1}
    assert threads() == two
