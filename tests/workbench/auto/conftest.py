"""Records for searches: short, made in code."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from sysid.models import ARX, LinearStateSpace, NeuralStateSpace
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.workbench.auto.families import Family, Try
from sysid.workbench.fits.data import Data

SMALL = (
    Family(kind="ARX", linear=True, first=lambda _: [Try(structure=ARX(na=1, nb=(1,), nk=(1,)))]),
    Family(kind="SS", linear=True, first=lambda _: [Try(structure=LinearStateSpace(states=1, noise=False))]),
    Family(
        kind="NSS",
        linear=False,
        first=lambda _: [Try(structure=NeuralStateSpace(states=1, neurons=n)) for n in (2, 3)],
    ),
)
"""Kinds of structures that are tried in an instant."""


def record(name: str, n: int, *, seed: int = 0, bend: float = 2.0, outputs: int = 1) -> Trace:
    """A first-order lag behind a saturation, with a little noise; ``bend`` near 0 makes it linear."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.0, 1.0, n // 5 + 1), 5)[:n]
    y = np.zeros(n)
    for k in range(1, n):
        y[k] = 0.7 * y[k - 1] + 0.3 * np.tanh(bend * u[k - 1]) / bend
    columns = [y * (m + 1) + 1e-3 * rng.standard_normal(n) for m in range(outputs)]
    names = ("y",) if outputs == 1 else tuple(f"y{m + 1}" for m in range(outputs))
    channels = (Channel(name="u", unit="V"), *(Channel(name=one, unit="m") for one in names))
    return Trace(name=name, sample_time=0.1, channels=channels, values=np.column_stack([u, *columns]))


def traces(*estimation: Trace, others: dict[Role, Trace] | None = None) -> TraceSet:
    """A data set of estimation traces and one of each other role."""
    rest = others or {}
    roles = {one.name: Role.ESTIMATION for one in estimation} | {one.name: role for role, one in rest.items()}
    return TraceSet(name="rig", traces=(*estimation, *rest.values()), roles=roles)


def data(*estimation: Trace, others: dict[Role, Trace] | None = None) -> Data:
    """The same as a pipeline has it."""
    known = traces(*estimation, others=others)
    return Data(traces=known, selection=known.with_role(Role.SELECTION))


@pytest.fixture(scope="module")
def small() -> Iterator[None]:
    """A search that tries little, and looks at the data without an order search."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sysid.workbench.auto.ledger.FAMILIES", SMALL)
        patch.setattr("sysid.workbench.auto.parts.SEARCH", {"max_iterations": 15, "starts": 4})
        patch.setattr("sysid.workbench.auto.plan.suggested", lambda *_, **__: [])
        yield
