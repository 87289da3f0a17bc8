"""Records that go where none was fitted are told, of models that learn what an input does at each value."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import sysid
from sysid.models import Mapping
from sysid.validation.beyond import beyond

NETWORK = sysid.NARX(input_delays=1, output_delays=1, neurons=1)
RNG = np.random.default_rng(0)
WIDE = np.repeat(RNG.uniform(-1.0, 1.0, 20), 10)


def _traces(**inputs: np.ndarray) -> list[sysid.traces.Trace]:
    return list(sysid.data({name: (u, np.cumsum(u)) for name, u in inputs.items()}, sample_time=0.1))


def _told(fitted: np.ndarray, scored: np.ndarray, structure: object = NETWORK) -> tuple[str, ...]:
    model = SimpleNamespace(structure=structure, mapping=Mapping(inputs=("u",), outputs=("y",)))
    one, other = _traces(fitted=fitted, fresh=scored)
    return beyond(model, [one], [other])


@pytest.mark.parametrize(
    ("fitted", "scored", "share"),
    [
        (WIDE, 0.9 * WIDE, None),
        (WIDE, 1.02 * WIDE, None),
        (0.5 * WIDE, WIDE, True),
        (np.sign(WIDE), np.sign(-WIDE), None),
        (np.sign(WIDE), WIDE, True),  # between two levels nothing is known
        (WIDE, np.where(np.arange(200) == 7, 3.0, WIDE), None),  # a sample is no record
    ],
    ids=["within", "hardly beyond", "beyond", "levels again", "between levels", "one sample"],
)
def test_records_beyond_those_that_were_fitted_are_told(
    fitted: np.ndarray, scored: np.ndarray, share: bool | None
) -> None:
    assert [one.startswith("In fresh u is at values that no record") for one in _told(fitted, scored)] == (
        [] if share is None else [share]
    )


def test_lines_and_equations_go_on() -> None:
    assert _told(0.5 * WIDE, WIDE, sysid.ARX(na=1, nb=1, nk=1)) == ()


def test_compare_says_it_below_its_table() -> None:
    fitted, fresh = _traces(fitted=0.5 * WIDE, fresh=WIDE)
    training = sysid.Training(max_iterations=3, starts=1)
    fit = sysid.fit(fitted, "u -> y", NETWORK, training, stability=sysid.StabilityOptions(count=0))
    assert "no record which was fitted has" in str(sysid.compare(fresh, fit))
    assert "no record which was fitted has" not in str(sysid.compare(fitted, fit))
