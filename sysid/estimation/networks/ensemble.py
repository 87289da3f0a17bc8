r"""Several NARX networks of one structure, united into one: what their errors do not share cancels.

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

Who sits in it, by selection traces or by who stands alone, is found as for every structure (``starts/united.py``).

Limits: the price of a free run grows with the members; all must agree on what a regressor means: hidden states, which
have no common coordinates, stand side by side (``neural/ensemble.py``); the united network does not stand at a minimum
of its own loss, so that the posterior there is wider than that of a single fit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.evidence import settled
from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.state import Iteration, Solution
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.middle import backwards, model_of
from sysid.estimation.networks.starts import multistart as starts
from sysid.estimation.networks.starts.advancing import first_prior, judged
from sysid.estimation.networks.starts.election import elect
from sysid.estimation.networks.starts.united import AbstractUnited, elects, ends_of, keep_up, stable_of, stand_together
from sysid.estimation.networks.training import FitProgress
from sysid.estimation.records.experiment import Experiment
from sysid.models import NARXModel, VectorNARXModel

Lagged = TypeVar("Lagged", NARXModel, VectorNARXModel)


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


@dataclass(frozen=True, kw_only=True, eq=False)
class Members:
    """Who sits in an ensemble.

    Args:
        model: The united network.
        candidates: They, the first pick first.
        picks: Of each.
        left_out: Starts that stand alone, or far behind.
        unstable: Starts that were refused, as a rule as their own free run is not stable.
    """

    model: NARXModel | VectorNARXModel
    candidates: tuple[starts.Candidate, ...]
    picks: tuple[int, ...]
    left_out: tuple[int, ...] = ()
    unstable: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class United(AbstractUnited):
    """The ensemble of NARX networks; see the base class.

    Args:
        networks: How many it unites; a start that was elected may be in it as it was at two looks.
    """

    networks: int

    @property
    def made(self) -> str:
        """See the base class."""
        n = self.networks
        return f"the mean of {n} networks' maps one step ahead as one network; it has {n} times the neurons of one"


def members_of(
    multistart: starts.Multistart,
    candidates: Sequence[starts.Candidate],
    experiments: Sequence[Experiment],
    vet: Callable[[starts.Network], bool] | None = None,
) -> Members | None:
    """Who sits in the ensemble of a multistart's starts.

    Args:
        multistart: The multistart; its training says how many picks there are.
        candidates: Every start at every checkpoint.
        experiments: The estimation records.
        vet: Whether a model's free run is stable; an ensemble must be.

    Returns:
        They; ``None`` where fewer than two remain, or no second pick helps.
    """
    if elects(multistart.training, multistart.selection):
        return _elected(multistart, candidates, vet)
    return _together(multistart, candidates, experiments, vet)


def _elected(
    multistart: starts.Multistart,
    candidates: Sequence[starts.Candidate],
    vet: Callable[[starts.Network], bool] | None,
) -> Members | None:
    """Those whom the selection traces elect."""
    usable = [c for c in candidates if c.solution.status.usable]
    if not usable:
        return None
    training, scale = multistart.training, multistart.template.scaling.error_unit
    mse = 2.0 * min(c.loss for c in usable) / multistart.provider.n_samples * scale

    def report(pick: int) -> None:
        multistart.on_progress(
            FitProgress(
                stage=f"pick {pick} of {training.ensemble}",
                start=training.n_starts,
                starts=training.n_starts,
                iteration=training.max_iterations,
                max_iterations=training.max_iterations,
                mse=mse,
                elapsed_s=0.0,
                fraction=1.0,
            )
        )

    found = elect(
        # of one output or of several, all alike, which the type of the list cannot say
        [cast("NARXModel", model_of(c)) for c in usable],
        [c.score for c in usable],
        lambda model: judged(multistart, model)[0],
        unite=united,
        picks=training.ensemble,
        origins=[c.number for c in usable],
        accept=vet or (lambda _: True),
        workers=training.workers,
        on_pick=report,
    )
    if found is None or sum(found.picks.values()) < 2:
        return None
    # the very network that was accepted: a check that knows it need not run again
    some, picks = tuple(usable[i] for i in found.picks), tuple(found.picks.values())
    return Members(model=found.model, candidates=some, picks=picks)


def _together(
    multistart: starts.Multistart,
    candidates: Sequence[starts.Candidate],
    experiments: Sequence[Experiment],
    vet: Callable[[starts.Network], bool] | None,
) -> Members | None:
    """The best starts that stand together on inputs that nobody measured."""
    training = multistart.training
    usable, unstable = stable_of(ends_of(candidates, training.choose_by), vet, training.ensemble)
    runs = {one: backwards(model_of(one), experiments) for one in usable}
    finite = [one for one, run in runs.items() if np.isfinite(run).all()]
    near = stand_together(keep_up(finite, multistart.provider.n_samples), [runs[one] for one in finite])
    kept = tuple(one for one, stays in zip(finite, near, strict=True) if stays)
    left = tuple(one.number for one in usable if one not in kept)
    if len(kept) < 2:
        return None
    picks = (1,) * len(kept)
    model = united([cast("NARXModel", model_of(one)) for one in kept], picks)
    return Members(model=model, candidates=kept, picks=picks, left_out=left, unstable=unstable)


def as_start(multistart: starts.Multistart, members: Members, task: Task) -> United:
    """The ensemble as one more candidate of its multistart.

    Its learning curve is that of its first member, with the united network as the last point; precisions and evidence
    are those at the united parameters, where no step is taken.

    Args:
        multistart: The multistart.
        members: Who sits in it.
        task: What is minimised, for its network.

    Returns:
        The candidate, and what is said of it.
    """
    model = members.model
    theta, centre = (
        np.asarray(np.linalg.solve(task.to_plain, plain), dtype=np.float64)
        for plain in (model.theta, task.layout.centre())
    )
    prior, evidence = first_prior(multistart.training, task.layout, task.provider, theta, centre), None
    with one_blas_thread():
        at = task.provider.linearise(theta)
        if multistart.training.regularisation is None:
            prior, evidence = settled(prior, theta, at, task.provider.n_samples)
    lead = members.candidates[0].solution
    last = lead.curve[-1]
    entry = Iteration(
        iteration=last.iteration,
        mse=2.0 * at.loss / task.provider.n_samples,
        damping=last.damping,
        effective_parameters=evidence.total_effective_parameters if evidence else float("nan"),
        elapsed_s=last.elapsed_s,
    )
    state = replace(lead.state, theta=theta, at=at, prior=prior, evidence=evidence, curve=(*lead.curve, entry))
    score, outside = judged(multistart, model)
    candidate = starts.Candidate(
        number=multistart.training.n_starts,
        seed=None,
        solution=Solution(state=state, status=lead.status),
        model=model,
        score=score,
        outside=outside,
        members=tuple(
            one.number for one, picks in zip(members.candidates, members.picks, strict=True) for _ in range(picks)
        ),
    )
    return United(
        candidate=candidate,
        left_out=members.left_out,
        unstable=members.unstable,
        elected=elects(multistart.training, multistart.selection),
        networks=len(members.candidates),
    )


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
