"""Starts of long records are compared on stretches of them, and the minimum is that of all samples."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from sysid.estimation.fitting import fit
from sysid.estimation.linear.polynomial import fit as polynomial
from sysid.estimation.linear.stretches import stretches
from sysid.estimation.linear.transfer_function import fit as transfer_function
from sysid.estimation.linear.variable_projection import SeparableProvider
from sysid.estimation.records.experiment import experiments_of
from sysid.models import ARMAX, OE, Mapping, Start, StartKind, TransferFunction
from sysid.models.converting.orthonormal_basis import Domain
from sysid.traces import Trace
from tests.estimation.linear_systems import trace_of

SHORTEST, KEPT, LONG = 1_000, 3_000, 9_000
"""A quarter of what is usual: searches over all samples, which these are compared with, take long."""
FREE = Start(kind=StartKind.ESTIMATED)
MAPPING = Mapping.parse("u1 -> y")
TOLD = "the best went on over all samples"


@pytest.fixture(autouse=True)
def shorter(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, samples in (("SHORTEST", SHORTEST), ("KEPT", KEPT), ("LONG", LONG)):
        monkeypatch.setattr(f"sysid.estimation.linear.stretches.{name}", samples)


def record(n: int = LONG, seed: int = 0, *, delay: int = 1) -> Trace:
    """A lightly damped plant and a slow pole beside it in coloured noise."""
    rng = np.random.default_rng(seed)
    u = lfilter([0.2], [1.0, -0.8], rng.normal(size=n))
    delayed = np.concatenate([np.zeros(delay), u])[:n]
    y = lfilter([0.1, 0.05, 0.02], np.convolve([1.0, -1.9 * 0.97, 0.97**2], [1.0, -0.9]), delayed)
    y = y + 0.05 * y.std() * lfilter([1.0, 0.5], [1.0, -0.8], rng.normal(size=n))
    return trace_of(u, y, sample_time=1.0)


def experiments(trace: Trace, start: Start = FREE) -> Any:
    return experiments_of([trace], MAPPING, start, 0.0)


def test_stretches_are_spread_evenly_and_only_the_first_begins_as_the_record_does() -> None:
    trace = record()
    found = stretches(experiments(trace, Start()))
    assert found is not None
    assert [len(one.output) for one in found] == [SHORTEST] * (KEPT // SHORTEST)
    firsts = [int(np.flatnonzero(trace["u1"] == one.inputs[0, 0])[0]) for one in found]
    assert firsts == [0, LONG // SHORTEST // 2 * SHORTEST, LONG - SHORTEST]
    assert [one.free for one in found] == [False, True, True]


def test_short_records_and_those_that_move_slowly_have_none() -> None:
    assert stretches(experiments(record(LONG - 1))) is None
    step = np.repeat([0.0, 1.0], LONG // 2)
    slow = trace_of(step, step, sample_time=1.0)
    assert stretches(experiments(slow)) is None


def test_an_input_that_stands_in_the_stretches_is_looked_at_everywhere() -> None:
    trace = record()
    late = np.where(np.arange(LONG) // SHORTEST % 2 == 1, trace["u1"], 0.0)
    found = stretches(experiments(replace(trace, values=np.column_stack([late, trace["y"]]))))
    assert found is None or all(one.inputs.var() > 0.0 for one in found)


def test_stretches_of_masked_samples_alone_are_left_out() -> None:
    trace = record(seed=1)
    usable = np.ones(LONG, dtype=np.bool_)
    usable[-SHORTEST:] = False
    found = stretches(experiments(replace(trace, usable=usable)))
    assert found is not None and all(one.usable is None or one.usable.any() for one in found)


def rows_of(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Rows of every linear problem that is solved from here on."""
    rows, solve = list[int](), SeparableProvider._solve

    def counted(self: SeparableProvider, theta: NDArray[np.float64]) -> Any:
        rows.append(self.n_samples)
        return solve(self, theta)

    monkeypatch.setattr(SeparableProvider, "_solve", counted)
    return rows


@pytest.mark.parametrize(
    "structure",
    [
        TransferFunction(poles=(2,), zeros=(1,)),
        TransferFunction(poles=(2,), zeros=(1,), delays=(0,), domain=Domain.CONTINUOUS),
    ],
    ids=["dead time searched", "continuous, too few poles"],
)
def test_a_transfer_function_comes_to_the_same_minimum_by_a_part_of_the_work(
    structure: TransferFunction, monkeypatch: pytest.MonkeyPatch
) -> None:
    trace, rows = record(delay=3 if structure.delays is None else 1), rows_of(monkeypatch)
    quick = fit([trace], MAPPING, structure, start=FREE)
    by_part = sum(rows)
    rows.clear()
    monkeypatch.setattr(transfer_function, "stretches", lambda _: None)
    thorough = fit([trace], MAPPING, structure, start=FREE)
    assert any(TOLD in note for note in quick.notes) and not any(TOLD in note for note in thorough.notes)
    assert quick.model.structure == thorough.model.structure
    assert quick.history["mse"][-1] <= thorough.history["mse"][-1] * (1.0 + 1e-6)
    assert by_part < 0.5 * sum(rows)


@pytest.mark.parametrize("structure", [OE(nb=(2,), nf=(2,), nk=(1,)), ARMAX(na=2, nb=(2,), nc=1, nk=(1,))])
def test_polynomials_end_no_higher(structure: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    trace = record()
    quick = fit([trace], MAPPING, structure, start=FREE)
    monkeypatch.setattr(polynomial, "stretches", lambda _: None)
    thorough = fit([trace], MAPPING, structure, start=FREE)
    assert any(TOLD in note for note in quick.notes) and not any(TOLD in note for note in thorough.notes)
    assert quick.history["mse"][-1] <= thorough.history["mse"][-1] * (1.0 + 1e-6)


def test_a_part_that_misleads_is_not_gone_on_from(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stretches of another plant: the starts of all samples lead further down, and the whole search is made."""
    trace = record()
    other = replace(trace, values=np.column_stack([trace["u1"], np.roll(trace["u1"], 2)]))
    structure = TransferFunction(poles=(2,), zeros=(0,), delays=(1,))
    monkeypatch.setattr(transfer_function, "stretches", lambda _: experiments(other)[:1])
    found = fit([trace], MAPPING, structure, start=FREE)
    monkeypatch.setattr(transfer_function, "stretches", lambda _: None)
    thorough = fit([trace], MAPPING, structure, start=FREE)
    assert found.history["mse"][-1] == pytest.approx(thorough.history["mse"][-1], rel=1e-6)
