"""Training end to end runs what its targets depend on, and leaves the rest of the whole as it was."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sysid.composite.composite import Composite
from sysid.composite.plan import RoundPlan
from sysid.composite.rounds import round as joint_round
from sysid.composite.rounds.round import JointRound, train_round
from sysid.estimation import JointTraining, fit_cascade
from sysid.models import Cascade
from sysid.traces import Channel, Trace
from tests.composite.composites import member
from tests.models.cascades.cascades import command, network, service

CHAIN = Composite(members=(member("STP -> BP"), member("BP -> AR"), member("BP+AR -> BC")))


def record(seed: int = 0, n: int = 120) -> Trace:
    """The chain's own run, with an error of every channel."""
    run = service().simulate(command(n, 1, seed))
    noise = np.random.default_rng(seed).normal(0.0, 1.0, run.values.shape)
    channels = tuple(Channel(name=name, unit="psi") for name in service().wiring.channels)
    return Trace(name=f"record {seed}", sample_time=0.1, channels=channels, values=run.values + noise)


def trained(monkeypatch: pytest.MonkeyPatch, **asked) -> tuple[Cascade, Cascade, list[str]]:
    """The whole after a round, what the fit was given of it, and the members it trained."""
    given: list[tuple[Cascade, list[str]]] = []

    def fit(cascade, *args, **kwargs):
        given.append((cascade, list(kwargs["trained"])))
        return fit_cascade(cascade, *args, **kwargs)

    monkeypatch.setattr(joint_round, "fit_cascade", fit)
    plan = RoundPlan(training=JointTraining(max_iterations=2, checkpoints=1, workers=1), **asked)
    found = train_round(CHAIN, plan, service(), estimation=[record()], selection=[])
    ((part, names),) = given
    return found.model, part, names


def changed(whole: Cascade) -> set[str]:
    return {
        name for name in whole.outputs if not np.array_equal(whole.member(name).theta, service().member(name).theta)
    }


def test_what_no_target_depends_on_is_neither_run_nor_trained(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, part, names = trained(monkeypatch, targets={"AR": 1.0})
    assert (part.outputs, names) == (("BP", "AR"), ["BP", "AR"])
    assert changed(whole) == {"BP", "AR"}
    assert whole.outputs == service().outputs


def test_what_is_measured_is_an_input_and_comes_back_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, part, names = trained(monkeypatch, targets={"BC": 1.0}, measured=("BP",))
    assert (set(part.inputs), set(part.outputs), names) == ({"BP"}, {"AR", "BC"}, ["AR", "BC"])
    assert changed(whole) == {"AR", "BC"}
    assert_array_equal(whole.member("BP").theta, service().member("BP").theta)


def test_what_it_depends_on_is_the_same_in_whichever_order_the_whole_has_its_members() -> None:
    members = (network("STP -> BP", seed=1), network("STP -> AR", seed=2), network("BP+AR -> BC", seed=3))
    terms = [
        JointRound.of(
            CHAIN,
            RoundPlan(targets={"BC": 1.0}),
            Cascade(models=order),
            estimation=[record()],
            selection=[],
        ).terms
        for order in permutations(members)
    ]
    assert all(one == terms[0] for one in terms)


def test_its_error_is_that_by_which_it_chooses_among_its_states() -> None:
    training = JointTraining(max_iterations=2, checkpoints=1)
    ready = JointRound.of(
        CHAIN,
        RoundPlan(targets={"AR": 0.5, "BC": 2.0}, measured=("BP",), training=training),
        service(),
        estimation=[record()],
        selection=[record(), record(1)],
    )
    fit = ready.put(ready.fit())
    start, end = ready.error(ready.whole), ready.error(fit.model)
    assert end < start
    (chosen,) = [one for one in fit.attempts if one.chosen]
    given = fit.attempts[0]
    assert chosen.selection_mse == pytest.approx(end)
    assert (given.iterations, given.status, given.selection_mse) == (0, "", pytest.approx(start))


def test_a_target_that_is_met_exactly_does_not_outweigh_the_others() -> None:
    own = service().simulate(command(120, 1, 0))
    exact = replace(record(), values=np.where(np.array(record().channel_names) == "BC", record().values, own.values))
    ready = JointRound.of(
        CHAIN,
        RoundPlan(targets={"AR": 0.5, "BC": 2.0}, training=JointTraining(max_iterations=1)),
        service(),
        estimation=[record()],
        selection=[exact],
    )
    start = ready.error(ready.whole)
    assert start == pytest.approx(np.sqrt(1e-6 * np.mean((own["BC"] - exact["BC"]) ** 2) / 2.0**2))
    assert start == pytest.approx(ready.fit().attempts[0].selection_mse)


def test_members_that_are_named_are_the_ones_trained(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, _, names = trained(monkeypatch, targets={"BC": 1.0}, members=("AR",))
    assert names == ["AR"]
    assert changed(whole) == {"AR"}
