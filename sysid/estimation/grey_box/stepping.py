"""How the states of equations go from sample to sample: explicitly or implicitly, and in how many steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.equations import MOST_STATES_IMPLICIT, ROSENBROCK, RUNGE_KUTTA, Lowered
from sysid.estimation.grey_box.provider import EquationProvider
from sysid.models.grey_box.equation_form import EquationForm
from sysid.models.grey_box.grey_box_model import EquationModel
from sysid.models.orders import intersample

Array = NDArray[np.float64]

ACCURACY = 1e-4
"""How much half the step may change a free run, over the output's scale, before it is known what the records leave."""

MOST_SUBSTEPS = 256

STALLED = 3
"""Doublings of the steps that have to bring runs nearer by a half: those of smooth equations do so at each."""

STEPPED = 5_000
"""Samples of a record on which a step is tried."""

REACH = 2.785
"""What the step times the fastest rate may be for the classical Runge-Kutta method not to grow (Hairer and Wanner 1996,
IV.2)."""

STIFF = 16.0
"""Runge-Kutta steps from sample to sample that are only needed for the run not to grow, above which implicit ones are
tried."""

GROWN = 1.0
"""What an implicit step times a rate of growth may be: beyond 2.3 the method turns growth into decay."""

LOOKED_AT = 20
"""Places along each record where the equations are linearised."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stepping:
    """How the states with a rate go on, and what is known of it.

    Args:
        substeps: Steps from sample to sample.
        change: What twice as many change of the free run, over the output's scale; not a number where the run is none.
        accuracy: What they may change.
        explicit: Runge-Kutta steps from sample to sample that stay bounded, where it was seen that they are many.
        stalled: Whether more steps do not bring runs nearer: what switches, or is chaotic, goes another way by little.
    """

    substeps: int
    change: float
    accuracy: float = ACCURACY
    explicit: float = 0.0
    stalled: bool = False

    @property
    def enough(self) -> bool:
        """Whether more would change nothing."""
        return self.change <= self.accuracy


def substeps_for(provider: EquationProvider, theta: Array, accuracy: float = ACCURACY) -> Stepping:
    """As few steps of the solver as the records need at some parameters.

    Args:
        provider: The records.
        theta: What is trained.
        accuracy: How much twice as many may change the free run, over the output's scale.

    Returns:
        The steps; the most accurate that were tried where none is enough.
    """
    form = provider.at(theta)
    if form.lowered.n_continuous == 0:
        return Stepping(substeps=1, change=0.0, accuracy=accuracy)
    before: list[Array] | None = None
    changes: list[float] = []
    best = Stepping(substeps=1, change=float("nan"), accuracy=accuracy)
    n = 1
    while n <= 2 * MOST_SUBSTEPS:
        runs = _runs(provider, theta, replace(form, substeps=n))
        if before is not None:
            change = max(float(np.abs(a - b).max(initial=0.0)) for a, b in zip(runs, before, strict=True))
            if np.isfinite(change):
                best = Stepping(substeps=n // 2, change=change, accuracy=accuracy)
            if best.enough:
                break
            changes.append(change)
            if _stalls(changes):
                return replace(best, stalled=True)
        before, n = runs, 2 * n
    return best


def _stalls(changes: Sequence[float]) -> bool:
    """Whether eight times as many steps have not halved what twice as many change."""
    return (
        len(changes) > STALLED
        and bool(np.isfinite(changes[-1 - STALLED :]).all())
        and (min(changes[-STALLED:]) > 0.5 * changes[-1 - STALLED])
    )


def _runs(provider: EquationProvider, theta: Array, form: EquationForm) -> list[Array]:
    """Free runs over the beginnings of the records, over the outputs' scales."""
    found = []
    with np.errstate(over="ignore", invalid="ignore"):  # a step that is too long explodes
        for i, record in enumerate(provider.records):
            own = provider.of_record(form, theta, i)
            found.append(own.run(record.u[:STEPPED], provider.begin(own, theta, i)) / form.output_scale)
    return found


def explicit_steps(provider: EquationProvider, theta: Array) -> float:
    """Runge-Kutta steps from sample to sample below which the linearised equations grow.

    Args:
        provider: The records.
        theta: What is trained.

    Returns:
        The most that any of some places along the records, and their states at rest, ask for.
    """
    fastest = max((float(np.abs(rates).max()) for rates in _rates(provider, theta)), default=0.0)
    return fastest * provider.form.sample_time / REACH


def hides_growth(provider: EquationProvider, theta: Array) -> bool:
    """Whether implicit steps make a free run of equations that explode.

    Steps that forget what is fast forget what grows fast as well: at half the step no less, so that nothing else shows
    it. A state that jumps from one branch to another grows for a moment; what counts is most of the run.

    Args:
        provider: The records.
        theta: What is trained.

    Returns:
        Whether at most of some places along the records the linearised equations grow faster than the steps follow.
    """
    form = provider.form
    if form.lowered.solver != ROSENBROCK:
        return False
    grown = [float(rates.real.max()) * form.sample_time / form.substeps > GROWN for rates in _rates(provider, theta)]
    return 2 * sum(grown) > len(grown)


def _rates(provider: EquationProvider, theta: Array) -> Iterator[NDArray[np.complex128]]:
    """The eigenvalues of the linearised equations in 1/s, at places along the records and at rest."""
    form = provider.at(theta)
    n = form.lowered.n_continuous
    for own, x, u in _places(provider, form, theta) if n else ():
        J = own.rates_by_state(x, u)[:, :n]
        if np.isfinite(J).all():
            yield np.asarray(np.linalg.eigvals(J), dtype=np.complex128)


def _places(
    provider: EquationProvider, shared: EquationForm, theta: Array
) -> Iterator[tuple[EquationForm, Array, Array]]:
    for i, record in enumerate(provider.records):
        form = provider.of_record(shared, theta, i)
        begun, path = provider.begin(form, theta, i), np.empty((min(len(record.u), STEPPED), form.lowered.n_states))
        with np.errstate(over="ignore", invalid="ignore"):  # a step that is too long explodes
            form.run(record.u[: len(path)], begun.copy(), path)
        yield form, begun, record.u[0]
        yield form, form.resting(*record.rest), record.rest[0]
        for t in np.unique(np.linspace(0, len(path) - 1, LOOKED_AT).astype(int)):
            if np.isfinite(path[t]).all():
                yield form, path[t], record.u[t]


def solver_for(
    provider: EquationProvider, theta: Array, implicit: Callable[[], Lowered] | None
) -> tuple[EquationProvider, Stepping]:
    """The solver that the records need at some parameters, and its steps.

    Args:
        provider: The records, run explicitly.
        theta: What is trained.
        implicit: Makes the programs that step implicitly; ``None`` where the solver is asked for.

    Returns:
        The records as they are run, and the steps: explicit ones unless implicit ones are exact enough with less to
        compute, or explicit ones are not.
    """
    found = substeps_for(provider, theta)
    needed = 0.0 if implicit is None else explicit_steps(provider, theta)
    chosen = (provider, found)
    if implicit is not None and (needed > STIFF or not (found.enough or found.stalled)):
        other = provider.with_form(replace(provider.form, lowered=implicit()))
        tried = replace(substeps_for(other, theta), explicit=needed)
        cheaper = _cost(other, tried) < _cost(provider, found)
        better = not np.isnan(tried.change) and not tried.change >= found.change
        wanted = (tried.enough and cheaper) or (not found.enough and (tried.enough or better))
        if wanted and not hides_growth(other.with_form(replace(other.form, substeps=tried.substeps)), theta):
            chosen = (other, tried)
    provider, stepping = chosen
    return provider.with_form(replace(provider.form, substeps=stepping.substeps)), stepping


def can_be_implicit(lowered: Lowered) -> bool:
    """Whether there may be implicit steps of some equations."""
    return lowered.solver != ROSENBROCK and 0 < lowered.n_continuous <= MOST_STATES_IMPLICIT


def _cost(provider: EquationProvider, stepping: Stepping) -> int:
    """Operations from sample to sample."""
    low = provider.form.lowered
    return stepping.substeps * len(low.method) * len(low.slopes.code)


_KINDS = {RUNGE_KUTTA: "Runge-Kutta", ROSENBROCK: "Rosenbrock (implicit)"}


def step_note(model: EquationModel, stepping: Stepping) -> str:
    """What is told of the steps of a fit.

    Args:
        model: The model.
        stepping: What is known of its steps.

    Returns:
        A sentence, or two.
    """
    n = model.substeps
    given = model.grey.substeps is not None
    halved = "" if given else f"; half of that changes the output by {stepping.change:.1e} of its range"
    told = (
        f"The equations go from sample to sample in {n} {_KINDS[model.solver]} step{'s' * (n > 1)} of "
        f"{model.sample_time / n:.4g} s{' as asked for' * given}{halved}."
    )
    stiff = (
        " They are stiff where they start: only to stay bounded, Runge-Kutta steps would be "
        f"{stepping.explicit:,.0f} from sample to sample."
    )
    inputs = model.mapping.inputs
    between = intersample.told(model.grey.moving(inputs), inputs)
    return told + between + stiff * (stepping.explicit > 0.0 and model.solver == ROSENBROCK)


def step_warning(model: EquationModel, stepping: Stepping) -> str:
    """What is told where the steps of a fit are not short enough.

    Args:
        model: The model.
        stepping: What is known of its steps.

    Returns:
        Two sentences.
    """
    if stepping.stalled:
        return (
            f"More steps than {model.substeps} between samples do not bring runs nearer to each other: twice as many "
            f"change the output by {stepping.change:.1e} of its range. Something switches another way by next to "
            "nothing, as in a limit cycle, or the equations are chaotic: no run is exact far from its beginning."
        )
    other = "write solver: rosenbrock, " * (model.solver == RUNGE_KUTTA and can_be_implicit(model.lowered))
    return (
        f"{model.substeps} {_KINDS[model.solver]} steps between samples are not enough: twice as many change the "
        f"output by {stepping.change:.1e} of its range. Something in the equations is fast: {other}make it algebraic, "
        "or slower."
    )
