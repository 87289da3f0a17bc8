"""Room for the rows of a cascade's sensitivities; what stands in them is tested where they are used."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from sysid.kernels.cascade_sensitivities import rows_for


@given(st.lists(st.integers(1, 700), min_size=1, max_size=8), st.integers(0, 5000))
def test_the_newest_rows_of_each_output_stand_apart(kept, t):
    rows = rows_for(np.array(kept), 2)

    places = [
        first + ((t - lag) & mask)
        for n, first, mask in zip(kept, rows.first, rows.mask, strict=True)
        for lag in range(n)
    ]
    assert len(set(places)) == sum(kept)
    assert min(places) >= 0
    assert max(places) < len(rows.J)
    assert len(rows.J) < 2 * sum(kept) + 1
    assert_array_equal(rows.moves, np.zeros(len(rows.J), dtype=bool))
