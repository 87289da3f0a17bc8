"""Whether the last fit takes the place of the one that was chosen."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from sysid.estimation import Status
from sysid.workbench.auto import refit
from sysid.workbench.auto.refit import BETTER, KEPT, refitted


@dataclass(frozen=True)
class Fit:
    """What is looked at of a fit."""

    status: Status = Status.CONVERGED
    stability: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    mse: float = 1.0


STRAYS = Fit(stability={"apart": 7})


@pytest.mark.parametrize(
    ("chosen", "again", "taken"),
    [
        (Fit(), Fit(mse=0.9), True),
        (Fit(), Fit(mse=1.1), False),
        (STRAYS, Fit(mse=1.1), True),
        (STRAYS, Fit(mse=1.5), False),  # far worse: the plant may swing by itself
        (STRAYS, Fit(stability={"apart": 3}, mse=1.1), False),
        (Fit(), Fit(stability={"apart": 3}, mse=1.1), False),
        (Fit(status=Status.UNSTABLE), Fit(mse=1.1), True),
    ],
)
def test_one_that_forgets_where_it_began_is_taken_before_one_alike_that_does_not(
    monkeypatch: pytest.MonkeyPatch, chosen: Fit, again: Fit, taken: bool
) -> None:
    monkeypatch.setattr(refit.steps, "fit_traces", lambda *_: again)
    monkeypatch.setattr(refit, "_error", lambda fit, *_: (0, fit.mse))
    asked: Any = SimpleNamespace(
        training_options=lambda _: None, watch=lambda _: None, seed=0, estimation=(), selection=()
    )
    given: Any = chosen
    found = refitted(asked, asked, asked, asked, chosen=given, whole=lambda: given, further=False)
    assert found.notes == (BETTER if taken else KEPT,)
