r"""Where a free run over a record begins: the history that a start gives, and from which sample on it is scored.

A start that is estimated takes the first samples of the record as a window, finds the initial state with which the
model's free run comes closest to the output measured there, and runs on from the window's end. What is scored begins
after it, so that nothing is scored that was fitted. Over a window :math:`t < w`

.. math:: \hat x_0 = \arg\min_{x_0} \sum_{t < w} (y_t - \hat y_t(x_0))^2

is linear least squares for a linear model and Gauss-Newton for a network (:meth:`AbstractForm.refined` and the forms'
own states). Of a record that a deterministic model describes, the run is exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.models.channels.history import History, Start, StartKind
from sysid.models.contract.base import AbstractModel

LONGEST_WINDOW, SHARE_OF_RECORD = 50, 5
"""A window is a fifth of its record and 50 samples at most, or as long as the model's memory where that is longer: the
same for all models that remember less, so that they are scored on the same samples."""
MOVES, LEAST_BEFORE = 0.1, 5
"""Part of its range by which an input moves from where it stood, and samples before it does that show a state."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Beginning:
    """How a free run over a record begins.

    Args:
        history: The samples before the first that is run.
        first: Which sample of the record that is; those before are not scored.
    """

    history: History
    first: int


def window(memory: int, usable: NDArray[np.bool_], inputs: NDArray[np.float64] | None = None, *, asked: int = 0) -> int:
    """How many samples of a record an initial state is estimated on.

    Where inputs move within the window and no more behind it, as in a step test, it ends before they do, if the samples
    there show a state: what is left to be scored would be noise about a level.

    Args:
        memory: Samples that the model needs.
        usable: Which samples of the record are not masked, shape ``(n_samples,)``.
        inputs: The record's inputs, shape ``(n_samples, n_inputs)``; they are not looked at without.
        asked: A length that somebody chose; 0 for none.

    Returns:
        The number, masked samples included, at most all before the last sample that is not masked: one is left to be
        scored.

    Example:
        >>> [window(memory, np.ones(n, dtype=bool)) for memory, n in ((3, 100), (3, 1000), (9, 25))]
        [20, 50, 9]
        >>> window(3, np.arange(300) < 5)
        3
        >>> step = np.repeat([0.0, 1.0], [20, 180])[:, np.newaxis]
        >>> [window(memory, np.ones(200, dtype=bool), step) for memory in (3, 30)]
        [20, 40]
    """
    places = np.flatnonzero(usable)
    if not len(places):
        return 0
    wanted = asked or max(min(LONGEST_WINDOW, len(places) // SHARE_OF_RECORD), memory, 1)
    end = int(min(places[min(wanted, len(places)) - 1] + 1, places[-1]))
    if asked or inputs is None:
        return end
    before = _before_all_moves(inputs, end)
    return before if np.count_nonzero(usable[:before]) >= max(memory, LEAST_BEFORE) else end


def _before_all_moves(inputs: NDArray[np.float64], end: int) -> int:
    """The sample at which inputs begin to move that stand still from the end of a window on; 0 where some do not."""
    least = MOVES * np.ptp(inputs, axis=0)
    moving = np.flatnonzero(least > 0.0)
    if not len(moving) or (np.ptp(inputs[end:, moving], axis=0) > least[moving]).any():
        return 0
    return int(np.argmax((np.abs(inputs - inputs[0])[:, moving] > least[moving]).any(axis=1)))


def beginning(
    model: AbstractModel,
    inputs: NDArray[np.float64],
    output: NDArray[np.float64],
    start: Start,
    usable: NDArray[np.bool_] | None = None,
    *,
    case: str = "",
) -> Beginning:
    """How the free run of a model over a record begins.

    Args:
        model: The model.
        inputs: The record's inputs, shape ``(n_samples, n_inputs)``.
        output: The record's measured output, shape ``(n_samples,)``, or ``(n_samples, n_outputs)`` for a model of
            several outputs; read only as the start allows.
        start: Which start.
        usable: Which samples are not masked; all by default.
        case: Name of the record, for models with parameters that differ by case.

    Returns:
        The history, and the first sample that is run and scored.

    Raises:
        ConfigError: If the model has parameters by case, and neither knows the record nor sees samples of it.
        TraceError: If the record is not longer than a measured start.
    """
    form = model.recursion
    if start.kind is not StartKind.ESTIMATED:
        history = form.cased(start.history(inputs, output, model.resting, usable), case)
        return Beginning(history=history, first=start.n_measured)
    known = np.ones(len(output), dtype=np.bool_) if usable is None else usable
    first = window(form.memory, known, inputs, asked=start.n_measured)
    if first == 0:  # a single sample: nothing is left to estimate on
        history = form.cased(History.at_rest(inputs=inputs[0], output=model.resting), case)
        return Beginning(history=history, first=0)
    seen = None if known[:first].all() else known[:first]
    history = History(inputs=inputs[:first], output=output[:first], usable=seen)
    return Beginning(history=form.cased(form.refined(history), case), first=first)
