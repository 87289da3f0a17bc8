"""Whether the last fit takes the place of the one that was chosen."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import pytest

from sysid.estimation import Status
from sysid.estimation.stability import StabilityOptions
from sysid.workbench.auto import refit
from sysid.workbench.auto.refit import BETTER, KEPT, LOST, NO_BETTER, STRANGE, refitted


@dataclass(frozen=True)
class Fit:
    """What is looked at of a fit."""

    status: Status = Status.CONVERGED
    stability: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    mse: float = 1.0
    model: str = "near"


STRAYS = Fit(stability={"apart": 7})
UNSTABLE = Fit(status=Status.UNSTABLE)
ALONE = Fit(model="alone")


def said_of(
    monkeypatch: pytest.MonkeyPatch, chosen: Fit, again: Fit, *, over_all: Status | None = None
) -> tuple[str, StabilityOptions]:
    """What is said of the last fit, and how it was asked to be checked."""
    checks = list[StabilityOptions]()

    def fitted(*_: Any, stability: StabilityOptions) -> Fit:
        checks.append(stability)
        return again

    monkeypatch.setattr(refit.steps, "fit_traces", fitted)
    monkeypatch.setattr(refit, "_error", lambda fit, *_: (0, fit.mse))
    monkeypatch.setattr(refit, "with_stability", lambda fit, *_: replace(fit, status=over_all or fit.status))
    asked: Any = SimpleNamespace(
        training_options=lambda _: None, watch=lambda _: None, seed=0, estimation=(), selection=(), sequences=(),
        stability=SimpleNamespace(options=lambda _: StabilityOptions(count=7)),
    )  # fmt: skip
    given: Any = chosen
    found = refitted(
        asked, asked, asked, asked, chosen=given, whole=lambda: given, further=False,
        alone=lambda model: model == "alone",  # type: ignore[comparison-overlap]  # of the fits above
    )  # fmt: skip
    return found.notes[-1], checks[0]


@pytest.mark.parametrize(
    ("chosen", "again", "taken"),
    [
        (Fit(), Fit(mse=0.9), True),
        (Fit(), Fit(mse=1.1), False),
        (STRAYS, Fit(mse=1.1), True),
        (STRAYS, Fit(mse=1.5), False),  # far worse: the plant may swing by itself
        (STRAYS, Fit(stability={"apart": 3}, mse=1.1), False),
        (Fit(), Fit(stability={"apart": 3}, mse=1.1), False),
        (UNSTABLE, Fit(mse=1.1), True),
    ],
)
def test_one_that_forgets_where_it_began_is_taken_before_one_alike_that_does_not(
    monkeypatch: pytest.MonkeyPatch, chosen: Fit, again: Fit, taken: bool
) -> None:
    assert said_of(monkeypatch, chosen, again)[0] == (BETTER if taken else KEPT.format(NO_BETTER))


@pytest.mark.parametrize(
    ("chosen", "again", "said"),
    [
        (Fit(), replace(UNSTABLE, mse=0.1), KEPT.format(LOST)),
        (Fit(), replace(ALONE, mse=0.1), KEPT.format(STRANGE)),
        (UNSTABLE, replace(UNSTABLE, mse=0.1), BETTER),  # no worse than what there is
        (ALONE, replace(ALONE, mse=0.1), BETTER),
        (ALONE, replace(UNSTABLE, mse=0.1), KEPT.format(LOST)),
        (UNSTABLE, replace(ALONE, mse=0.9), BETTER),
    ],
)
def test_a_last_fit_that_is_unstable_or_stands_alone_is_not_taken_for_one_that_is_neither(
    monkeypatch: pytest.MonkeyPatch, chosen: Fit, again: Fit, said: str
) -> None:
    """On five steps the start of most evidence may run off; its error on the record is the least."""
    assert said_of(monkeypatch, chosen, again)[0] == said


def test_a_trial_that_was_checked_over_few_sequences_is_checked_over_all_before_it_is_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said, _ = said_of(monkeypatch, Fit(), replace(UNSTABLE, mse=0.1), over_all=Status.UNSTABLE)
    assert said == BETTER


def test_its_starts_are_asked_whether_they_stand_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    _, stability = said_of(monkeypatch, Fit(), Fit())
    assert stability.count == 7
    assert stability.also is not None
    models: Any = ("near", "alone")
    assert [stability.also(model) for model in models] == [True, False]
    assert "stands alone" in stability.unless
