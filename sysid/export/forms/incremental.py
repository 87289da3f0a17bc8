r"""A model in incremental (delta) form: the form that files are written in, because short numbers can hold it.

A surrogate of a slow system is nearly an integrator, and its regressors are nearly equal: :math:`y(t-1)` and
:math:`y(t-2)` differ in their last digits, and what counts are weights that nearly cancel. In float32 the rounding of
such weights is a wrong gain at rest (0.09 psi in an ARX model with 30 lags), and an output that is far larger than its
change of a sample swallows that change (0.003 psi). Both go away, without a single number in double, when the
differences are taken before they are weighted, and the output is written as what is added to its last value:

.. math::
    w_1 x(t-l_1) + w_2 x(t-l_2) + \dots = \Bigl(\sum_i w_i\Bigr) x(t-l_1)
        - \sum_j \Bigl(\sum_{i>j} w_i\Bigr) \bigl(x(t-l_j) - x(t-l_{j+1})\bigr)

with one :math:`1` less in the sum for the output's own level, and with what rounding takes from the new output kept
for the next step (compensated summation, Kahan 1965, Comm. ACM 8(1); in filters known as error feedback). The
difference of two near numbers is exact in floating point (Sterbenz 1974). In double precision it is the same recursion.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import fsum

import numpy as np
from numpy.typing import NDArray

from sysid.export.forms.lagged import LaggedForm


@dataclass(frozen=True, kw_only=True)
class Term:
    """A regressor in incremental (delta) form.

    Args:
        channel: An input, or the number of inputs plus the place of an output.
        lag: The sample, counted back from the step.
        older: The sample that is taken from it, further back; ``None`` for a level.
    """

    channel: int
    lag: int
    older: int | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class IncrementalForm:
    """Terms and their weights: the same sums as the lowered form's, over other regressors.

    Args:
        inputs: The inputs' terms.
        outputs: The outputs' terms.
        hidden_weights: Shape ``(n_neurons, n_terms)``, inputs before outputs.
        gates: Shape ``(n_neurons, n_terms)``, or without rows.
        linear: Shape ``(n_outputs, n_terms)``; of what is added to the last outputs where it ``adds``. Elsewhere
            the outputs' terms are levels, lest a number that is not be carried on.
    """

    inputs: tuple[Term, ...]
    outputs: tuple[Term, ...]
    hidden_weights: NDArray[np.float64]
    gates: NDArray[np.float64]
    linear: NDArray[np.float64]

    @classmethod
    def of(cls, form: LaggedForm, *, blocks: bool = False) -> IncrementalForm:
        """A lowered form in incremental (delta) form.

        Args:
            form: The lowered form.
            blocks: Where it adds, whether the outputs' terms are in blocks that shift from step to step: the
                levels of all outputs, their last rates, those of the sample before, up to the longest lag of any.
                More terms, with zero for weight, but this step's are the last one's.

        Returns:
            The form.

        Example:
            >>> from sysid.models import ARX, ARXModel, Mapping
            >>> arx = ARXModel(orders=ARX(na=2, nb=(1,), nk=(1,)), coefficients=[0.5, 1.75, -0.75], intercept=0.0,
            ...     mapping=Mapping.parse("u -> y"), sample_time=0.1, input_units=("V",), output_unit="V",
            ...     rest_output=0.0)
            >>> form = IncrementalForm.of(LaggedForm.of(arx))
            >>> [(term.channel, term.lag, term.older) for term in (*form.inputs, *form.outputs)]
            [(0, 1, None), (1, 1, None), (1, 1, 2)]
            >>> form.linear.tolist()
            [[0.5, 0.0, 0.75]]
        """
        table = np.concatenate([form.hidden_weights, form.gates, form.linear])
        first = len(form.hidden_weights) + len(form.gates)  # of the linear parts
        longest = max(max(own, default=0) for own in form.lags[form.n_inputs :])
        found: list[tuple[tuple[Term, ...], NDArray[np.float64]]] = []
        at = 0
        for channel, own in enumerate(form.lags):
            columns = table[:, at : at + len(own)]
            at += len(own)
            output = channel - form.n_inputs
            if output >= 0 and not form.adds:
                found.append((tuple(Term(channel=channel, lag=lag) for lag in own), columns))
                continue
            used = tuple(range(1, longest + 1)) if output >= 0 and blocks else own
            weights = _weights(columns if used == own else _spread(columns, own, longest))
            if output >= 0:
                row = first + output
                weights[row, 0] = fsum([*columns[row].tolist(), -1.0])  # rounded once: nearly everything cancels
            found.append((_terms(channel, used), weights))
        inputs, outputs = found[: form.n_inputs], found[form.n_inputs :]
        whole = np.concatenate([weights for _, weights in found], axis=1)
        terms = [term for own, _ in outputs for term in own]
        if blocks and form.adds:
            n = sum(len(own) for own, _ in inputs)
            order = [output * longest + back for back in range(longest) for output in range(form.n_outputs)]
            whole, terms = whole[:, [*range(n), *(n + i for i in order)]], [terms[i] for i in order]
        return cls(
            inputs=tuple(term for own, _ in inputs for term in own),
            outputs=tuple(terms),
            hidden_weights=whole[: form.neurons],
            gates=whole[form.neurons : first],
            linear=whole[first:],
        )


def _terms(channel: int, lags: tuple[int, ...]) -> tuple[Term, ...]:
    rates = [Term(channel=channel, lag=newer, older=older) for newer, older in pairwise(lags)]
    return (Term(channel=channel, lag=lags[0]), *rates) if lags else ()


def _weights(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights of level and rates from those of the samples."""
    if not columns.shape[1]:
        return columns.copy()
    beyond = np.cumsum(columns[:, ::-1], axis=1)[:, ::-1]  # the sum from each lag on
    return np.concatenate([beyond[:, :1], -beyond[:, 1:]], axis=1)


def _spread(columns: NDArray[np.float64], lags: tuple[int, ...], longest: int) -> NDArray[np.float64]:
    """The same weights with zeros for the lags between and beyond."""
    wide = np.zeros((len(columns), longest))
    wide[:, [lag - 1 for lag in lags]] = columns
    return wide
