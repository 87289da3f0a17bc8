"""Dead times of transfer functions are those of the plant, whatever its orders."""

import numpy as np
from scipy import signal

import sysid
from sysid.estimation import fitting
from sysid.models import Mapping, Start, StartKind
from tests.estimation.linear_systems import trace_of


def test_a_response_that_begins_slowly_is_not_given_a_dead_time_too_long() -> None:
    """A sample later poles had run away to where they do nothing, and no other dead time was tried from elsewhere."""
    rng, n, late, T = np.random.default_rng(1), 800, 3, 0.6
    u = np.repeat(rng.choice([-1.0, 1.0], n), 3)[:n]
    num, den, _ = signal.cont2discrete(([1.0], [0.1, 0.8, 1.7, 1.0]), T, "zoh")
    y = signal.lfilter(np.ravel(num), den, np.concatenate([np.zeros(late), u])[:n])
    y = y + 0.05 * np.std(y) * rng.normal(size=n)
    structure = sysid.TransferFunction(poles=3, zeros=0, domain="continuous")
    start = Start(kind=StartKind.ESTIMATED)
    fit = fitting.fit([trace_of(u, y, sample_time=T)], Mapping.parse("u1 -> y"), structure, start=start, stability=None)
    assert fit.model.structure.delays == (late,)
    assert np.sort(fit.model.poles(0).real)[-1] > -1.2
