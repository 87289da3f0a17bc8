"""Inputs that act at lags which a model leaves out: what in the error of its free run moves with them."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.correlation import products
from sysid.estimation.records.informative import SAME, by_chance, by_chance_of_signs, informative, unit, with_past
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.models import AbstractModel, GreyBox, ProcessModel, TransferFunction
from sysid.models.converting.orthonormal_basis import Domain
from sysid.models.orders.intersample import MOVING

LAGS = 5
"""Past errors and inputs that are taken out of the error, before the input of one sample is looked at; and lags after
its first one within which a model's dynamics may be what is wrong, and not its lags."""
LEAST_SAMPLES = 100
LEAST_ERROR = 1e-2
"""Part of the output's standard deviation that the error must have to be worth an explanation."""
SHARE, SURE = 0.2, 1e-6
"""Part of the error that an input of the same sample must explain, and how improbable that is by chance."""
SURE_OF_SIGNS = 0.1
"""How probable it may be at one lag where only the signs of moves count: five alike are enough, one jump is not."""
FEW = 3
"""Moves that may go together by chance; what is left without them says otherwise only where it nearly is the same."""
ELSEWHERE, FIRST = 0.05, 0.25
"""Part that an input of another sample must explain; and part of the most from which it is said to begin."""
NEARLY_ALL = 0.9
"""Part of what is new in an output that an input of the same sample explains, from which one may be the other."""


def left_out(
    model: AbstractModel, run: FreeRun, fed: Collection[int] = (), but: Collection[tuple[int, int]] = ()
) -> list[str]:
    """Inputs that act at lags where the model lets them not.

    The error of the free run is explained by its own past and past inputs, and then by the inputs of the same sample as
    well: an F test says whether they explain more than chance would. What is new in output and error is then held
    beside what was new in each input earlier, sample by sample.

    Args:
        model: The fitted model.
        run: Its free run over a record that was fitted.
        fed: Places of outputs that act on the inputs: what moves together within a sample is the controller's.
        but: Places of outputs and inputs of which is told already that they act sooner.

    Returns:
        One sentence for each input and output of which this is so.
    """
    error, usable = run.output - run.simulated, run.usable
    few = usable.sum() < LEAST_SAMPLES + LAGS * (1 + run.inputs.shape[1])
    if few or not np.isfinite(error).all():
        return []
    told = []
    for j in informative(run.inputs[usable]):
        for i in (i for i in range(len(model.mapping.outputs)) if (i, j) not in but):
            worth = np.std(error[usable, i]) > LEAST_ERROR * np.std(run.output[usable, i])
            if has_path(model, run, j, i):
                told += [] if i in fed else _read_backwards(model, run, j, i)
            elif worth and i not in fed and (found := _at_once(model, run, error[:, i], j, i)):
                told += found
                continue
            told += _elsewhere(model, run, error[:, i], j, i) if worth else []
    return told


def _at_once(model: AbstractModel, run: FreeRun, error: NDArray[np.float64], j: int, i: int) -> list[str]:
    """Whether an input acts within its sample where the model lets it act only later."""
    share, name, target = _share(error, run.inputs, j, run.usable), model.mapping.inputs[j], model.mapping.outputs[i]
    if share <= 0.0:
        return []
    moves = f"{100 * share:.0f} % of what is new in the error of {target} moves with {name} of the same sample."
    leaves = f"which this model leaves out ({at_lag(model, 0)})"
    between = f", or it moves between samples (intersample: {MOVING})" if _holds(model, j) else ""
    return [f"{moves} Either {name} acts at once, {leaves}{between}, or it is fed back from {target}."]


def _holds(model: AbstractModel, j: int) -> bool:
    """Whether a model goes on by rates between samples, and takes an input to keep its value there."""
    structure = model.structure
    if isinstance(structure, TransferFunction):
        return structure.domain is Domain.CONTINUOUS and not structure.moving(model.mapping.inputs)[j]
    if isinstance(structure, GreyBox):
        return bool(structure.system.continuous) and not structure.moving(model.mapping.inputs)[j]
    return False


def _elsewhere(model: AbstractModel, run: FreeRun, error: NDArray[np.float64], j: int, i: int) -> list[str]:
    """Whether an output begins to move with an input at another lag than in the model, and the error says so too."""
    first = _first(model, run, j, i)
    lag, share = _lag(run.output[:, i], run.inputs[:, j], run.usable, slice(0, 1))
    name, target = model.mapping.inputs[j], model.mapping.outputs[i]
    before = f"{lag} sample{'s' if lag > 1 else ''} before"
    moves = f"{100 * share:.0f} % of what is new in {target} moves with {name} of {before},"
    if first is None:
        # What it leaves out must be in its error: not so of an input that goes with another which it has.
        left = _lag(error, run.inputs[:, j], run.usable, slice(0, 1))[1] if share > 0.0 else 0.0
        deaf = left > 0.0 and _deaf(model, run, j, i)
        return [f"{moves} and in the model {target} does not depend on {name}. {_begin(model, lag, lag)}"] * deaf
    own = slice(first, first + LAGS + 1)
    if share <= 0.0 or lag in range(own.start, own.stop) or not _lag(error, run.inputs[:, j], run.usable, own)[1]:
        return []
    return [
        f"{moves} and in the model {name} acts from lag {first} on: its dead time is too "
        f"{'short' if first < lag else 'long'}. {_begin(model, lag, lag - first)}"
    ]


def _begin(model: AbstractModel, lag: int, late: int) -> str:
    """What to write for inputs that act from a lag on, in the words of the structure."""
    words = at_lag(model, lag)
    if words:
        return f"Begin there ({words}), or let it be searched (auto)."
    return (
        f"This structure has no dead time: give it the input {abs(late)} samples {'later' if late > 0 else 'earlier'}, "
        "or take one that has (nk, delays, input_delays), or let it be searched (auto)."
    )


def at_lag(model: AbstractModel, lag: int) -> str:
    """How a structure says from which lag on its inputs act.

    Args:
        model: A model of that structure.
        lag: In samples.

    Returns:
        The words; empty where it cannot.
    """
    structure = model.structure
    if isinstance(structure, ProcessModel):
        return "D in its type" if lag else "a type without D"
    if hasattr(structure, "input_delays"):
        return f"input_delays from {lag}"
    if lag == 0 and hasattr(structure, "feedthrough"):
        return "feedthrough: true"
    if lag == 0 and isinstance(structure, TransferFunction) and structure.domain is Domain.CONTINUOUS:
        return "delays: 0, and as many zeros as poles"
    for field in ("nk", "delays"):
        if hasattr(structure, field):
            return f"{field}: {lag}"
    return "let it stand in the equation of the output" if lag == 0 else ""


def _deaf(model: AbstractModel, run: FreeRun, j: int, i: int) -> bool:
    """Whether an output of the model is the same whatever an input does."""
    turned = run.inputs.copy()
    turned[:, j] = turned[::-1, j]
    before, after = (model.simulate(u, run.history).reshape(len(u), -1)[:, i] for u in (run.inputs, turned))
    return bool(np.array_equal(before, after))


def _read_backwards(model: AbstractModel, run: FreeRun, j: int, i: int) -> list[str]:
    """Whether a model that lets inputs act at once, unasked, may have learnt the controller and not the plant."""
    share = _share(run.output[:, i], run.inputs, j, run.usable) if model.structure.acts_at_once else 0.0
    if share < NEARLY_ALL:
        return []
    name, target = model.mapping.inputs[j], model.mapping.outputs[i]
    return [
        f"{100 * share:.0f} % of what is new in {target} moves with {name} of the same sample, and the model takes "
        f"{name} to act at once. Where {name} is set by a controller that reads {target}, that is the controller read "
        "backwards and no plant: fit a structure whose inputs act from lag 1 on (NARX input_delays: 1, ARX nk: 1)."
    ]


def has_path(model: AbstractModel, run: FreeRun, j: int, i: int) -> bool:
    """Whether an output of the model moves with an input of the same sample.

    Args:
        model: The fitted model.
        run: Its free run.
        j: Place of the input.
        i: Place of the output.

    Returns:
        Whether it does.
    """
    few = run.inputs[: LAGS + 1]
    moved = few.copy()
    moved[-1, j] += np.std(run.inputs[:, j]) or 1.0
    before, after = (model.simulate(u, run.history).reshape(len(u), -1)[-1, i] for u in (few, moved))
    return bool(before != after)


def _first(model: AbstractModel, run: FreeRun, j: int, i: int) -> int | None:
    """The first lag at which an output of the model moves with an input.

    ``None`` where a move at the run's beginning is not seen, as in a dead zone: that says nothing of lags.
    """
    moved = run.inputs.copy()
    moved[0, j] += np.std(run.inputs[:, j]) or 1.0
    before, after = (model.simulate(u, run.history).reshape(len(u), -1)[:, i] for u in (run.inputs, moved))
    changed = np.flatnonzero(before != after)
    return int(changed[0]) if len(changed) else None


def _lag(
    target: NDArray[np.float64], column: NDArray[np.float64], usable: NDArray[np.bool_], but: slice
) -> tuple[int, float]:
    """The lag from which on an input explains most of a signal's innovation, and how much most is; 0 by chance.

    What is new in each is what its own past leaves; masked samples, and those that follow them, count as nothing.
    """
    whole = with_past(usable, LAGS)
    left, new = (_innovations(x, whole) for x in (target, column))
    most = len(left) // 3
    if whole.sum() < LEAST_SAMPLES or np.linalg.norm(new) <= SAME * np.linalg.norm(column[whole]):
        return 0, 0.0
    left, new = _direction(left), _direction(new)
    shares = _shares(left, new, most)
    shares[but] = 0.0
    share, free = float(shares.max()), int(whole.sum()) - LAGS - 2
    if share <= ELSEWHERE or most * by_chance(share, 1, free) >= SURE:
        return 0, 0.0
    # Levels that are held go back and forth: a change goes with the one before, and stands for it so long before.
    peak = int(shares.argmax())
    moved = np.concatenate([np.zeros(peak), new[: len(new) - peak]])
    if not _many(left, moved):
        return 0, 0.0
    rest = _shares(left - moved * (moved @ left) / max(moved @ moved, SAME), new, peak)
    rest[but] = 0.0
    before = np.flatnonzero(rest >= FIRST * share)
    return int(before[0]) if len(before) else peak, share


def _shares(left: NDArray[np.float64], new: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    """The part of a signal of length 1 that another explains at each lag."""
    return np.asarray(products(left, new, most) ** 2)


def _innovations(x: NDArray[np.float64], whole: NDArray[np.bool_]) -> NDArray[np.float64]:
    """What the last samples leave of a signal; zero where they are not all there."""
    base = np.column_stack([*(np.roll(x, lag) for lag in range(1, LAGS + 1)), np.ones(len(x))])[whole]
    found = np.zeros(len(x))
    basis = unit(base)
    found[whole] = x[whole] - basis @ np.linalg.lstsq(basis, x[whole], rcond=None)[0]
    return found


def _share(error: NDArray[np.float64], inputs: NDArray[np.float64], j: int, usable: NDArray[np.bool_]) -> float:
    """The part of the error's innovation that an input of the same sample explains; 0 where chance may do it."""
    past = [np.roll(column, lag) for column in (error, *inputs.T) for lag in range(1, LAGS + 1)]
    whole = with_past(usable, LAGS)
    base = np.column_stack([*past, np.ones(len(error))])[whole]
    basis, _ = np.linalg.qr(unit(base))
    left, new = (x[whole] - basis @ (basis.T @ x[whole]) for x in (error, inputs[:, j]))
    free = len(left) - base.shape[1] - 1
    if free < LEAST_SAMPLES or np.linalg.norm(new) <= SAME * np.linalg.norm(inputs[whole, j]):
        return 0.0
    # Of length 1 first: the square of a free run that grows without bound is no number.
    left, new = _direction(left), _direction(new)
    share = float(left @ new) ** 2
    return share if share > SHARE and by_chance(share, 1, free) < SURE and _many(left, new) else 0.0


def _many(left: NDArray[np.float64], moved: NDArray[np.float64]) -> bool:
    """Whether signals move together more often than a few jumps may by chance, or all but these by the same part."""
    together = left * moved
    if by_chance_of_signs(together) < SURE_OF_SIGNS:
        return True
    rest = np.argsort(np.abs(together))[:-FEW]
    return float(_direction(left[rest]) @ _direction(moved[rest])) ** 2 > NEARLY_ALL


def _direction(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return unit(x[:, np.newaxis])[:, 0]
