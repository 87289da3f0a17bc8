"""Polynomial NARX of traces: terms by orthogonal least squares, as many as the free run says, refined for it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.equations.system import written_name
from sysid.errors import FitDivergedError
from sysid.estimation.blocks.selection import Chosen, choose_terms
from sysid.estimation.clock import now
from sysid.estimation.grey_box.fit import fit_equations
from sysid.estimation.grey_box.readying import built_template
from sysid.estimation.linear.arx import first_output
from sysid.estimation.linear.regression import nothing_in_a_row
from sysid.estimation.networks.training import FitProgress, Training, check_hidden_states
from sysid.estimation.records.experiment import Experiment, experiments_of
from sysid.estimation.results.result import FitResult
from sysid.models import BuiltModel, GreyBox, Lags, Mapping, PolynomialNARX, Start
from sysid.models.blocks.curves import Text, number
from sysid.models.blocks.polynomial_narx import Term
from sysid.traces import Trace

Array = NDArray[np.float64]

FAR = 10.0
"""Level of a channel, in standard deviations, from which its polynomials are of what is above it."""

CHOOSING, COUNTING = 0.3, 0.6
"""Shares of a fit's time by whose ends its terms are chosen, and it is known how many of them the free run wants."""

check_training = partial(check_hidden_states, "a polynomial NARX model")
"""Refuses options that do not apply: its terms are chosen one step ahead, and refined for the free run."""


def fit_polynomial_narx(
    traces: Sequence[Trace],
    mapping: Mapping,
    structure: PolynomialNARX,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    selection: Sequence[Trace] = (),
    vet: Callable[[Any], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Choose the terms of a polynomial and fit it to the free run.

    Args:
        traces: Estimation traces; never concatenated.
        mapping: Which channels go in, which comes out.
        structure: The structure.
        training: How the coefficients are refined; options for lagged regressors do not apply.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit, at which a run from rest begins; by default it begins where the inputs
            hold it, for ever.
        selection: Traces whose free run says how many terms; without them Schwarz's criterion over the fitted ones.
        vet: Whether a model's free run is stable.
        on_progress: Called after every iteration, from the threads that train.

    Returns:
        The fit, with the uncertainty of its coefficients.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        FitDivergedError: If no number of terms has a free run.
        TraceError: If no sample counts.
    """
    began = now()
    training = (training or Training()).with_starts(1)
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    begins = {} if rest_output is None else {mapping.output: rest_output}
    start = start or Start()
    lags = structure.lags(len(mapping.inputs))
    experiments = experiments_of(traces, mapping, start, rest)
    X, y = _rows(experiments, lags)
    if not len(y):
        raise nothing_in_a_row(lags.depth + 1, experiments)
    origin = _origin(traces, mapping)
    places = [i for i, lags_i in enumerate((*lags.inputs, lags.output)) for _ in lags_i]
    found = choose_terms(
        X - origin[places][:, None], y - origin[-1], structure.candidates(len(mapping.inputs)), structure.terms,
        until=began + CHOOSING * training.max_time_s,
    )  # fmt: skip
    best, tried = _best(
        found, structure, mapping, data=(traces, selection), start=start, begins=begins, origin=origin,
        until=began + COUNTING * training.max_time_s,
    )  # fmt: skip
    fitted = fit_equations(
        *built_template(traces, mapping, best.grey, built_of=structure, start=start, rest_output=rest_output),
        training, (traces, selection, start),
        scattered=frozenset(), began=began, vet=vet, on_progress=on_progress,
    )  # fmt: skip
    model = fitted.model
    assert isinstance(model, BuiltModel)  # noqa: S101 - the template is one
    names = structure.regressors(mapping, origin)
    explained = ", ".join(
        f"{_written(term, names) or 'constant'} {share:.2%}"
        for term, share in zip(found.terms[: best.terms], found.reductions, strict=False)
    )
    told = [f"One step ahead the terms explain, in the order in which they came: {explained}."] * bool(explained)
    if found.cut or tried < len(found.terms):
        told.append(
            f"The time ended before all was tried: {len(found.terms)} terms were chosen one step ahead, of at most "
            f"{structure.terms}, and {tried} of them were run freely. Allow more time, or ask for fewer terms or lags."
        )
    return replace(fitted, notes=(*fitted.notes, model.equations, *told))


def _origin(traces: Sequence[Trace], mapping: Mapping) -> Array:
    """What each channel is counted from, inputs first: 0, but for one that hardly moves beside its level.

    Powers of 1000.1, 1000.2 ... are all but one number; those of what is above 1000 are not.
    """
    found = []
    for name in (*mapping.inputs, *mapping.outputs):
        x = np.concatenate([trace[name][trace.usable_samples] for trace in traces])
        if not len(x) or np.ptp(x) == 0.0:
            found.append(float(x[0]) if len(x) else 0.0)
            continue
        middle, moves = float(x.mean()), float(x.std())
        found.append(round(middle, -math.floor(math.log10(moves))) if abs(middle) > FAR * moves else 0.0)
    return np.array(found)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Candidate:
    terms: int
    grey: GreyBox
    criterion: float


def _rows(experiments: Sequence[Experiment], lags: Lags) -> tuple[Array, Array]:
    """Regressors and output of every row that counts, shapes ``(n_regressors, n_rows)`` and ``(n_rows,)``."""
    found = []
    for one in experiments:
        e = one.from_measured(lags).one_step(lags)
        past_u, past_y = e.history.padded(lags.depth)
        u, y = np.concatenate([past_u, e.inputs]), np.concatenate([past_y, e.output])
        n, depth = len(e.output), lags.depth
        rows = [
            u[depth - lag : depth - lag + n, j] for j, lag in zip(lags.input_channel, lags.input_lag, strict=True)
        ] + [y[depth - lag : depth - lag + n] for lag in lags.output]
        weights = np.ones(n) if e.weights is None else e.weights
        counted = weights > 0.0
        found.append((np.array(rows).reshape(len(rows), n)[:, counted], e.output[counted]))
    return np.concatenate([x for x, _ in found], axis=1), np.concatenate([y for _, y in found])


def _best(
    found: Chosen,
    structure: PolynomialNARX,
    mapping: Mapping,
    *,
    data: tuple[Sequence[Trace], Sequence[Trace]],
    start: Start,
    begins: Dict[str, float],
    origin: Array,
    until: float,
) -> tuple[_Candidate, int]:
    """The number of terms whose free run is best, over the traces that choose where there are any.

    And how many numbers there was time for; until one has a free run, time does not end it.
    """
    traces, selection = data
    tried: list[_Candidate] = []
    for n, coefficients in enumerate(found.coefficients, start=1):
        grey = equations(structure, mapping, found.terms[:n], coefficients, origin, begins=begins)
        rest = begins.get(mapping.output)
        template, _ = built_template(traces, mapping, grey, built_of=structure, start=start, rest_output=rest)
        squares, count = 0.0, 0
        with np.errstate(over="ignore", invalid="ignore"):  # polynomials explode
            for trace in selection or traces:
                e = Experiment.for_model(trace, template, start)
                away = template.simulate(e.inputs, e.history) - e.output
                weights = np.ones(len(away)) if e.weights is None else e.weights
                squares, count = squares + float(weights @ away**2), count + int(np.count_nonzero(weights))
        price = 0.0 if selection else n * math.log(max(count, 1)) / max(count, 1)
        value = math.log(max(squares / max(count, 1), 1e-300)) + price if math.isfinite(squares) else math.inf
        tried.append(_Candidate(terms=n, grey=grey, criterion=value))
        if now() > until and math.isfinite(min(one.criterion for one in tried)):
            break
    usable = [one for one in tried if math.isfinite(one.criterion)]
    if not usable:
        raise FitDivergedError(
            f"none of the polynomials of up to {len(tried)} terms has a free run that stays finite",
            remedy="use a lower degree or fewer lags, remove what is noise, or fit a neural state space",
        )
    return min(usable, key=lambda one: one.criterion), len(tried)


def equations(
    structure: PolynomialNARX,
    mapping: Mapping,
    terms: Sequence[Term],
    coefficients: Sequence[float],
    origin: Array | None = None,
    *,
    begins: Dict[str, float] | None = None,
) -> GreyBox:
    """A polynomial as equations, its coefficients to be estimated.

    Args:
        structure: The structure.
        mapping: Which channels go in, which comes out.
        terms: Its terms.
        coefficients: Where they start, in units.
        origin: What each channel is counted from, inputs first; nothing by default.
        begins: Where the output has stood before a run from rest; where nothing changes by default.

    Returns:
        The grey box.
    """
    text, names = Text(taken=frozenset((*mapping.inputs, *mapping.outputs))), structure.regressors(mapping, origin)
    level = [number(float(origin[-1]))] if origin is not None and origin[-1] else []
    parts = [
        "*".join(filter(None, [text.estimated(f"c{i}", c), _written(term, names)]))
        for i, (term, c) in enumerate(zip(terms, coefficients, strict=True), start=1)
    ]
    text.lines.append(f"{written_name(mapping.output)} = {' + '.join(level + parts)}")
    recurs = any(place >= len(names) - len(structure.output_delays) for term in terms for place in term)
    initial = begins if begins and recurs else {}
    return GreyBox(equations="\n".join(text.lines), parameters=tuple(text.parameters), initial=initial)


def _written(term: Term, names: Sequence[str]) -> str:
    """A product as equations have it, powers as powers."""
    powers = {place: term.count(place) for place in dict.fromkeys(term)}
    return "*".join(names[place] + (f"^{n}" if n > 1 else "") for place, n in powers.items())
