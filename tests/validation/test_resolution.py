"""What records can tell apart."""

from __future__ import annotations

import numpy as np

from sysid.validation.resolution import PARTS, exact, parts_of, tied


def test_parts_are_means_of_squares_in_time_order() -> None:
    assert parts_of(np.repeat(np.arange(float(PARTS)), 20)) == tuple(np.arange(float(PARTS)) ** 2)
    assert parts_of(np.full(5, 2.0)) == (4.0,)
    assert parts_of(np.array([])) == ()
    assert parts_of(np.full(8, 1e200)) == (np.inf,)


def test_runs_are_tied_as_often_as_chance_has_it_and_a_plain_difference_is_seen() -> None:
    """Two runs with the same noise and errors of the same size differ by chance alone."""
    rng, ties = np.random.default_rng(0), 0
    for _ in range(200):
        noise = rng.normal(size=1200)
        one, other = (parts_of(noise + 0.1 * rng.normal(size=1200)) for _ in range(2))
        ties += tied(one, other)
    assert 0.5 < ties / 200 < 0.8  # 0.66 of Student's distribution of eleven degrees
    assert not tied(parts_of(noise), parts_of(noise + rng.normal(size=1200)))


def test_what_is_too_short_or_lost_is_not_tied() -> None:
    assert not tied((1.0, 2.0, 1.0), (1.0, 2.0, 1.0))
    assert not tied((1.0,) * 5, (1.0,) * 4 + (np.inf,))
    assert not tied((1.0,) * 5, (1.0,) * 6)


def test_rounding_is_no_error() -> None:
    assert exact((1e-30, 1e-15))
    assert not exact((1e-8, 0.0))
    assert not exact(())
