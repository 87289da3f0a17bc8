"""A fit of equations taken up again, for the profile of one of its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sysid.errors import ConfigError
from sysid.estimation.grey_box.finishing import noise_of
from sysid.estimation.grey_box.layout import EquationLayout
from sysid.estimation.grey_box.preparing import WINDOW, provider_for
from sysid.estimation.grey_box.profile import LEVEL, TERMS, Profile, Profiler
from sysid.estimation.grey_box.provider import EquationProvider
from sysid.estimation.grey_box.record import Record
from sysid.estimation.least_squares.evidence import update
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.state import Solution
from sysid.estimation.parameters.named import named_of
from sysid.estimation.records.experiment import experiments_of
from sysid.estimation.results.result import FitResult
from sysid.models import Start
from sysid.models.grey_box.grey_box import PROFILE
from sysid.models.grey_box.grey_box_model import EquationModel
from sysid.traces import Trace

ROUNDS = 3
"""Times that the fit goes on, with the noise that it left before."""


def profile_again(fit: FitResult, traces: Sequence[Trace], start: Start, name: str, level: float = LEVEL) -> Profile:
    """The profile of one parameter of a fit that has ended.

    Args:
        fit: The fit.
        traces: The records that it was fitted to.
        start: How they begin.
        name: Of the parameter; ``mass of run1`` of one that differs by case.
        level: Probability of the interval.

    Returns:
        The profile.

    Raises:
        ConfigError: If the fit has no such parameter, or what remains of it does not say how it was fitted.
    """
    model = fit.model
    if not isinstance(model, EquationModel) or model.structure is not model.grey or fit.evidence is None:
        raise ConfigError(
            "there is no profile of this fit", where="profile", expected="equations that were fitted to their end",
            got=model.structure.label, remedy="fit a GreyBox, with more iterations where it ended early",
        )  # fmt: skip
    if any(not one.root for one in model.lowered.switches):
        raise ConfigError(
            "the switches of the equations were trained soft, and the fit does not say how soft", where="profile",
            expected="equations without switches", got=model.structure.label,
            remedy=f"write intervals: {PROFILE} in the structure: the profiles are then made by the fit",
        )  # fmt: skip
    if not 0.0 < level < 1.0:
        raise ConfigError("not a probability", where="level", expected="between 0 and 1", got=level)
    named = {one.name: one for one in named_of(model.grey, model.cases, model.lowered.n_weights)}
    if name not in named:
        what = f"no parameter {name} was estimated"
        raise ConfigError.unknown(what, name, named, "name one of these", where="profile")
    provider, solution = _again(model, fit, traces, start)
    return Profiler(provider=provider, solution=solution, level=level).of(named[name])


def _again(
    model: EquationModel, fit: FitResult, traces: Sequence[Trace], start: Start
) -> tuple[EquationProvider, Solution]:
    """The records, and the fit at its end: initial states are found anew, parameters hardly move."""
    form, resting = model.recursion, model.resting
    experiments = experiments_of(traces, model.mapping, start, resting)
    provider = provider_for(model, form, tuple(Record.of(one, form) for one in experiments))
    theta = np.zeros(provider.n_parameters)
    theta[: len(provider.scale)] = model.theta / provider.scale
    theta = provider.with_states(theta, provider.states(theta, WINDOW))
    if form.n_outputs > 1:
        provider = replace(provider, noise=noise_of(provider, theta))
    named = named_of(model.grey, model.cases, model.lowered.n_weights)
    begun = np.zeros(provider.n_parameters)
    for one in named:
        begun[one.place] = one.parameter.start / provider.scale[one.place]
    layout = EquationLayout(
        named=named, first_weight=len(model.grey.free), nets=model.lowered.nets, provider=provider, begun=begun
    )
    prior = layout.prior(begun, alpha=1.0, beta=1.0)
    kept = {} if fit.evidence is None else fit.evidence.alphas
    prior = replace(
        prior, alphas=np.array([kept.get(g.name, a) for g, a in zip(prior.groups, prior.alphas, strict=True)])
    )
    engine = LevenbergMarquardt(termination=TERMS, evidence_after=None)
    for _ in range(ROUNDS):
        prior, _ = update(prior, theta, provider.linearise(theta), provider.n_samples)
        solution = engine.minimise_within(provider, theta, prior)
        theta = solution.theta
    return provider, solution
