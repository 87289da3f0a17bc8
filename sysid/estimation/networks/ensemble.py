r"""Several networks of one structure, united into one: what their errors do not share cancels.

Networks that began at different starts, and the same start earlier and later, are wrong in different ways where the
record did not show them what to do. The mean of their one-step maps

.. math:: \bar f(x) = \sum_m \tfrac{n_m}{n} f_m(x), \qquad n = \sum_m n_m,

with :math:`n_m` picks of member :math:`m`, is itself a network: the members' neurons side by side, readouts and gates
multiplied by their share of the picks, constants and linear parts averaged. In free run, with the members' errors one
step ahead :math:`\delta_m(x)` and the sensitivity :math:`a = \partial f / \partial y` that they nearly share,

.. math:: e(t) = a\,e(t-1) + \sum_m \tfrac{n_m}{n}\,\delta_m(x_t) :

to first order its error is the mean of theirs, and where those are independent its square falls with the number of
members (Perrone and Cooper 1993, "When networks disagree", for networks without feedback). One network comes out, which
is exported, checked and timed like any other.

Who sits in it is found by forward selection with replacement (Caruana et al. 2004, "Ensemble selection from libraries
of models", section 2.1) from the best candidates of the multistart: the pick that lowers the error of the united run on
the selection traces most is cast next, until none lowers it by :data:`WORTH`. A network that sticks or runs away on
some inputs takes the mean with it, though: the united network has to pass the check of its free run, where there is
one, and where it does not, picks are cast once more and it has to after every pick.

Limits: the price of a free run grows with the members; all must agree on what a regressor means: hidden states, which
have no common coordinates, stand side by side (``neural_ensemble.py``); the selection traces choose more often than
between single starts, so that their score is the less a figure of accuracy; the united network does not stand at a
minimum of its own loss, so that the posterior there is wider than that of a single fit.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Generic, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.least_squares.evidence import settled
from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.state import Iteration, Solution
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.starts import multistart as starts
from sysid.estimation.networks.starts.advancing import first_prior, judged
from sysid.estimation.networks.training import FitProgress, Training
from sysid.models import NARXModel, VectorNARXModel
from sysid.traces import Trace

ELIGIBLE = 40
"""Candidates that may be picked, best on the selection traces first."""

WORTH = 0.01
"""Least share by which a pick has to lower the error: neurons that bring less are not worth their run time."""


def check(training: Training, selection: Sequence[Trace]) -> None:
    """Refuse an ensemble that nothing could choose.

    Args:
        training: How to train.
        selection: Traces that choose.

    Raises:
        ConfigError: If an ensemble is asked for and no traces choose.
    """
    if training.ensemble > 1 and (training.choose_by != "selection" or not selection):
        raise ConfigError(
            "nothing can choose the members of an ensemble",
            where="ensemble",
            expected="selection traces, and choose_by: selection",
            got=f"{len(selection)} selection traces, choose_by: {training.choose_by}",
            remedy="give traces that train nothing, or leave ensemble out",
        )


Lagged = TypeVar("Lagged", NARXModel, VectorNARXModel)
Whole = TypeVar("Whole")
"""What a ballot is about: networks, or their runs, of which the mean is taken as well."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ensemble(Generic[Whole]):
    """Who was selected.

    Args:
        picks: For each member its place among the candidates and its picks, in the order of their first pick.
        model: The united network, or what stands for it.
        score: Its error on the selection traces.
    """

    picks: dict[int, int]
    model: Whole
    score: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Task:
    """What is minimised, for the network that the ensemble makes.

    Args:
        provider: Residuals in the basis of training.
        layout: Where the parameters stand.
        to_plain: From parameters in the basis to plain ones, shape ``(n_parameters, n_parameters)``.
    """

    provider: AbstractProvider
    layout: Layout
    to_plain: NDArray[np.float64]


def selected(
    multistart: starts.Multistart,
    candidates: Sequence[starts.Candidate],
    vet: Callable[[starts.Network], bool] | None = None,
) -> tuple[Ensemble[NARXModel], list[starts.Candidate]] | None:
    """The ensemble of the candidates of a multistart.

    Args:
        multistart: The multistart; its training says how many picks there are.
        candidates: Every start at every checkpoint.
        vet: Whether a model's free run is stable; an ensemble must be.

    Returns:
        The ensemble and those whom its picks count; ``None`` where no second pick helps.
    """
    usable = [c for c in candidates if c.solution.status.usable]
    models = [cast("NARXModel", c.model) for c in usable]  # other networks refuse ensembles before they are trained
    if not usable:
        return None
    training = multistart.training
    scale = multistart.template.scaling.error_unit

    def report(pick: int) -> None:
        multistart.on_progress(
            FitProgress(
                stage=f"pick {pick} of {training.ensemble}",
                start=training.n_starts,
                starts=training.n_starts,
                iteration=training.max_iterations,
                max_iterations=training.max_iterations,
                mse=2.0 * min(c.loss for c in usable) / multistart.provider.n_samples * scale,
                elapsed_s=0.0,
                fraction=1.0,
            )
        )

    found = elect(
        models,
        [c.score for c in usable],
        lambda model: judged(multistart, model)[0],
        unite=united,
        picks=training.ensemble,
        origins=[c.number for c in usable],
        accept=vet or (lambda _: True),
        workers=training.workers,
        on_pick=report,
    )
    return (found, usable) if found and sum(found.picks.values()) > 1 else None


def as_candidate(
    multistart: starts.Multistart, ensemble: Ensemble[NARXModel], members: Sequence[starts.Candidate], task: Task
) -> starts.Candidate:
    """The ensemble as one more candidate of its multistart.

    Its learning curve is that of its first member, with the united network as the last point; precisions and evidence
    are those at the united parameters, where no step is taken.

    Args:
        multistart: The multistart.
        ensemble: Whom the picks selected.
        members: The candidates that the picks count.
        task: What is minimised, for the united network.

    Returns:
        The candidate.
    """
    theta, centre = (
        np.asarray(np.linalg.solve(task.to_plain, plain), dtype=np.float64)
        for plain in (ensemble.model.theta, task.layout.centre())
    )
    prior, evidence = first_prior(multistart.training, task.layout, task.provider, theta, centre), None
    with one_blas_thread():
        at = task.provider.linearise(theta)
        if multistart.training.regularisation is None:
            prior, evidence = settled(prior, theta, at, task.provider.n_samples)
    lead = members[next(iter(ensemble.picks))].solution
    last = lead.curve[-1]
    entry = Iteration(
        iteration=last.iteration,
        mse=2.0 * at.loss / task.provider.n_samples,
        damping=last.damping,
        effective_parameters=evidence.total_effective_parameters if evidence else float("nan"),
        elapsed_s=last.elapsed_s,
    )
    state = replace(lead.state, theta=theta, at=at, prior=prior, evidence=evidence, curve=(*lead.curve, entry))
    return starts.Candidate(
        number=multistart.training.n_starts,
        seed=None,
        solution=Solution(state=state, status=lead.status),
        model=ensemble.model,
        score=ensemble.score,
        members=tuple(members[i].number for i, picks in ensemble.picks.items() for _ in range(picks)),
    )


def elect(
    models: Sequence[Whole],
    scores: Sequence[float],
    score: Callable[[Whole], float],
    *,
    unite: Callable[[Sequence[Whole], Sequence[int]], Whole],
    picks: int,
    origins: Sequence[int] | None = None,
    accept: Callable[[Whole], bool] = lambda _: True,
    workers: int = 1,
    on_pick: Callable[[int], None] = lambda _: None,
) -> Ensemble[Whole] | None:
    """Make the picks one after the other, each for the member that helps most.

    A check of a free run costs as much as a pick. The one that matters is that of the network that comes out: picks are
    first cast unchecked, and only where that network fails they are cast once more, with a check after every one.

    Args:
        models: The candidates, all of one structure and scaling.
        scores: Error of each on the selection traces; one that is not finite is not eligible.
        score: The error of a model on them.
        unite: The mean of some, by the picks of each.
        picks: At most so many.
        origins: The start that each candidate comes from; by default each is its own.
        accept: Whether a united network may stand; where picks are cast once more, whoever would make it one that may
            not is passed over from then on, and with him all that come from the same start.
        workers: Models that are run at the same time.
        on_pick: Called with the number of each pick that is about to be cast.

    Returns:
        The ensemble, of one member where no second pick helps; ``None`` where not even one may stand.
    """
    ballot = partial(
        _cast,
        models,
        scores,
        score,
        unite=unite,
        picks=picks,
        origins=origins or range(len(models)),
        workers=workers,
        on_pick=on_pick,
    )
    unchecked = ballot(accept=lambda _: True)
    return unchecked if unchecked is None or accept(unchecked.model) else ballot(accept=accept)


def _cast(
    models: Sequence[Whole],
    scores: Sequence[float],
    score: Callable[[Whole], float],
    *,
    unite: Callable[[Sequence[Whole], Sequence[int]], Whole],
    picks: int,
    origins: Sequence[int],
    accept: Callable[[Whole], bool],
    workers: int,
    on_pick: Callable[[int], None],
) -> Ensemble[Whole] | None:
    """The picks made, each checked; see :func:`elect`."""
    order = sorted((i for i, value in enumerate(scores) if np.isfinite(value)), key=lambda i: scores[i])
    eligible, found = order[:ELIGIBLE], dict(enumerate(scores))
    ensemble: Ensemble[Whole] | None = None
    with ThreadPoolExecutor(workers) as pool:
        for pick in range(1, picks + 1):
            on_pick(pick)
            selected = Counter(ensemble.picks) if ensemble else Counter[int]()
            networks = {i: _of(models, selected + Counter([i]), unite) for i in eligible}
            if ensemble:
                found = dict(zip(eligible, pool.map(score, networks.values()), strict=True))
            bar = (1.0 - WORTH) * ensemble.score if ensemble else np.inf
            better = sorted((i for i in eligible if found[i] < bar), key=found.__getitem__)
            cast, barred = _first_accepted(better, origins, networks, accept)
            if cast is None:
                break
            # the very network that was accepted: a check that knows it need not run again
            tally = dict(selected + Counter([cast]))
            ensemble = Ensemble(picks=tally, model=networks[cast], score=found[cast])
            eligible = [i for i in eligible if origins[i] not in barred]
    return ensemble


def _first_accepted(
    ranked: Sequence[int],
    origins: Sequence[int],
    networks: Mapping[int, Whole],
    accept: Callable[[Whole], bool],
) -> tuple[int | None, set[int]]:
    """Who is picked, and the starts that are passed over from now on."""
    barred: set[int] = set()
    for i in ranked:
        if origins[i] in barred:
            continue
        if accept(networks[i]):
            return i, barred
        barred.add(origins[i])
    return None, barred


def _of(
    models: Sequence[Whole], picks: Counter[int], unite: Callable[[Sequence[Whole], Sequence[int]], Whole]
) -> Whole:
    return unite([models[i] for i in picks], list(picks.values()))


def united(members: Sequence[Lagged], picks: Sequence[int]) -> Lagged:
    """The network whose one-step map is the mean of the members'.

    Args:
        members: Of one structure, mapping and scaling.
        picks: Of each.

    Returns:
        The network, with the neurons of all; a single member comes back as it is.
    """
    first = members[0]
    if len(members) == 1:
        return first
    layout = Layout.of(first.network, len(first.mapping.inputs), len(first.mapping.outputs))
    hidden, outputs = layout.neurons * layout.lags.n_regressors, len(layout.outputs)
    shares = np.array(picks) / sum(picks)
    thetas = [member.theta for member in members]
    parts = [theta[:hidden] for theta in thetas]
    parts += [theta[hidden : layout.hidden.stop] for theta in thetas]
    readouts = [share * theta[layout.readout].reshape(outputs, -1) for share, theta in zip(shares, thetas, strict=True)]
    parts += [np.concatenate(readouts, axis=1).ravel()]
    parts += [shares @ np.array([theta[layout.affine] for theta in thetas])]
    parts += [share * theta[layout.gates] for share, theta in zip(shares, thetas, strict=True)]
    network = first.network.resized(len(members) * layout.neurons)
    return replace(first, network=network, theta=np.concatenate(parts))
