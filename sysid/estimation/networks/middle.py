"""The start of a short record that stands in the middle of all, on inputs that nobody measured.

Of a record of few samples a parameter, many networks explain the record alike and differ over other commands. Which of
them is right neither the error says nor the evidence: both go by the record. But where they differ most are wrong, each
in its own way, so that who is nearest to the middle of all is a better guess than who is nearest to the record. All
starts are trained to their end, each also cautiously (``starts/cautious.py``), and run on over the records' inputs
*backwards*; the start is taken that is nearest to the median run there. ``python -m tests.benchmarks short_records
--starts=5`` sets it beside the choice by the evidence.

Limits: starts that make the same mistake are the middle; three starts at least; all of them take their time, where a
race would have dropped most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.networks.starts.halving import planned_iterations
from sysid.estimation.networks.starts.multistart import Candidate, Multistart, Place, is_short
from sysid.estimation.networks.starts.united import FEWEST, distances, ends_of, keep_up
from sysid.estimation.networks.training import Training
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import Loop
from sysid.models import NARXModel, VectorNARXModel


def compared(multistart: Multistart) -> Multistart:
    """A multistart that trains all of its starts to their end, where they will be compared.

    Args:
        multistart: The multistart.

    Returns:
        The same, but where the record is short, nothing else chooses, and there are enough starts.
    """
    return replace(multistart, least=multistart.training.n_starts) if comparing(multistart) else multistart


def comparing(multistart: Multistart) -> bool:
    """Whether starts are compared on inputs that nobody measured.

    Args:
        multistart: The multistart.

    Returns:
        Whether the record is short, nothing else chooses, and there are enough starts.
    """
    return multistart.twice and _compares(multistart.training, selects=bool(multistart.selection))


def _compares(training: Training, *, selects: bool) -> bool:
    """Whether the starts of a short record are compared: nothing else chooses, and there are enough of them."""
    return training.choose_by == "selection" and not selects and training.n_starts >= FEWEST


def most_iterations(
    training: Training, *, n_samples: int, n_parameters: int, selects: bool, unites: bool, twice: bool
) -> float:
    """Iterations of all starts of a fit together, if none of them converges early.

    Args:
        training: How it is trained, with its number of starts.
        n_samples: Samples that count.
        n_parameters: Parameters of one network.
        selects: Whether there are selection traces.
        unites: Whether the structure's starts can be one model.
        twice: Whether a short record of it is fitted a second time.

    Returns:
        Their number.
    """
    elected = selects and training.choose_by == "selection"
    free = training.regularisation is None and training.loop is Loop.CLOSED
    short = twice and free and is_short(n_samples, n_parameters)
    least = training.ensemble if unites and not (twice and elected) else 1
    if short and _compares(training, selects=selects):
        least = training.n_starts
    return planned_iterations(training, least) + (training.max_iterations * least if short else 0)


def placed(
    multistart: Multistart, candidates: Sequence[Candidate], experiments: Sequence[Experiment]
) -> dict[Candidate, Candidate]:
    """The candidates, those that came to their end with how far they are from the middle.

    Args:
        multistart: The multistart, as :func:`compared` gives it.
        candidates: Every start at every look.
        experiments: The estimation records.

    Returns:
        By each candidate what it becomes; itself where starts are not compared. Who is far behind comes last.
    """
    same = dict(zip(candidates, candidates, strict=True))
    ends = ends_of(candidates, multistart.training.choose_by)
    if not comparing(multistart):
        return same
    # Of a record without noise, who meets it is right, and who does not is not, however many these are.
    keeps_up = keep_up(ends, multistart.provider.n_samples)
    near = [one for one, close in zip(ends, keeps_up, strict=True) if close]
    behind = {one: replace(one, place=Place.LAST) for one in ends if one not in near}
    if len(near) < FEWEST:
        return same | behind
    away = distances([backwards(model_of(one), experiments) for one in near])
    return same | behind | {one: replace(one, away=float(far)) for one, far in zip(near, away, strict=True)}


def backwards(model: NARXModel | VectorNARXModel, experiments: Sequence[Experiment]) -> NDArray[np.float64]:
    """Outputs over the records' inputs backwards, from where the run over them ends.

    Args:
        model: The model.
        experiments: The records.

    Returns:
        All of them one after the other, in scaled numbers, shape ``(n_samples_of_all_records * n_outputs,)``.
    """
    found = []
    with np.errstate(all="ignore"):  # what runs away is told by its distance
        for one in experiments:
            run = model.simulate(np.concatenate([one.inputs, one.inputs[::-1]]), one.history)
            found.append((run[len(one.inputs) :] / model.scaling.output_scale).ravel())
    return np.concatenate(found)


def model_of(candidate: Candidate) -> NARXModel | VectorNARXModel:
    """The model of a start.

    Args:
        candidate: The start of a NARX network.

    Returns:
        Its model.
    """
    assert isinstance(candidate.model, NARXModel | VectorNARXModel)  # noqa: S101 - all are
    return candidate.model
