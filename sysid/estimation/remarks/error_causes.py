"""What the error of a free run is made of, where it is more than noise need be: told by its cause, for every structure.

A fit that ended in a minimum may be far from its record and say nothing. Six causes leave marks in the error itself:
lone samples that jump away and back, an output that stands at an end while the model goes on, something of the inputs
that the model leaves out, nothing of the inputs at all, a run that follows how its record begins and no input, and an
error that lasts as long as the record.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.records.informative import by_chance, informative, still, unit, with_past
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.estimation.remarks.input_features import CURVES, LINEAR, answers, features
from sysid.models import AbstractModel

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST_SAMPLES = 100
WORTH = 0.1
"""Part of the output's standard deviation that an error must have to be worth a cause."""
LONE, MOST_LONE, LONE_SHARE = 6.0, 0.05, 0.25
"""Robust deviations by which a lone sample leaves its neighbours, the most that are lone, and their least part of the
squared error."""
STAY, STANDS, OFF = 3, 0.05, 0.15
"""Samples in a row at an end that are a stay, the least part of all that stand there, and how far the run is off
then, in standard deviations of the output."""
TERMS, EXPLAINED, IN_EACH = 8, 0.3, 0.15
"""Terms that the error is explained by, and what part of the other half's error they must explain: in the mean, and in
each half."""
OTHERS, OWN_PART, MOST_NAMED = 0.5, 0.2, 3
"""The same of channels that the model does not read, of which nothing says that they have to do with the output; what
part of it one must explain by itself to be named, and how many are."""
PLAINLY, PLAINLY_IN_EACH = 0.7, 0.5
"""The same of signals as they are."""
MOSTLY = 0.8
"""Part of what all terms explain, from which the simpler of them are said to be it."""
FAR, BY_CHANCE = 0.6, 0.05
"""Part of the output's standard deviation that an error must have before it is asked whether the inputs say anything
at all; and how improbable by chance it must be that they do."""
LEAST_INDEPENDENT, OWN, SMALL, LARGE = 30.0, 0.8, 0.2, 0.3
"""Independent samples that an error counts for, below which its fit says little of another record; the part of an error
in its sample before from which it is told in any case; and its part of the output for either."""
BEGUN, ADDED = 0.3, 0.1
"""Part of an output that a run with held inputs must follow to be said to follow its beginning, and the least part of
what that leaves that its inputs must add."""
STRAIGHT, STEEP = 0.4, 0.5
"""What a line in time must leave of an output's squares beside its inputs, and how far it must go, in deviations."""
OWN_PAST = 5
IN_ONE_PIECE = 1_000_000
"""Numbers of columns side by side: a hundred of them are more memory in one piece than a process has free."""
TINY = float(np.finfo(np.float64).tiny)


def causes(model: AbstractModel, run: FreeRun, fed: Collection[int] = (), but: Collection[int] = ()) -> list[str]:
    """The causes of an error that is more than it need be.

    Args:
        model: The fitted model.
        run: Its free run over a record that was fitted.
        fed: Places of outputs whose error the inputs say nothing of: they are fed back, or its levels are its own.
        but: Places of outputs whose cause is told already.

    Returns:
        Sentences; none where the error is small, or what is left of it looks like noise.
    """
    told = []
    for i in range(len(model.mapping.outputs)):
        y, s = run.output[:, i], run.simulated[:, i]
        if i in but or run.usable.sum() < LEAST_SAMPLES or not np.isfinite(s).all() or not np.ptp(y[run.usable]) > 0.0:
            continue
        spread = float(np.std(y[run.usable]))
        if not float(np.std((y - s)[run.usable])) > WORTH * spread:
            continue
        told += _of_output(model, run, i, (y / spread, s / spread), () if i in fed else None)
    return told


def _of_output(
    model: AbstractModel, run: FreeRun, place: int, signals: tuple[Array, Array], kept: tuple[int, ...] | None
) -> list[str]:
    name, (y, s) = model.mapping.outputs[place], signals
    lone = _lone(y, s, run.usable)
    sound = run.usable & ~lone
    told = [_of_lone(y - s, lone, run.usable, name)] if lone.any() else []
    if sound.sum() < LEAST_SAMPLES or not float(np.std((y - s)[sound])) > WORTH:
        return told
    standing = _standing(y, s, sound)
    if standing:
        return [*told, standing.format(name=name)]
    kept = informative(run.inputs[sound]) if kept is None else kept
    names = [model.mapping.inputs[j] for j in kept]
    inputs = " and ".join([*([", ".join(names[:-1])] if names[1:] else []), *names[-1:]])
    aside = _of_another(run, y - s, sound, name)
    if aside:
        return [*told, aside]
    if kept:
        groups = features(run.inputs[:, list(kept)], s, answers(model, run.inputs, kept, place))
        found = _drift(groups, y, sound, name) or _nothing(model, (y, s), groups, sound).format(
            name=name, inputs=inputs
        )
        found = found or _of_inputs(groups, y - s, sound).format(name=name, inputs=inputs)
        if not found:
            held = run.held(model)[:, place]
            found = _of_beginning((y, s), held, sound).format(name=name, inputs=inputs)
        if found:
            return [*told, found]
    return [*told, *_lasting(y - s, sound, name)]


def _lone(y: Array, s: Array, usable: Mask) -> Mask:
    """Samples that leave both neighbours, the same way in the measurement as in the error."""
    out, error = (_off_neighbours(x) for x in (y, y - s))
    scale = float(np.median(np.abs((y - s)[usable] - np.median((y - s)[usable])))) / 0.6745
    found = usable & (np.abs(error) > LONE * max(scale, 1e-2)) & (np.abs(out - error) < 0.5 * np.abs(error))
    many = np.count_nonzero(found) > MOST_LONE * np.count_nonzero(usable)
    squares = (y - s)[usable] ** 2
    few = float(((y - s)[found] ** 2).sum()) < LONE_SHARE * float(squares.sum())
    return np.zeros(len(y), dtype=bool) if many or few else found


def _off_neighbours(x: Array) -> Array:
    before, after = np.r_[0.0, x[:-1]], np.r_[x[1:], 0.0]
    middle = np.maximum(np.minimum(before, x), np.minimum(np.maximum(before, x), after))
    return np.asarray(x - middle, dtype=np.float64)


def _of_lone(error: Array, lone: Mask, usable: Mask, name: str) -> str:
    share = float((error[lone] ** 2).sum() / (error[usable] ** 2).sum())
    at = ", ".join(str(k) for k in np.flatnonzero(lone)[:3])
    return (
        f"{int(lone.sum())} lone samples of {name} jump away from their neighbours and back (the first at sample {at} "
        f"of the run), and carry {100 * share:.0f} % of the squared error: the fit bends to them. If they are faults "
        f"of the recording, mask them (repairs: {{mask: [{{channel: {name}, start: ..., stop: ...}}]}})."
    )


def _standing(y: Array, s: Array, usable: Mask) -> str:
    """A sentence where the output stands at an end of its range while the run goes on."""
    for end, side in ((float(y[usable].max()), "greatest"), (float(y[usable].min()), "least")):
        at = usable & (y == end)
        edges = np.flatnonzero(np.diff(np.r_[0, at.astype(np.int8), 0]))
        long = np.repeat(np.diff(edges)[::2] >= STAY, np.diff(edges)[::2])
        stands = np.flatnonzero(at)[long]
        if len(stands) < STANDS * usable.sum() or not float(np.sqrt(np.mean((s[stands] - end) ** 2))) > OFF:
            continue
        return (
            f"{{name}} stands at its {side} value in {100 * len(stands) / usable.sum():.0f} % of the samples, and "
            "the free run goes on moving then: a plant or a sensor at its end, of which the model knows nothing. "
            "Where the plant ends there, fit what has an end (NARX limits: found, HammersteinWiener output: "
            "saturation, min and max in equations); where only the sensor does, mask these samples (repairs: mask)."
        )
    return ""


def _of_inputs(groups: dict[str, list[Array]], target: Array, usable: Mask) -> str:
    """A sentence where the inputs explain a signal, on halves of the record that did not choose how."""
    found = {kind: _explained(columns, target, usable) for kind, columns in groups.items()}
    most = max(found.values())
    if not most > 0.0:
        return ""
    earlier = "earlier values of "
    if found[LINEAR] >= MOSTLY * most:
        how = ": the model has too little memory, or not the right one. Try more lags or states, other orders, or more"
    elif found[CURVES] >= MOSTLY * most:
        earlier = ""  # of the same sample, too
        how = " along a curve that the model lacks. Try a network, more neurons or pieces, another curve, or more"
    else:
        how = (
            " after a play, as with backlash, friction or hysteresis, which the model lacks. Try a network with more "
            "lags of the output, more states, or more"
        )
    share = f"{100 * most:.0f} % of what the free run of {{name}} leaves moves with {earlier}{{inputs}}"
    return f"{share}{how} starts. (Or {{name}} is fed back to {{inputs}}.)"


def _of_another(run: FreeRun, error: Array, usable: Mask, name: str) -> str:
    """A sentence where channels that the model does not read explain the error, by their earlier values."""
    groups = dict[str, list[Array]]()
    for other, column in run.beside.items():
        # What only ever rises or falls is a clock or a count, and goes with every drift.
        if np.ptp(np.sign(np.diff(column[usable]))) > 1.0 and not still(column[usable]):
            earlier = np.concatenate([column[:1], column[:-1]])[:, np.newaxis]
            groups[other] = features(earlier, column)[LINEAR]
    share = _explained([one for columns in groups.values() for one in columns], error, usable) if groups else 0.0
    if not share > OTHERS:
        return ""
    each = {other: _alone(columns, error, usable) for other, columns in groups.items()}
    most = sorted((one for one in each if each[one] > OWN_PART * share), key=lambda one: -each[one])[:MOST_NAMED]
    names = " and ".join(most) if len(most) < MOST_NAMED else f"{', '.join(most[:-1])} and {most[-1]}"
    return (
        f"{100 * share:.0f} % of what the free run of {name} leaves moves with earlier values of {names}, which the "
        f"record has and this model does not read. What acts on {name} should be an input; where each acts on the "
        "other, fit both as outputs of one model (a state space, VectorARX, or NARX, whose outputs read the past of "
        "all)."
    )


def _alone(columns: list[Array], target: Array, usable: Mask) -> float:
    """The part of a signal that some columns explain, to see which of many matter."""
    rows = np.flatnonzero(usable[1:] & usable[:-1])
    pieces, wanted = [_news(piece, 0.0, rows) for piece in _pieces(columns)], _news(target, 0.0, rows)
    *_, left = _pursued(pieces, wanted)
    return 1.0 - float(left @ left) / max(float(wanted @ wanted), TINY)


def _explained(columns: list[Array], target: Array, usable: Mask) -> float:
    """The part of a signal that some of the columns explain on the half of a record that did not choose them.

    Both are taken less what the signal's own last sample says of it, as two things that wander explain each other; or
    as they are, where they explain so much that no wandering does.
    """
    rows = usable & np.r_[False, usable[:-1]]
    centred = target - target[usable].mean()
    past = np.r_[0.0, centred[:-1]]
    own = float(past[rows] @ centred[rows] / max(float(past[rows] @ past[rows]), 1e-300))
    places = np.flatnonzero(rows[1:])
    halves = places[: len(places) // 2], places[len(places) // 2 :]
    best, pieces = 0.0, list(_pieces(columns))
    for part, (least, in_each) in ((own, (EXPLAINED, IN_EACH)), (0.0, (PLAINLY, PLAINLY_IN_EACH))):
        found = [_of_half(pieces, centred, part, here, there) for here, there in (halves, halves[::-1])]
        if min(found) >= in_each and np.mean(found) >= least:
            best = max(best, float(np.mean(found)))
    return best


def _news(signals: Array, part: float, rows: NDArray[np.int64]) -> Array:
    """Signals, the samples of each in the last axis, at those after some, less a part of these and their mean."""
    news = signals[..., rows + 1] - part * signals[..., rows]
    return np.asarray(news - news.mean(axis=-1, keepdims=True), dtype=np.float64)


def _pieces(columns: list[Array]) -> Iterator[Array]:
    """Columns as rows of arrays: a product with many at once takes a fifth of the time of one with each."""
    several = max(1, IN_ONE_PIECE // len(columns[0]))
    return (np.array(columns[k : k + several]) for k in range(0, len(columns), several))


def _of_half(
    pieces: list[Array], target: Array, part: float, here: NDArray[np.int64], there: NDArray[np.int64]
) -> float:
    chosen, weights, _ = _pursued([_news(piece, part, here) for piece in pieces], _news(target, part, here))
    other, columns = _news(target, part, there), [column for piece in pieces for column in piece]
    left = other - _news(np.array([columns[j] for j in chosen]), part, there).T @ weights
    return 1.0 - float(left @ left) / max(float(other @ other), 1e-300)


def _pursued(pieces: list[Array], target: Array) -> tuple[list[int], Array, Array]:
    """The few columns that explain a signal best (orthogonal matching pursuit), their weights, and what they leave."""
    lengths = np.maximum(np.sqrt(np.concatenate([np.einsum("ij,ij->i", piece, piece) for piece in pieces])), TINY)
    columns, chosen = [column for piece in pieces for column in piece], list[int]()
    weights: Array = np.empty(0, dtype=np.float64)
    left: Array = target
    for _ in range(min(TERMS, len(columns))):
        products = np.abs(np.concatenate([piece @ left for piece in pieces])) / lengths
        products[chosen] = 0.0
        chosen.append(int(np.argmax(products)))
        few = np.column_stack([columns[j] for j in chosen])
        weights = np.asarray(np.linalg.lstsq(few, target, rcond=None)[0], dtype=np.float64)
        left = target - few @ weights
    return chosen, weights, left


def _moves_with(y: Array, s: Array, usable: Mask, parameters: int) -> bool:
    """Whether the measurement moves with the run more than it does by chance with a run of so many parameters.

    Both are taken less what the error's own past says of them, which leaves an error that is news at every sample.
    """
    whole = with_past(usable, OWN_PAST)
    y, s = y - y[usable].mean(), s - s[usable].mean()
    past = [np.column_stack([np.roll(x, lag) for lag in range(1, OWN_PAST + 1)])[whole] for x in (y - s, y, s)]
    weights = np.linalg.lstsq(past[0], (y - s)[whole], rcond=None)[0]
    new, of_run = y[whole] - past[1] @ weights, s[whole] - past[2] @ weights
    product = float(unit(new[:, np.newaxis])[:, 0] @ unit(of_run[:, np.newaxis])[:, 0])
    if not product > 0.0:
        return False
    share, used = product**2, max(1, min(parameters, len(new) // 4))
    return by_chance(share, used, max(1, len(new) - used)) < BY_CHANCE


def _nothing(model: AbstractModel, signals: tuple[Array, Array], groups: dict[str, list[Array]], usable: Mask) -> str:
    y, s = signals
    if not float(np.std((y - s)[usable])) > FAR or _moves_with(y, s, usable, model.n_parameters):
        return ""
    if _of_inputs(groups, y, usable):
        return ""
    return (
        "Nothing in these records says that {name} moves with {inputs}: what the model makes of it is no nearer than "
        "chance, and neither are simple curves of filtered inputs. Measure what moves {name}, excite it more, or give "
        "its dead time; where it moves by itself, as in a limit cycle, or along something less simple, a network with "
        "more states or starts may tell."
    )


def _of_beginning(signals: tuple[Array, Array], held: Array, usable: Mask) -> str:
    """A sentence where a run follows its output by how it begins alone: no nearer than with its inputs held."""
    y, s = (signal[usable] for signal in signals)
    still_run = held[usable] - held[usable].mean()
    if not np.isfinite(still_run).all() or not np.ptp(still_run) > 0.0:
        return ""
    centred = y - y.mean()
    without = centred - still_run * float(still_run @ centred / (still_run @ still_run))
    parts = [float(left @ left / (centred @ centred)) for left in (without, y - s)]
    if parts[0] > 1.0 - BEGUN or parts[1] < (1.0 - ADDED) * parts[0]:
        return ""
    return (
        f"The free run of {{name}} follows how the record begins, and not {{inputs}}: it leaves {100 * parts[1]:.3g} % "
        f"of what {{name}} moves, and {100 * parts[0]:.3g} % with {{inputs}} held at the mean. Its fit says nothing of "
        "what {inputs} does. Record {name} moved by {inputs}, beginning at rest; or name what moves it."
    )


def _drift(groups: dict[str, list[Array]], y: Array, usable: Mask, name: str) -> str:
    """A sentence where a straight line in time is what the inputs leave of the output."""
    target = y[usable] - y[usable].mean()
    some = (piece[:, usable] for piece in _pieces(groups[CURVES]))
    pieces = [piece - piece.mean(axis=1, keepdims=True) for piece in some]
    line = np.linspace(-0.5, 0.5, len(y))[usable]
    line = (line - line.mean()) / np.linalg.norm(line - line.mean())
    *_, without = _pursued(pieces, target)
    flat = target - line * (line @ target)
    along = np.concatenate([piece @ line for piece in pieces])
    for column, part in zip((column for piece in pieces for column in piece), along, strict=True):
        np.subtract(column, line * part, out=column)  # together they are many
    chosen, weights, within = _pursued(pieces, flat)
    if not within @ within < STRAIGHT * (without @ without) or not np.std(without) > WORTH:
        return ""
    slope = float(line @ target - along[chosen] @ weights) * float(np.ptp(line))
    if not abs(slope) > STEEP:
        return ""
    way = "rises" if slope > 0 else "falls"
    return (
        f"{name} drifts: besides what its inputs do it {way} by {abs(slope):.2g} of its "
        "standard deviations from beginning to end, which the model cannot say. Take the drift out of the records "
        f"(repairs: {{drift: {{{name}: line}}}}), or give its cause as an input; where it integrates an input, take a "
        "structure that does."
    )


def _lasting(error: Array, usable: Mask, name: str) -> list[str]:
    """A sentence where the error is not the noise of a sensor: it lasts, and no input explains it."""
    centred = np.where(usable, error - error[usable].mean(), 0.0)
    count = int(usable.sum())
    independent = count / correlation_time(centred)
    whole = usable & np.r_[False, usable[:-1]]
    now, before = centred[whole], np.r_[0.0, centred[:-1]][whole]
    told = float(now @ before) ** 2 / max(float(now @ now) * float(before @ before), 1e-300)
    size = float(np.std(error[usable]))
    if size < SMALL or (independent >= LEAST_INDEPENDENT and not (told > OWN and size > LARGE)):
        return []
    return [
        f"The error of the free run of {name} is no noise of a sensor: {100 * told:.0f} % of it is in the sample "
        f"before, and its {count} samples count for some {max(1.0, independent):.0f} independent ones. Something that "
        "is not measured moves it, it sums up all errors, or it does what neither the model nor a simple curve of its "
        "inputs does: how well the run follows these records says little of others. Measure what moves it, record "
        "longer, try a network with more states, or a model with noise (BJ, ARMAX) that predicts."
    ]
