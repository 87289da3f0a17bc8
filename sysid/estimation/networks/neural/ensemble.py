r"""Several neural state spaces of one structure as one model, whose free run is the mean of theirs.

Fits of one structure from other starts explain a short record alike and differ elsewhere. Their states have no common
coordinates, so that no parameter can be averaged; their outputs can:

.. math:: \bar y(t) = \sum_m \tfrac{n_m}{n} y_m(t), \qquad n = \sum_m n_m.

With the members' states side by side it is one neural state space (:class:`~sysid.models.NeuralEnsemble`), which is
exported, checked and timed as any. Where a sensor takes the absolute value, members are averaged before it: each is
turned so that it has the sign of the best. What an absolute value hides is then hidden once.

Who sits in it, by selection traces or by who stands alone, is found as for every structure (``starts/united.py``).

The posterior is that of the mixture: the mean of the members' own, and their spread. To scale one member's output up
and all others' down moves the whole by what lies between them, so that the spread is a direction of the parameters.

Limits: run time and size grow with the members; what all members share, such as too few states, does not cancel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.state import Iteration, Solution
from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.estimation.networks.posterior import Posterior, laplace
from sysid.estimation.networks.starts import multistart as starts
from sysid.estimation.networks.starts.advancing import judged
from sysid.estimation.networks.starts.choosing import rank
from sysid.estimation.networks.starts.election import elect
from sysid.estimation.networks.starts.united import BEHIND, AbstractUnited, elects, ends_of, stable_of, stand_together
from sysid.estimation.records.experiment import Experiment
from sysid.models import NeuralEnsemble, NeuralStateSpaceModel, VectorNeuralStateSpaceModel, beginning
from sysid.models.networks.neural_sizes import Sizes
from sysid.traces import Trace

Runs = tuple[NDArray[np.float64], ...]
"""Outputs in scaled numbers, one array of shape ``(n_samples, n_outputs)`` a record."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Member:
    """One start as a member may be.

    Args:
        candidate: The start.
        signs: What its outputs are multiplied with to have the signs of the best, shape ``(n_outputs,)``.
        runs: Its outputs over the records and on over their inputs backwards, as a sensor with a sign has them.
    """

    candidate: starts.Candidate
    signs: NDArray[np.float64]
    runs: Runs

    def turned(self, sizes: Sizes) -> NDArray[np.float64]:
        """What each of its parameters is multiplied with for these signs, shape ``(n_parameters,)``."""
        found = np.ones(sizes.count)
        for part in (sizes.output_linear, sizes.output_readout):
            found[part] = np.repeat(self.signs, (part.stop - part.start) // sizes.outputs)
        return found


@dataclass(frozen=True, kw_only=True, eq=False)
class United(AbstractUnited):
    """The ensemble of neural state spaces; see the base class.

    Args:
        members: Whom it unites, the first pick first.
    """

    members: tuple[Member, ...]

    @property
    def made(self) -> str:
        """See the base class."""
        n = len(self.members)
        return f"the mean of {n} free runs as one model; it has {n} times the states and parameters of one"

    def posterior(self, runs: Sequence[Experiment], unread: NDArray[np.int64]) -> Posterior | None:
        """The posterior of the mixture, not calibrated.

        Args:
            runs: The estimation records as the ensemble's free run goes over them.
            unread: Places of parameters that no record's run depends on: their uncertainty is not known.

        Returns:
            The posterior; ``None`` where a member's evidence was never computed.
        """
        model, blocks = _model(self.candidate), list[NDArray[np.float64]]()
        form = _form(model)
        sizes, noise = form.sizes, None
        for member, weight in zip(self.members, form.weights, strict=True):
            state, turned = member.candidate.solution.state, np.diag(member.turned(sizes))
            to_plain = np.eye(sizes.count, len(state.theta))
            to_plain[unread] = 0.0
            sizes.along(state.theta, to_plain.T)
            own = laplace(state, member.candidate.model, turned @ to_plain, runs, copies=1)
            if own is None:
                return None
            blocks.append(own.factor / np.sqrt(weight))
            if noise is None:
                whole = laplace(state, model, to_plain, runs, copies=1)
                noise = None if whole is None else whole.noise
        assert noise is not None  # noqa: S101 - of the first member
        return Posterior(factor=_side_by_side(blocks, _spread(form)), noise=noise)


def united(
    multistart: starts.Multistart,
    provider: NeuralProvider,
    candidates: Sequence[starts.Candidate],
    vet: Callable[[starts.Network], bool] | None = None,
) -> United | None:
    """The ensemble of the starts of a multistart.

    Args:
        multistart: The multistart; its training says how many members there are at most.
        provider: The residuals.
        candidates: Every start at every look.
        vet: Whether a model's free run is stable: where one member runs away, so does the mean.

    Returns:
        It; ``None`` where fewer than two remain, or no second pick helps.
    """
    by, most, elected = (
        multistart.training.choose_by,
        multistart.training.ensemble,
        elects(multistart.training, multistart.selection),
    )
    usable = sorted((one for one in candidates if one.solution.status.usable), key=lambda one: rank(one, by))
    usable = usable if elected else ends_of(candidates, by)
    usable, unstable = stable_of(usable, None if elected else vet, len(usable) if elected else most)
    members = [one for one in _turned(provider, usable) if all(np.isfinite(run).all() for run in one.runs)]
    if elected:
        picked, left = _elected(multistart, provider, members), list[Member]()
    else:
        kept, left = _together(provider, members)
        picked = [(one, 1) for one in kept]
    if sum(picks for _, picks in picked) < 2:
        return None
    found = _candidate(multistart, provider, picked)
    left_out = tuple(one.candidate.number for one in left)
    members = [one for one, _ in picked]
    return United(candidate=found, members=tuple(members), left_out=left_out, unstable=unstable, elected=elected)


def _turned(provider: NeuralProvider, candidates: Sequence[starts.Candidate]) -> list[Member]:
    """The starts, each with the signs of the first where outputs have none."""
    found = list[Member]()
    for candidate in candidates:
        runs, signs = provider.there_and_back(candidate.solution.theta), np.ones(provider.template.sizes.outputs)
        if found and provider.template.rectified:
            alike = sum(np.sum(own * first, axis=0) for own, first in zip(runs, found[0].runs, strict=True))
            signs = np.where(np.asarray(alike) < 0.0, -1.0, 1.0)
        found.append(Member(candidate=candidate, signs=signs, runs=tuple(signs * run for run in runs)))
    return found


def _together(provider: NeuralProvider, members: Sequence[Member]) -> tuple[list[Member], list[Member]]:
    """Those who stand together, and the others."""
    losses = [provider.loss_of(_forward(one.runs)) for one in members]
    close = [loss <= BEHIND**2 * min(losses) for loss in losses]
    near = stand_together(close, [np.concatenate([run[len(run) // 2 :] for run in one.runs]) for one in members])
    kept = [member for member, one in zip(members, near, strict=True) if one]
    return kept, [member for member, one in zip(members, near, strict=True) if not one]


def _forward(runs: Runs) -> Runs:
    return tuple(run[: len(run) // 2] for run in runs)


def _elected(
    multistart: starts.Multistart, provider: NeuralProvider, members: Sequence[Member]
) -> list[tuple[Member, int]]:
    """Those whom the selection traces elect, with their picks.

    The mean of runs is the run of the mean, so that each start runs over them once.
    """
    form = provider.template
    signed = [_over_selection(multistart, one) for one in members]
    targets = [_scored(multistart, members[0].candidate, trace) for trace in multistart.selection] if members else []

    def score(runs: Runs) -> float:
        errors = list[float]()
        for run, (target, counts) in zip(runs, targets, strict=True):
            y = np.clip(np.abs(run) if form.rectified else run, form.low, form.high)
            off = zip((y - target).T, counts.T, strict=True)
            errors += [float(np.mean(column[own] ** 2)) for column, own in off if own.any()]
        with np.errstate(divide="ignore"):
            return float(np.exp(np.mean(np.log(errors))))

    def mean(some: Sequence[Runs], picks: Sequence[int]) -> Runs:
        return tuple(np.average(runs, axis=0, weights=picks) for runs in zip(*some, strict=True))

    found = elect(
        signed,
        [score(runs) for runs in signed],
        score,
        unite=mean,
        picks=multistart.training.ensemble,
        origins=[one.candidate.number for one in members],
    )
    return [(members[i], picks) for i, picks in found.picks.items()] if found else []


def _over_selection(multistart: starts.Multistart, member: Member) -> Runs:
    """A start's outputs over the selection traces, as a sensor with a sign has them."""
    model, found = _model(member.candidate), list[NDArray[np.float64]]()
    form = model.recursion
    signed = replace(form, rectified=False, low=-np.inf, high=np.inf)
    for trace in multistart.selection:
        inputs = trace.columns(model.mapping.inputs)
        begun = beginning(model, inputs, model.measured(trace), multistart.start, trace.usable_samples, case=trace.name)
        run = signed.run(form.scaled(inputs[begun.first :]), form.state(begun.history))
        found.append(member.signs * run)
    return tuple(found)


def _scored(
    multistart: starts.Multistart, candidate: starts.Candidate, trace: Trace
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Measured outputs of a selection trace in scaled numbers, and which samples of each are scored."""
    model = _model(candidate)
    measured = model.measured(trace)
    inputs = trace.columns(model.mapping.inputs)
    n = beginning(model, inputs, measured, multistart.start, trace.usable_samples, case=trace.name).first
    return model.recursion.scaled_outputs(measured[n:]), trace.counted(model.mapping.inputs, model.mapping.outputs)[n:]


def _candidate(
    multistart: starts.Multistart, provider: NeuralProvider, picked: Sequence[tuple[Member, int]]
) -> starts.Candidate:
    """The ensemble as a candidate, with the learning curve of its first member and itself as the last point of it."""
    members, shares = [one for one, _ in picked], tuple(picks for _, picks in picked)
    thetas = [one.turned(provider.template.sizes) * _model(one.candidate).theta for one in members]
    model = replace(_model(members[0].candidate), theta=np.concatenate(thetas), shares=shares)
    runs = [np.average(each, axis=0, weights=shares) for each in zip(*(one.runs for one in members), strict=True)]
    loss = provider.loss_of(_forward(tuple(runs)))
    lead = members[0].candidate.solution
    entry = Iteration(
        iteration=lead.curve[-1].iteration,
        mse=2.0 * loss / provider.n_samples,
        damping=lead.curve[-1].damping,
        effective_parameters=float("nan"),
        elapsed_s=lead.curve[-1].elapsed_s,
    )
    state = replace(lead.state, at=replace(lead.state.at, loss=loss), evidence=None, curve=(*lead.curve, entry))
    score, outside = judged(multistart, model)
    return starts.Candidate(
        number=multistart.training.n_starts,
        seed=None,
        solution=Solution(state=state, status=lead.status),
        model=model,
        score=score,
        outside=outside,
        members=tuple(one.candidate.number for one, picks in picked for _ in range(picks)),
    )


def _model(candidate: starts.Candidate) -> NeuralStateSpaceModel | VectorNeuralStateSpaceModel:
    assert isinstance(candidate.model, NeuralStateSpaceModel | VectorNeuralStateSpaceModel)  # noqa: S101 - all are
    return candidate.model


def _form(model: NeuralStateSpaceModel | VectorNeuralStateSpaceModel) -> NeuralEnsemble:
    form = model.recursion
    assert isinstance(form, NeuralEnsemble)  # noqa: S101 - of several members
    return form


def _spread(form: NeuralEnsemble) -> NDArray[np.float64]:
    """Directions along which the output moves by what lies between a member and the mean; one column a member."""
    weights, s = form.weights, form.sizes
    scaled = np.zeros((len(weights), s.count))
    for at, member in enumerate(form.members):
        for part in (s.output_linear, s.output_readout):
            scaled[at, part] = member.theta[part]
    columns = []
    for at, weight in enumerate(weights):
        by = np.where(np.arange(len(weights)) == at, 1.0 / weights, 0.0) - 1.0
        columns.append(np.sqrt(weight) * (by[:, None] * scaled).ravel())
    return np.column_stack(columns)


def _side_by_side(blocks: Sequence[NDArray[np.float64]], more: NDArray[np.float64]) -> NDArray[np.float64]:
    """Blocks on a diagonal, and columns beside it."""
    rows = np.cumsum([0, *(len(block) for block in blocks)])
    columns = np.cumsum([0, *(block.shape[1] for block in blocks)])
    found = np.zeros((rows[-1], columns[-1]))
    for block, row, column in zip(blocks, rows, columns, strict=False):
        found[row : row + len(block), column : column + block.shape[1]] = block
    return np.hstack([found, more])
