"""Inputs of another number of columns than a form reads are refused."""

import numpy as np
import pytest

from sysid.errors import TraceError
from sysid.models.channels.history import fitting_columns


@pytest.mark.parametrize(("shape", "n", "more"), [((5, 2), 2, False), ((5, 3), 2, True), ((0, 2), 2, False)])
def test_as_many_as_are_read_are_taken(shape, n, more):
    assert fitting_columns(np.ones(shape, dtype=np.int64), n, more=more).dtype == np.float64


@pytest.mark.parametrize(("shape", "more"), [((5,), False), ((5, 1), False), ((5, 1), True), ((5, 3), False)])
def test_others_are_refused(shape, more):
    with pytest.raises(TraceError, match=r"\(n, 2\)"):
        fitting_columns(np.ones(shape), 2, more=more)
