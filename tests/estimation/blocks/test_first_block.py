"""Two blocks around a curve are found from the first, whatever the best linear model looks like."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid.estimation.blocks.first_block import searched
from sysid.estimation.blocks.sections import Block, Pair
from sysid.models.blocks.curve_starts import curve_start
from sysid.models.blocks.curves import WIDTH, Curve

BEFORE, BEHIND = [1.0, -1.2, 0.45], [1.0, -0.6, 0.0]


def record(seed: int = 0, n: int = 500) -> tuple[np.ndarray, np.ndarray]:
    u = np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, n // 4), 4)
    u[:20] = 0.0
    z = lfilter([0.0, 0.2, 0.05], BEFORE, u)
    return u[:, None], lfilter([0.0, 1.0], BEHIND[:2], z + 2.0 * z**3 + 0.5 * z**2)


def begun(states: int) -> Block:
    """One that says nothing of the system."""
    return Block(sections=((0.0,),) * states, gains=np.ones((states, 1)), direct=np.zeros(1))


def found(until: float, direct: bool = False) -> list[tuple[float, Pair]]:
    return searched([begun(2)], 1, record(), direct=[direct], slowest=20.0, rng=np.random.default_rng(0), until=until)


@pytest.fixture(scope="module")
def pairs() -> list[tuple[float, Pair]]:
    return found(np.inf)


def test_the_first_block_is_found_among_drawn_ones(pairs: list[tuple[float, Pair]]) -> None:
    error, best = pairs[0]
    assert error < 1e-9 * np.var(record()[1])
    assert best.before.sections[0] == pytest.approx(BEFORE[1:], abs=1e-3)
    assert best.behind.sections == (pytest.approx((0.6,), abs=1e-3),)
    assert [error for error, _ in pairs] == sorted(error for error, _ in pairs)


def test_blocks_and_curve_of_a_pair_are_the_system(pairs: list[tuple[float, Pair]]) -> None:
    _, best = pairs[0]
    u, y = record()
    assert best.x == pytest.approx(best.before.filtered(u))
    assert np.abs(best.x).max() == pytest.approx(1.0)
    run = best.behind.filtered(best.y[:, None])
    assert np.std(run - y) < 1e-3 * np.std(y)
    assert np.cov(best.x, best.y)[0, 1] / np.var(best.x) == pytest.approx(1.0, rel=1e-2)


def test_no_time_leaves_one_pair_that_can_be_begun_with() -> None:
    ((error, pair),) = found(-np.inf)
    assert np.isfinite(error)
    assert np.isfinite(pair.y).all()


def test_a_block_reads_its_input_within_the_sample_only_where_it_may() -> None:
    assert found(-np.inf)[0][1].before.direct == 0.0
    assert found(-np.inf, direct=True)[0][1].before.direct != 0.0


@pytest.mark.parametrize(
    ("written", "y", "wanted"),
    [
        ("polynomial 3", lambda x: 2.0 * x + 3.0 * x**2 - x**3 + 5.0, (2.0, [1.5, -0.5])),
        ("polynomial 2", lambda x: 0.5 * x, (0.5, [0.0])),
        ("piecewise 1", lambda x: 2.0 * x - np.maximum(x - 0.01, 0.0), (2.0, [-0.5])),
        ("rounded 1", lambda x: 2.0 * x - 0.1 * np.log(1.0 + np.exp((x - 0.01) / 0.1)), (2.0, [-0.5])),
    ],
)
def test_a_learnt_curve_begins_like_some_values(written: str, y, wanted) -> None:  # type: ignore[no-untyped-def]
    x = np.linspace(-1.0, 1.0, 50)
    scale, begun = Curve.parse(written, "curve").like(x, y(x)) or (0.0, {})
    assert scale == pytest.approx(wanted[0])
    assert list(begun.values()) == pytest.approx(wanted[1], abs=1e-12)


@pytest.mark.parametrize(("written", "y"), [("saturation", np.abs), ("network 3", np.abs), ("polynomial 2", np.square)])
def test_a_curve_that_cannot_begin_like_them_begins_as_it_is(written: str, y) -> None:  # type: ignore[no-untyped-def]
    x = np.linspace(-1.0, 1.0, 50)
    assert Curve.parse(written, "curve").like(x, y(x)) is None


def value(curve: Curve, x: np.ndarray, bends: dict[str, float], weights: np.ndarray) -> np.ndarray:
    """What equations make of a curve."""
    k = curve.size
    if curve.kind == "network":
        hidden = np.tanh(np.outer(x, weights[: 2 * k : 2]) + weights[1 : 2 * k : 2])
        return np.asarray(x + hidden @ weights[2 * k : -2] + weights[-2] * x + weights[-1])
    if curve.kind == "polynomial":
        return np.asarray(x + sum(bends[f"c{n}"] * x**n for n in range(2, k + 1)))
    ahead = [x - bends[f"at{n}"] for n in range(1, k + 1)]
    pieces = [
        np.maximum(one, 0.0) if curve.kind == "piecewise" else WIDTH * np.logaddexp(0, one / WIDTH) for one in ahead
    ]
    return np.asarray(x + sum(bends[f"slope{n}"] * one for n, one in enumerate(pieces, start=1)))


@pytest.mark.parametrize(
    ("written", "y", "off"),
    [
        ("polynomial 2", lambda x: 2.0 * x**2 - 1.0, 1e-9),
        ("polynomial 3", lambda x: 3.0 * x**3 - x**2 - 1.0, 1e-9),
        ("piecewise 2", lambda x: 2.0 * np.abs(x) - 1.0, 1e-9),
        ("piecewise 4", lambda x: 0.3 - np.abs(x - 0.5), 1e-9),
        ("rounded 8", lambda x: np.cos(3.0 * x), 0.05),
        ("network 6", lambda x: 2.0 * x**2 - 1.0, 0.05),
    ],
)
def test_a_curve_that_turns_back_begins_like_it(written: str, y, off: float) -> None:  # type: ignore[no-untyped-def]
    x, curve = np.linspace(-1.0, 1.0, 200), Curve.parse(written, "curve")
    start = curve_start(curve, x, y(x))
    assert start is not None
    found = value(curve, start.scale * x + start.level, start.bends, start.weights)
    assert np.abs(found - y(x)).max() < off


def test_a_curve_with_limits_and_a_polynomial_that_is_nowhere_0_have_no_such_start() -> None:
    x = np.linspace(-1.0, 1.0, 50)
    assert curve_start(Curve.parse("saturation", "curve"), x, np.abs(x)) is None
    assert curve_start(Curve.parse("polynomial 2", "curve"), x, x**2 + 1.0) is None


def test_a_block_begins_where_it_has_settled_and_a_slow_one_at_0() -> None:
    """Inputs from 0 to 1 that begin at 0 had a curve that began beside what it sees, and limits that nothing met."""
    w = np.random.default_rng(0).standard_normal((60, 2)) + np.array([1.0, -2.0])
    stood = np.array([*np.tile(w[0], (800, 1)), *w])
    gains, direct = np.array([[0.3, -0.2], [0.1, 0.4]]), np.array([0.5, 0.0])
    block = Block(sections=((-1.2, 0.45),), gains=gains, direct=direct)
    assert block.from_rest(w) == pytest.approx(block.filtered(stood)[800:])
    for pole in (1.0, 0.99999):
        slow = Block(sections=((pole,),), gains=np.ones((1, 2)), direct=np.zeros(2))
        assert slow.from_rest(w) == pytest.approx(slow.filtered(w - w[0]))
