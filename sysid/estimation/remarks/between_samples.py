r"""Inputs that move between samples, and linear models that take them to be held there.

Of a plant behind a hold the output answers an input from the next sample on. Where the input is only measured, as
sines, filtered noise and ramps are, it has moved on the way there, and a difference equation needs a coefficient of one
lag less to say so. Whether the record asks for it is tried: models of output error are fitted from the poles of the
model, with its lags, with one lag less, and with one more at the other end, which costs as many coefficients. The
second has to leave clearly less than both others, and no more than a model with another pole: one with too few poles
gains by these as well.

The other way round, a model may have an input move that is held: :math:`n` coefficients from one lag more on, as behind
a hold, then leave clearly less than its own run does, and as little as all lags together.

A continuous transfer function may be given whole samples of dead time. One that ends between samples, as nearly every
dead time of a plant does, moves its input within a sample: behind a hold, a coefficient more, one lag later, says it
exactly.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from sysid.estimation.linear.slow_poles import significantly_better
from sysid.estimation.records.informative import informative
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.estimation.remarks.tried_lags import Array, Tried, moving_in, tried_of
from sysid.models import AbstractModel, ProcessModel, TransferFunction
from sysid.models.converting.orthonormal_basis import Domain
from sysid.models.orders.intersample import HELD, MOVING

MOST_SAMPLES, LEAST_SAMPLES = 5_000, 100
"""Samples that are looked at: more would make the finding no surer."""
WORTH, LESS, FED, ONE_STEP = 1e-2, 0.8, 0.25, 0.9
"""Part of the output's standard deviation that an error must have; what one lag less leaves at most of its square; the
same where the output acts on the inputs, as a controller that is read backwards leaves half of it or more; and what it
must leave by a single step, before it is tried further."""
AS_GOOD = 1.05
"""Times the squared error of a model with a pole more up to which one lag less is as good, with less."""


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
        tried = tried_of(model, own, inputs - inputs[usable].mean(axis=0), output[:, i], usable)
        spread = float(np.std(output[usable, i]))
        if tried is None or not np.std((run.output - run.simulated)[window][usable, i]) > WORTH * spread:
            continue
        for place, j in enumerate(own):
            if moving_in(model, j):
                held = _held(tried, place, spread, (run.output - run.simulated)[window][:, i])
                told |= {} if held is None else {(i, j): _said_held(model, j, i, held)}
                continue
            fits = _sooner(tried, place, spread, least=FED if i in fed else LESS)
            if fits is not None:
                told[i, j] = _said(model, j, i, tried.lags[place][0], fits)
            elif _continuous(model):
                late = _late(tried, place, spread, (run.output - run.simulated)[window][:, i])
                told |= {} if late is None else {(i, j): _said_late(model, j, i, late)}
    return told


def _sooner(tried: Tried, j: int, spread: float, *, least: float) -> tuple[float, float] | None:
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


def _held(tried: Tried, j: int, spread: float, errors: Array) -> tuple[float, float] | None:
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
    own = tried.own(errors)
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


def _late(tried: Tried, j: int, spread: float, errors: Array) -> tuple[float, float, float] | None:
    """Fits in percent where a dead time ends between samples, and that is clearly better.

    Args:
        tried: With the lags of an input that is held.
        j: Its place among the inputs.
        spread: Standard deviation of the output.
        errors: Of the model's own run, shape ``(n_samples,)``.

    Returns:
        Of the model's own run, of one with as many zeros as there can be, and of one with a coefficient more; ``None``
        where the record does not ask for it.
    """
    first, last = tried.lags[j]
    own = tried.own(errors)
    there, late = tried.with_lags(j, first, last + 1).best()
    if not late @ late < LESS * (own @ own):
        return None
    larger = there.with_pole(j).best()[1]
    if late @ late > AS_GOOD * (larger @ larger):
        return None
    if not significantly_better([late[:, np.newaxis]], [own[:, np.newaxis]], parameters=1, scale=spread**2):
        return None
    zeros = tried.best_beside(there)
    fits = [100.0 * (1.0 - float(np.linalg.norm(e)) / (spread * np.sqrt(len(own)))) for e in (own, zeros, late)]
    return fits[0], fits[1], fits[2]


def _said_late(model: AbstractModel, j: int, i: int, fits: tuple[float, float, float]) -> str:
    structure = model.structure
    assert isinstance(structure, TransferFunction)  # noqa: S101 - no other comes here
    name, n, zeros = model.mapping.inputs[j], structure.poles[j], structure.zeros[j]
    own, filled, late = fits
    begins = f"The free run of {model.mapping.outputs[i]} has a fit of {own:.1f} %, and"
    if zeros < n - 1 and 100.0 - filled < np.sqrt(AS_GOOD) * (100.0 - late):
        return (
            f"{begins} {filled:.1f} % with all zeros that {n} poles may have from {name}: it has fewer zeros than the "
            f"plant, or the plant's dead time ends between samples. Write zeros: {n - 1}, or delays: auto, which "
            "finds such a dead time."
        )
    return (
        f"{begins} {late:.1f} % where {name} acts from within a sample on: the plant's dead time is no whole number of "
        "samples, as this model's is. Write delays: auto, which finds one that ends between samples, or give it, as in "
        "delays: 2.5."
    )


def _continuous(model: AbstractModel) -> bool:
    return isinstance(model.structure, TransferFunction) and model.structure.domain is Domain.CONTINUOUS


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
    if lag > 1 and _continuous(model):
        other += ", or no whole number of samples (delays: auto)"
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
