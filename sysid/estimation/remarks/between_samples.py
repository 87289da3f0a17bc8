r"""Inputs that move between samples, and linear models that take them to be held there.

Of a plant behind a hold the output answers an input from the next sample on. Where the input is only measured, as
sines, filtered noise and ramps are, it has moved on the way there, and a difference equation needs a coefficient of one
lag less to say so. Whether the record asks for it is tried: models of output error are fitted from the poles of the
model, with its lags, with one lag less, and with one more at the other end, which costs as many coefficients. The
second has to leave clearly less than both others, and no more than a model with another pole: one with too few poles
gains by these as well.

The other way round, a model may have an input move that is held: :math:`n` coefficients from one lag more on, as behind
a hold, then leave clearly less than its own run does, and as little as all lags together.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.linear.slow_poles import significantly_better
from sysid.estimation.records.informative import informative
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.models import AbstractModel, ProcessModel, TransferFunction
from sysid.models.contract.ratio import Ratio
from sysid.models.converting.orthonormal_basis import Domain
from sysid.models.orders.intersample import HELD, MOVING

Array = NDArray[np.float64]

MOST_SAMPLES, LEAST_SAMPLES, MOST_COLUMNS = 5_000, 100, 60
"""Samples that are looked at: more would make the finding no surer; and columns beyond which nothing is tried."""
WORTH, LESS, FED, ONE_STEP = 1e-2, 0.8, 0.25, 0.9
"""Part of the output's standard deviation that an error must have; what one lag less leaves at most of its square; the
same where the output acts on the inputs, as a controller that is read backwards leaves half of it or more; and what it
must leave by a single step, before it is tried further."""
AS_GOOD = 1.05
"""Times the squared error of a model with a pole more up to which one lag less is as good, with less."""
STEPS, HALVES, DONE = 8, 4, 1e-4
"""Gauss-Newton steps of each model, how often one is halved, and by how little a step is the last."""
MOST_RADIUS = 1.0 + 1e-9
"""Magnitude of a pole from which a run over the record is no use to compare with."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Tried:
    """Models of output error of one output: numerators, first states and a constant follow from the denominators.

    Args:
        inputs: Less their means, shape ``(n_samples, n_inputs)``.
        output: Likewise, shape ``(n_samples,)``.
        usable: Which samples count.
        lags: Of each input the first and the last lag.
        F: Of each input its denominator, in ``1/z``.
        shared: Whether all have one.
    """

    inputs: Array
    output: Array
    usable: NDArray[np.bool_]
    lags: tuple[tuple[int, int], ...]
    F: tuple[Array, ...]
    shared: bool

    @property
    def columns(self) -> int:
        """Of all that is fitted."""
        states = [len(F) - 1 for F in (self.F[:1] if self.shared else self.F)]
        return sum(last - first + 1 for first, last in self.lags) + 2 * sum(states) + 1

    def linear(self) -> Array:
        """What the output is made of for these denominators, shape ``(n_samples, n_columns)``."""
        parts = [
            _late(scipy.signal.lfilter([1.0], F, u), lag)
            for u, F, (first, last) in zip(self.inputs.T, self.F, self.lags, strict=True)
            for lag in range(first, last + 1)
        ]
        impulse = np.eye(1, len(self.output))[0]
        for F in self.F[:1] if self.shared else self.F:
            begun = scipy.signal.lfilter([1.0], F, impulse)
            parts += [_late(begun, lag) for lag in range(len(F) - 1)]
        return np.column_stack([*parts, np.ones(len(self.output))])

    def moves(self, columns: Array, weights: Array) -> Array:
        """How the run moves with the coefficients of the denominators."""
        found, at = [], 0
        states = sum(last - first + 1 for first, last in self.lags)
        each = []
        for F, (first, last) in zip(self.F, self.lags, strict=True):
            n = last - first + 1
            part = columns[:, at : at + n] @ weights[at : at + n]
            at += n
            if not self.shared:
                n = len(F) - 1
                part = part + columns[:, states : states + n] @ weights[states : states + n]
                states += n
            each.append(part)
        if self.shared:
            each = [columns[:, :-1] @ weights[:-1]]
        for F, part in zip(self.F, each, strict=False):
            filtered = -scipy.signal.lfilter([1.0], F, part)
            found += [_late(filtered, lag) for lag in range(1, len(F))]
        return np.column_stack(found) if found else np.zeros((len(self.output), 0))

    def moved(self, by: Array) -> _Tried:
        """With other denominators."""
        found, at = [], 0
        for F in self.F[:1] if self.shared else self.F:
            n = len(F) - 1
            found.append(np.concatenate([[1.0], F[1:] + by[at : at + n]]))
            at += n
        return replace(self, F=tuple(found * len(self.F) if self.shared else found))

    def solved(self) -> tuple[Array, Array, Array]:
        """Columns, weights, and what is left of the samples that count."""
        columns = self.linear()
        rows = columns[self.usable]
        scale = np.maximum(np.linalg.norm(rows, axis=0), np.finfo(np.float64).tiny)
        weights = np.linalg.lstsq(rows / scale, self.output[self.usable], rcond=1e-12)[0] / scale
        return columns, weights, self.output[self.usable] - rows @ weights

    def stable(self) -> bool:
        """Whether it can be run over the record."""
        return all(np.isfinite(F).all() and _radius(F) <= MOST_RADIUS for F in self.F)

    def best(self) -> tuple[_Tried, Array]:
        """The denominators that this leads to, and what they leave."""
        here = self
        columns, weights, left = here.solved()
        for _ in range(STEPS):
            J = here.moves(columns, weights)[here.usable]
            found = here.stepped(_step(columns[here.usable], J, left), float(left @ left))
            if found is None:
                break
            before = float(left @ left)
            here, (columns, weights, left) = found
            if left @ left > (1.0 - DONE) * before:
                break
        return here, left

    def stepped(self, step: Array, loss: float) -> tuple[_Tried, tuple[Array, Array, Array]] | None:
        """Where a step, or half of it and so on, leaves less; ``None`` where none does."""
        for halves in range(HALVES):
            there = self.moved(step / 2**halves)
            if there.stable():
                found = there.solved()
                if found[2] @ found[2] < loss:
                    return there, found
        return None

    def best_beside(self, other: _Tried) -> Array:
        """The least that is left from here and from the denominators of another."""
        return min((self.best()[1], replace(self, F=other.F).best()[1]), key=lambda left: float(left @ left))

    def gain(self, j: int) -> float:
        """Part of the squared error that one lag less of an input leaves, by one step from here."""
        columns, weights, left = self.solved()
        J = self.moves(columns, weights)[self.usable]
        base = np.column_stack([columns[self.usable], J])
        first = self.lags[j][0]
        new = _late(scipy.signal.lfilter([1.0], self.F[j], self.inputs[:, j]), first - 1)[self.usable]
        q = scipy.linalg.orth(base / np.maximum(np.linalg.norm(base, axis=0), np.finfo(np.float64).tiny))
        left, new = (x - q @ (q.T @ x) for x in (left, new))
        power = float(new @ new) * float(left @ left)
        return 1.0 - (float(new @ left) ** 2 / power if power > 0.0 else 0.0)

    def with_lags(self, j: int, first: int, last: int) -> _Tried:
        """With other lags of one input."""
        return replace(self, lags=(*self.lags[:j], (first, last), *self.lags[j + 1 :]))

    def with_pole(self, j: int) -> _Tried:
        """With a pole more, at zero, for one input, or for all that share them."""
        more = [np.append(F, 0.0) if self.shared or k == j else F for k, F in enumerate(self.F)]
        return replace(self, F=tuple(more))


def between_samples(model: AbstractModel, run: FreeRun, fed: Collection[int] = ()) -> dict[tuple[int, int], str]:
    """Inputs that act a lag sooner than a model has it, as those do that move between samples.

    Args:
        model: The fitted model.
        run: Its free run over a record that was fitted.
        fed: Places of outputs that act on the inputs.

    Returns:
        One sentence for each output and input of which this is so, by their places; none for models that are not
        linear.
    """
    window = slice(0, MOST_SAMPLES)
    inputs, output, usable = run.inputs[window], run.output[window], run.usable[window]
    if usable.sum() < LEAST_SAMPLES or not np.isfinite(inputs).all():
        return {}
    told = dict[tuple[int, int], str]()
    kept = informative(inputs[usable])
    for i in range(len(model.mapping.outputs)):
        own = {j: model.ratios[i, j] for j in kept if (i, j) in model.ratios and len(model.ratios[i, j].B)}
        tried = _of(model, own, inputs - inputs[usable].mean(axis=0), output[:, i], usable)
        spread = float(np.std(output[usable, i]))
        if tried is None or not np.std((run.output - run.simulated)[window][usable, i]) > WORTH * spread:
            continue
        for place, j in enumerate(own):
            if _moves(model, j):
                held = _held(tried, place, spread, (run.output - run.simulated)[window][:, i])
                told |= {} if held is None else {(i, j): _said_held(model, j, i, held)}
                continue
            fits = _sooner(tried, place, spread, least=FED if i in fed else LESS)
            if fits is not None:
                told[i, j] = _said(model, j, i, tried.lags[place][0], fits)
    return told


def _of(
    model: AbstractModel, own: dict[int, Ratio], inputs: Array, output: Array, usable: NDArray[np.bool_]
) -> _Tried | None:
    """The models that are tried, from the poles of the one that was fitted; ``None`` where there are none to try."""
    if not own or not np.isfinite(output[usable]).all():
        return None
    T = model.sample_time
    F = tuple(_denominator(ratio, T) for ratio in own.values())
    shared = all(len(one) == len(F[0]) and np.array_equal(one, F[0]) for one in F) and not isinstance(
        model.structure, TransferFunction | ProcessModel
    )
    found = _Tried(
        inputs=inputs[:, list(own)],
        output=np.where(usable, output, 0.0) - output[usable].mean(),
        usable=usable,
        lags=tuple(_lags(ratio, moves=_moves(model, j)) for j, ratio in own.items()),
        F=F,
        shared=shared or len(F) == 1,
    )
    many = found.columns > min(MOST_COLUMNS, usable.sum() // 10)
    return None if many or not found.stable() else found


def _sooner(tried: _Tried, j: int, spread: float, *, least: float) -> tuple[float, float] | None:
    """Fits in percent with the lags of an input as they are, and with one less, where that is clearly better."""
    first, last = tried.lags[j]
    if first == 0 or tried.gain(j) > ONE_STEP:
        return None
    there, sooner = tried.with_lags(j, first - 1, last).best()
    own = tried.best_beside(there)
    count = len(own)
    if not sooner @ sooner < least * (own @ own) or not np.linalg.norm(own) > WORTH * spread * np.sqrt(count):
        return None
    longer = tried.with_lags(j, first, last + 1)
    further = longer.best_beside(there)
    for other, more in ((own, 1), (further, 0)):
        if not significantly_better([sooner[:, np.newaxis]], [other[:, np.newaxis]], parameters=more, scale=spread**2):
            return None
    larger = longer.with_pole(j).best_beside(there.with_pole(j))
    if sooner @ sooner > AS_GOOD * (larger @ larger):
        return None
    fits = [100.0 * (1.0 - float(np.linalg.norm(e)) / (spread * np.sqrt(count))) for e in (own, sooner)]
    return fits[0], fits[1]


def _held(tried: _Tried, j: int, spread: float, errors: Array) -> tuple[float, float] | None:
    """Fits in percent of a model's own run and of one whose input is held, where that is clearly better.

    Args:
        tried: With the lags of an input that moves.
        j: Its place among the inputs.
        spread: Standard deviation of the output.
        errors: Of the model's own run, shape ``(n_samples,)``.

    Returns:
        Both; ``None`` where the record does not say that it is held.
    """
    first, last = tried.lags[j]
    if last - first < 1:
        return None
    # A run with other first states is the same model's.
    begun = tried.linear()[tried.usable, sum(end - start + 1 for start, end in tried.lags) :]
    own = errors[tried.usable]
    own = own - begun @ np.linalg.lstsq(begun, own, rcond=1e-12)[0]
    there, held = tried.with_lags(j, first + 1, last).best()
    if not held @ held < LESS * (own @ own):
        return None
    both = tried.best_beside(there)
    larger = tried.with_lags(j, first, last + 1).with_pole(j).best_beside(there.with_pole(j))
    if held @ held > AS_GOOD * min(both @ both, larger @ larger):
        return None
    if not significantly_better([held[:, np.newaxis]], [own[:, np.newaxis]], parameters=0, scale=spread**2):
        return None
    fits = [100.0 * (1.0 - float(np.linalg.norm(e)) / (spread * np.sqrt(len(own)))) for e in (own, held)]
    return fits[0], fits[1]


def _said_held(model: AbstractModel, j: int, i: int, fits: tuple[float, float]) -> str:
    name, target = model.mapping.inputs[j], model.mapping.outputs[i]
    return (
        f"{target} answers {name} as if it were held between samples, and this model takes it to move there "
        f"(intersample: {MOVING}): held, a free run with as many coefficients has a fit of {fits[1]:.1f} %, and this "
        f"one of {fits[0]:.1f} %. Where a converter or a controller sets {name}, write intersample: {HELD}, or leave "
        "it out."
    )


def _said(model: AbstractModel, j: int, i: int, lag: int, fits: tuple[float, float]) -> str:
    name, target = model.mapping.inputs[j], model.mapping.outputs[i]
    other = "its dead time is too long" if lag > 1 else "it acts at once"
    return (
        f"{target} answers {name} sooner than this model has it: with a coefficient at lag {lag - 1} a free run of "
        f"these orders has a fit of {fits[1]:.1f} %, and without it one of {fits[0]:.1f} %. Either {name} moves "
        f"between samples, where this model holds it, or {other}, or it is set from {target} by a controller. If it is "
        f"not, {_remedy(model, lag)}."
    )


def _remedy(model: AbstractModel, lag: int) -> str:
    """What to write so that an input acts one lag sooner."""
    structure = model.structure
    whole = f"a transfer function with domain: continuous and intersample: {MOVING}"
    if isinstance(structure, ProcessModel):
        return f"fit {whole}"
    if isinstance(structure, TransferFunction):
        if structure.domain is Domain.CONTINUOUS:
            return f"write intersample: {MOVING}" + f", or delays: {lag - 2}" * (lag > 1)
        return f"write delays: {lag - 1} and a zero more, or domain: continuous with intersample: {MOVING}"
    if hasattr(structure, "feedthrough") and lag == 1:
        return f"write feedthrough: true, or fit {whole}"
    more = " and nb greater by 1" * hasattr(structure, "nb")
    return f"write nk: {lag - 1}{more}, or fit {whole}"


def _moves(model: AbstractModel, j: int) -> bool:
    """Whether a model takes an input to move between samples."""
    structure = model.structure
    return isinstance(structure, TransferFunction) and structure.moving(model.mapping.inputs)[j]


def _lags(ratio: Ratio, *, moves: bool) -> tuple[int, int]:
    """First and last lag of an input in the difference equation of its samples."""
    if ratio.discrete:
        moved = np.flatnonzero(ratio.B)
        first = int(moved[0]) if len(moved) else 0
        return int(ratio.delay) + first, int(ratio.delay) + len(ratio.B) - 1
    n, B = len(ratio.F) - 1, np.trim_zeros(ratio.B, "b")
    k, part = divmod(ratio.delay, 1.0)
    first = int(k) + (len(B) <= n and not moves)
    return first, int(k) + n + (part > 0.0)


def _denominator(ratio: Ratio, T: float) -> Array:
    """In ``1/z``, with a first coefficient of 1."""
    if ratio.discrete:
        return np.asarray(ratio.F / ratio.F[0])
    poles = np.roots(np.trim_zeros(ratio.F, "b")[::-1])
    return np.asarray(np.real(np.poly(np.exp(poles * T))))


def _radius(F: Array) -> float:
    return float(np.abs(np.roots(F)).max(initial=0.0))


def _step(columns: Array, J: Array, left: Array) -> Array:
    """Of the coefficients of the denominators, the rest following (Kaufman 1975)."""
    both = np.column_stack([columns, J])
    scale = np.maximum(np.linalg.norm(both, axis=0), np.finfo(np.float64).tiny)
    found = np.linalg.lstsq(both / scale, left, rcond=1e-12)[0] / scale
    return np.asarray(found[columns.shape[1] :])


def _late(x: Array, lag: int) -> Array:
    """A signal some samples later, from zero; inputs before the record are a matter of the first states."""
    return x if lag == 0 else np.concatenate([np.zeros(lag), x[:-lag]])
