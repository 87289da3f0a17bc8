"""What equations need to know of the records before a fit: levels and ranges of what is hidden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.grey_box.provider import EquationProvider
from sysid.estimation.grey_box.record import Record
from sysid.estimation.grey_box.stepping import STEPPED
from sysid.estimation.parameters.named import named_of
from sysid.models.grey_box.equation_form import EquationForm
from sysid.models.grey_box.grey_box_model import EquationModel

Array = NDArray[np.float64]

WINDOW = 50
"""Samples on which the states before a record are looked for."""

SOFT = 0.02
"""Width of a switch in training, over the range of its argument; then :data:`SHARPER` times that, again and again."""

SOFT_ROOT = 1e-3
"""Width of a root in training, over the largest magnitude of its argument."""

SHARPER, ROUNDS = 0.25, 6


def provider_for(model: EquationModel, form: EquationForm, records: tuple[Record, ...]) -> EquationProvider:
    """The residuals of a model over some records, what is trained in scales and bounds of its parameters.

    Args:
        model: The model.
        form: What is run.
        records: The records.

    Returns:
        The residuals.
    """
    named = named_of(model.grey, model.cases, model.lowered.n_weights)
    places = np.array([one.place for one in named], dtype=np.int64)
    scale, limits = np.ones(len(model.theta)), np.tile([[-np.inf], [np.inf]], len(model.theta))
    scale[places] = [one.parameter.scale for one in named]
    limits[0, places] = [one.parameter.low for one in named]
    limits[1, places] = [one.parameter.high for one in named]
    return EquationProvider(form=form, records=records, scale=scale, limits=limits)


def first_terms(form: EquationForm, outputs: Sequence[str], means: Array) -> EquationForm:
    """Levels and ranges of the states where nothing but names is known: a state that is an output is as it is.

    Args:
        form: The form.
        outputs: Names of the outputs.
        means: Of each output, in its unit.

    Returns:
        The form with a guess.
    """
    terms, names = form.terms, form.lowered.states
    level, scale = terms.level.copy(), np.where(terms.declared & (terms.level != 0.0), np.abs(terms.level), 1.0)
    for i, name in enumerate(names):
        owner = name.split("[k-")[0]
        if owner in outputs:
            j = list(outputs).index(owner)
            scale[i] = form.output_scale[j]
            if not terms.declared[i]:
                level[i] = means[j]
    return replace(form, terms=replace(terms, level=terms.held(level), scale=scale))


def seen_terms(provider: EquationProvider, theta: Array) -> tuple[EquationForm, list[Array]]:
    """Levels and ranges of the states as the records visit them, and where the records begin.

    Args:
        provider: The records.
        theta: What is trained.

    Returns:
        The form with these, its parameters being those given, and the state before each record.
    """
    form = provider.at(theta)
    each = [provider.of_record(form, theta, i) for i in range(len(provider.records))]
    begun = [provider.begin(one, theta, i) for i, one in enumerate(each)]
    whole, terms = _visited(form, [path for _, path in provider.paths(theta)]), form.terms
    low, high = whole.min(axis=0, initial=np.inf), whole.max(axis=0, initial=-np.inf)
    span = np.where(high > low, (high - low) / 2.0, terms.scale)
    level = np.where(terms.declared | (high < low), terms.level, (low + high) / 2.0)
    return replace(form, terms=replace(terms, level=terms.held(level), scale=span)), begun


def _visited(form: EquationForm, paths: Sequence[Array]) -> Array:
    """The states that records visit; what stood before a record, and no sample shows well, is not where a past is.

    Args:
        form: The form.
        paths: Of each record, shape ``(n_samples, n_states)``.

    Returns:
        Shape ``(n_visited, n_states)``, all finite.
    """
    # The first rows of a past have its values before the record: of one that hardly counts these may be anything.
    parts = [name.rpartition("[k-") for name in form.lowered.states]
    depths = [int(index.rstrip("]")) if owner else 0 for owner, _, index in parts]
    kept = []
    for path in paths:
        one = path.copy()
        for j, depth in enumerate(depths):
            if len(path) > depth:
                one[:depth, j] = path[depth, j]
        kept.append(one[np.isfinite(one).all(axis=1)])
    return np.concatenate(kept) if kept else np.zeros((0, form.lowered.n_states))


def norms_for(provider: EquationProvider, theta: Array) -> Array:
    """Levels and scales of what the networks see over the records, and of what they give.

    A network whose scale is not given gets the one that moves the output by its range, had it given a constant.

    Args:
        provider: The records; the networks' weights are ignored.
        theta: What is trained.

    Returns:
        Shape ``(n_norms,)``.
    """
    form = provider.at(theta)
    low = form.lowered
    norms = np.array(low.norms, dtype=np.float64)
    if not low.nets:
        return norms
    probes = _probes(form, provider, theta)
    n_free = low.counts["free"]
    for net in low.nets:
        for i in range(net.arguments):
            seen = probes[:, net.probe + i]
            bottom, top = (float(seen.min()), float(seen.max())) if len(seen) else (0.0, 0.0)
            norms[net.norm + 2 * i] = (top + bottom) / 2.0
            norms[net.norm + 2 * i + 1] = 2.0 / (top - bottom) if top > bottom else 1.0
        if not net.scaled:
            norms[net.norm + 2 * net.arguments] = _net_scale(form, provider, theta, n_free + net.stop - 1)
    return norms


def widths_for(provider: EquationProvider, theta: Array) -> Array:
    """How soft each switch and root is in training: a share of what its argument ranges over.

    Args:
        provider: The records.
        theta: What is trained.

    Returns:
        One for each switch, in the unit of its argument.
    """
    form = provider.at(theta)
    if not form.lowered.switches:
        return np.zeros(0)
    switches = form.lowered.switches
    probes = _probes(form, provider, theta)[:, [one.probe for one in switches]]
    roots = np.array([one.root for one in switches])
    reach = np.where(roots, np.abs(probes).max(axis=0, initial=0.0), np.ptp(probes, axis=0) if len(probes) else 0.0)
    return np.where(roots, SOFT_ROOT, SOFT) * np.where(reach > 0.0, reach, 1.0)


def _probes(form: EquationForm, provider: EquationProvider, theta: Array) -> Array:
    found = np.concatenate([form.probed(u, path) for u, path in provider.paths(theta)])
    return np.asarray(found[np.isfinite(found).all(axis=1)])


def _net_scale(form: EquationForm, provider: EquationProvider, theta: Array, place: int) -> float:
    """What a network has to give to move the output by its range."""
    squares, n = 0.0, 0
    for i, record in enumerate(provider.records):
        own = provider.of_record(form, theta, i)
        x = provider.begin(own, theta, i)
        S = np.zeros((len(x), place + 1))
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable start has none
            _, J = own.moved(record.u[:STEPPED], x, S, place + 1)
            moves = (J[:, :, place] / form.output_scale).ravel()
        moves = moves[np.isfinite(moves)]
        squares, n = squares + float(moves @ moves), n + len(moves)
    rms = (squares / max(n, 1)) ** 0.5
    return 1.0 / rms if 0.0 < rms < np.inf else 1.0
