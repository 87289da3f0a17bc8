"""Starts of a grey box that begin by multiple shooting, from windows to one free run; or by a growing part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.grey_box.at_noise import at_noise
from sysid.estimation.grey_box.layout import Begun, EquationLayout
from sysid.estimation.grey_box.provider import EquationProvider
from sysid.estimation.grey_box.shooting import Shooting
from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.networks.starts.advancing import PRETRAINED
from sysid.estimation.networks.starts.multistart import Candidate, Multistart
from sysid.estimation.networks.training import Training
from sysid.estimation.parameters.named import FLAT_ALPHA, Named
from sysid.estimation.results.result import FitResult, Status
from sysid.models.blocks.built_model import BuiltModel
from sysid.models.grey_box.grey_box_model import EquationModel

Array = NDArray[np.float64]

WEIGHTS = (0.1, 1.0, 10.0)
"""Of what windows leave apart, one after another: at first an output's error of a hundredth of its range is worth ten
hundredths of a state's, in the end a thousandth."""

ITERATIONS, TOLERANCE, PATIENCE = 40, 1e-2, 4
"""Of each: iterations at most; and the relative improvement over some of them below which the next one begins."""


GROWING = (0.125, 0.25, 0.5)
"""Shares of each record that are run one after another, from its beginning, where the run grows."""
FEWEST = 20
"""Samples of a record that are run at least."""


AUTO, SINGLE, MULTIPLE, GROW = "auto", "single", "multiple", "growing"


def may_shoot(training: Training, template: EquationModel, begins: Sequence[Begun]) -> bool:
    """Whether starts of a fit may begin by multiple shooting.

    Args:
        training: How it is trained.
        template: The model before its fit.
        begins: Starts that are given.

    Returns:
        Whether they may: not where starts are given or the equations were built of a structure, which begin near a
        minimum.
    """
    return training.shooting != SINGLE and not begins and not isinstance(template, BuiltModel)


def way_of(training: Training, template: EquationModel, begins: Sequence[Begun], *, runs: bool) -> str:
    """How the starts of a fit begin.

    Args:
        training: How it is trained.
        template: The model before its fit.
        begins: Starts that are given.
        runs: Whether the free run from the declared start stays by the records.

    Returns:
        As asked for. By default single shooting where that alone may be (:func:`may_shoot`); and where networks leave
        nothing known of what noise is, unless the declared start is lost.
    """
    if training.shooting != AUTO:
        return training.shooting
    if not may_shoot(training, template, begins):
        return SINGLE
    return (SINGLE if runs else MULTIPLE) if template.lowered.nets else AUTO


def shooting_terms(way: str, provider: EquationProvider) -> dict[str, Any]:
    """What a way asks of a multistart.

    Args:
        way: As of :func:`way_of`.
        provider: The residuals.

    Returns:
        Fields of :class:`~sysid.estimation.networks.starts.multistart.Multistart`.
    """
    if way == SINGLE:
        return {}

    if way == GROW:
        return {"prepared": grown}

    def prepared(multistart: Multistart, number: int, theta: Array) -> Array:
        return _shot(multistart, number, theta) if way == MULTIPLE or number == 1 else theta

    def enough(candidate: Candidate) -> bool:
        return at_noise(provider, candidate.solution.theta)

    return {"alone": 2, "enough": enough, "prepared": prepared}


def with_starts_begun(training: Training, multistart: Multistart, candidates: Sequence[Candidate]) -> Training:
    """The training with the starts that were begun, where others were not needed.

    Args:
        training: How a fit was trained.
        multistart: What its starts have in common.
        candidates: Every look at one of them.

    Returns:
        The training; as it is where all were begun, or there was no time for more.
    """
    begun = {one.number for one in candidates}
    if len(begun) < training.n_starts and any(multistart.enough(one) for one in candidates):
        return replace(training, starts=len(begun))
    return training


def with_way(found: FitResult, chosen: Candidate, way: str, begun: Training, asked: Training) -> FitResult:
    """A fit that says which way the minimum was found.

    Args:
        found: The fit.
        chosen: The start that was chosen, as it ended.
        way: As of :func:`way_of`.
        begun: The training with the starts that were begun.
        asked: As it was asked for.

    Returns:
        The fit; as it is where nothing but single shooting was asked for, and where no minimum was found.
    """
    if way == SINGLE or not found.status.usable:
        return found
    declared = chosen.number < (2 if way == AUTO else 1)
    multiple = way == MULTIPLE or (way == AUTO and chosen.number == 1)
    how = "a growing part of each record" if way == GROW else f"{MULTIPLE if multiple else SINGLE} shooting"
    what = "The minimum was" if found.status is Status.CONVERGED else "What is told was"
    note = f"{what} found by {how} from {'the declared start' if declared else f'start {chosen.number + 1}'}"
    if begun.n_starts < asked.n_starts:
        note += f", and what it leaves is white: {begun.n_starts} of {asked.n_starts} starts were needed"
    return replace(found, notes=(*found.notes, f"{note}."))


def _shot(multistart: Multistart, number: int, theta: Array) -> Array:
    """A start after multiple shooting; as it began where what was found has no free run, or no window could be run."""
    whole, layout = multistart.provider, multistart.layout
    assert isinstance(whole, EquationProvider)  # noqa: S101 - made for them
    assert isinstance(layout, EquationLayout)  # noqa: S101 - likewise
    windows, trained = Shooting.of(whole, theta).begun_at(whole, theta)
    with one_blas_thread():
        for weight in WEIGHTS:
            windows = replace(windows, weight=weight)
            if not np.isfinite(windows.loss(trained)):
                return theta
            name = f"{multistart.name}start {number + 1}, windows {weight:g}"
            prior = _prior(windows, trained, layout.named, windows.begun, windows.logs)
            said = f"multiple shooting, {weight:g} of {WEIGHTS[-1]:g}"
            engine = _engine(multistart, number, name, len(WEIGHTS), said)
            solution = multistart.checkpoints.minimise(name, engine, windows, trained, prior)
            trained = solution.theta
            if multistart.stop.is_set():
                break
    found = windows.ended(whole, trained, theta)
    return found if np.isfinite(whole.loss(found)) else theta


def grown(multistart: Multistart, number: int, theta: Array) -> Array:
    """A start after the free run over a growing part of each record.

    What sticks and slips, or swings by itself, is right over a short run before it is over a long one: over all of a
    record at once the error has a minimum wherever another number of slips falls together with the record's.

    Args:
        multistart: What the starts have in common, its residuals those of equations.
        number: Which start.
        theta: Where it begins.

    Returns:
        What is trained; as it began where the free run of what was found is none.
    """
    whole, layout = multistart.provider, multistart.layout
    assert isinstance(whole, EquationProvider)  # noqa: S101 - made for them
    assert isinstance(layout, EquationLayout)  # noqa: S101 - likewise
    trained, straight = theta, np.zeros(len(theta), dtype=bool)
    with one_blas_thread():
        for share in GROWING:
            part = replace(
                whole, records=tuple(one.first(max(FEWEST, round(share * len(one.output)))) for one in whole.records)
            )
            if not np.isfinite(part.loss(trained)):
                return theta
            name = f"{multistart.name}start {number + 1}, the first {share:.3g}"
            prior = _prior(part, trained, layout.named, theta, straight)
            engine = _engine(multistart, number, name, len(GROWING), f"the first {share:.0%} of each record")
            trained = multistart.checkpoints.minimise(name, engine, part, trained, prior).theta
            if multistart.stop.is_set():
                break
    return trained if np.isfinite(whole.loss(trained)) else theta


def _prior(
    residuals: AbstractProvider, trained: Array, named: tuple[Named, ...], begun: Array, logs: NDArray[np.bool_]
) -> Prior:  # fmt: skip
    """What is declared of parameters, and of the rest nothing; the noise as large as what is left."""
    known = [one for one in named if one.parameter.prior is not None]
    places = np.array([one.place for one in known], dtype=np.int64)
    centre, alphas, groups = trained.copy(), [FLAT_ALPHA], list[Group]()
    centre[: len(begun)] = begun
    others = np.setdiff1d(np.arange(len(trained)), places)
    groups.append(Group(name="all", members=others, known=True))
    for one in known:
        parameter = one.parameter
        assert parameter.prior is not None  # noqa: S101 - chosen by it
        size = parameter.start if logs[one.place] else parameter.scale
        groups.append(Group(name=one.name, members=np.array([one.place]), known=True))
        alphas.append((size / parameter.prior) ** 2)
    least = np.finfo(np.float64).tiny * residuals.n_samples
    beta = 0.5 * residuals.n_samples / max(residuals.loss(trained), least)
    return Prior(centre=centre, groups=tuple(groups), alphas=np.array(alphas), beta=beta)


def _engine(multistart: Multistart, number: int, name: str, stages: int, said: str) -> LevenbergMarquardt:
    training = multistart.training
    seconds = PRETRAINED * training.max_time_s / training.n_starts / stages
    limits = Termination(
        max_iterations=ITERATIONS,
        max_time_s=min(seconds, multistart.left(name)),
        tolerance=TOLERANCE,
        patience=PATIENCE,
    )
    return replace(multistart.engine(number, limits, stage=lambda _: said), evidence_after=None)
