"""Whether a free run stays bounded and settles where it should, over many sequences that no record contains."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import cycle, islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.estimation.clock import now
from sysid.estimation.stability.beginnings import TWICE, Beginnings, Begun, compare_beginnings
from sysid.estimation.stability.sequences import AbstractSequences, InputSequence
from sysid.models import AbstractModel, Beginning, Start, StartKind, beginning
from sysid.names import csv_cell

SEQUENCES = 1000
SEED = 20
REACH = 1.0
"""How far beyond the range that its output has in the records a run may go, in widths of that range, and still count as
bounded: networks are held there (``sysid.models.networks.narx.CLAMP``), and a run that is held has lost its way."""

TOLERANCE = 0.1
"""How far from its plateau a run may settle, as a share of the output's range in the records."""

AT_ONCE = 10
"""Sequences that are in memory at the same time, and that are finished once they are begun."""

FEWEST = 10
"""Sequences that are run however long they take."""

Run = Callable[[InputSequence], NDArray[np.float64]]
"""The free run over a sequence: outputs of shape ``(n_samples,)`` or ``(n_samples, n_outputs)``."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stability:
    """What a check found.

    Args:
        source: Where the sequences come from, as a sentence.
        seed: Of the sequences.
        sequences: How many were run.
        unbounded: How many left the bounds.
        judged: How many had a plateau to settle on.
        unsettled: How many of those stayed bounded and settled elsewhere, or not at all.
        tolerance: How far from its plateau a run may settle, as a share of the output's range.
        largest_plateau_error: Over all judged samples of the bounded sequences, as a share of the output's range; NaN
            without any.
        worst: The worst sequence: the first that left its bounds, or the one that settled furthest away.
        worst_outputs: The run over it, shape ``(n_samples, n_outputs)``.
        columns: Names of the sequences' inputs and outputs.
        sample_time: Seconds between samples.
        beyond: On how many a linear model that follows the records left the bounds, or did not settle, either: they
            say nothing, and are neither counted as unbounded nor judged.
        asked: How many were to be run; more than were, where the time ended. 0 where nobody said.
        beginnings: Whether the run forgets where it began; ``None`` where that was not asked.
    """

    source: str
    seed: int
    sequences: int
    unbounded: int
    judged: int
    unsettled: int
    tolerance: float
    largest_plateau_error: float
    worst: InputSequence
    worst_outputs: NDArray[np.float64]
    columns: tuple[tuple[str, ...], tuple[str, ...]]
    sample_time: float
    beyond: int = 0
    asked: int = 0
    beginnings: Beginnings | None = None

    @property
    def cut(self) -> bool:
        """Whether the time ended before all sequences were run."""
        return self.sequences < self.asked

    @property
    def stable(self) -> bool:
        """Whether every run stayed bounded and settled where it should."""
        return self.unbounded == 0 and self.unsettled == 0

    @property
    def forgets(self) -> bool:
        """Whether the run forgets where it began; true where that was not asked."""
        return self.beginnings is None or self.beginnings.forgets

    @property
    def sentence(self) -> str:
        """What was found, for people."""
        runs = f"{self.sequences - self.beyond} random sequences"
        nothing = " more say nothing: a linear model of the records leaves its bounds or its plateau there, too."
        told = f"{self._found(runs)}{f' {self.beyond}{nothing}' if self.beyond else ''}"
        return f"{told} {self._time_ended}" if self.cut else told

    @property
    def _time_ended(self) -> str:
        return (
            f"{self.sequences:,} of {self.asked:,} sequences were checked in the time; another machine may come to "
            "another number. A larger time_share of the check allows more."
        )

    def _found(self, runs: str) -> str:
        if self.unbounded:
            return f"Unstable: the free run leaves its bounds on {self.unbounded} of {runs} ({self.worst.name} first)."
        settled = f"at most {100.0 * self.largest_plateau_error:.2g} % of the output's range from its plateau"
        if self.unsettled:
            return f"Unstable: the free run settles elsewhere on {self.unsettled} of {runs}, {settled}."
        if not self.judged:
            return (
                f"The free run stays bounded on {runs}. None of them stands still, so where it settles was not judged."
            )
        return f"The free run stays bounded on {runs} and settles {settled}."

    def to_dict(self) -> dict[str, Any]:
        """The findings as JSON values, without the worst sequence's signals."""
        return {
            "stable": self.stable,
            "text": self.sentence,
            "source": self.source,
            "seed": self.seed,
            "sequences": self.sequences,
            "unbounded": self.unbounded,
            "beyond": self.beyond,
            "judged": self.judged,
            "unsettled": self.unsettled,
            "tolerance": self.tolerance,
            "largest_plateau_error": None if math.isnan(self.largest_plateau_error) else self.largest_plateau_error,
            "worst": self.worst.name,
            **({"asked": self.asked} if self.cut else {}),
            **({} if self.beginnings is None or self.forgets else {"apart": self.beginnings.apart}),
        }

    def worst_csv(self) -> str:
        """The worst sequence as CSV: time, inputs, targets, the free run, and where it was judged."""
        inputs, outputs = self.columns
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        targets, runs = ([f"{name} {what}" for name in outputs] for what in ("target", "free run"))
        writer.writerow(["time [s]", *map(csv_cell, [*inputs, *targets, *runs]), "judged"])
        values = np.hstack([self.worst.inputs, self.worst.targets, self.worst_outputs])
        for i, (row, judged) in enumerate(zip(values.tolist(), self.worst.judged.tolist(), strict=True)):
            writer.writerow([repr(round(i * self.sample_time, 9)), *(f"{value:.9g}" for value in row), int(judged)])
        return text.getvalue()


def check_stability(
    model: AbstractModel | Run,
    sequences: AbstractSequences,
    *,
    count: int = SEQUENCES,
    seed: int = SEED,
    tolerance: float = TOLERANCE,
    reference: Callable[[], Run | None] = lambda: None,
    seconds: float = math.inf,
    commands: AbstractSequences | None = None,
) -> Stability:
    """Run a model over random sequences and see whether it stays bounded and settles where it should.

    Args:
        model: A model of the sequences' outputs, or a function that runs anything over a sequence.
        sequences: Where the sequences come from.
        count: How many.
        seed: Of the random numbers; the same seed gives the same sequences.
        tolerance: How far from its plateau a run may settle, as a share of the output's range in the records.
        reference: Gives the run of linear models that follow the records, asked for where the free run leaves the
            bounds or does not settle: a sequence on which these do the same says nothing. A sequence asks for more than
            was recorded, or a slow system is not back at its plateau by then.
        seconds: Wall time after which no further sequence is begun; the first :data:`FEWEST` always are.
        commands: Sequences over which it is asked whether the run forgets where it began; by default the same.

    Returns:
        What was found, and on how many sequences where the time ended before all were run.

    Raises:
        TraceError: If there are no sequences.

    Example:
        >>> from sysid.models import ARX, ARXModel, Mapping
        >>> from sysid.traces import Channel, Trace
        >>> from sysid.estimation.stability.excursions import Excursions
        >>> u = np.repeat([0.0, 1.0, 0.0], 60)
        >>> model = ARXModel(orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([0.2, 0.8]), intercept=0.0,
        ...     mapping=Mapping.parse("u -> y"), sample_time=1.0, input_units=("V",), output_unit="V", rest_output=0.0)
        >>> channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
        >>> values = np.column_stack([u, model.simulate(u[:, None])])
        >>> trace = Trace(name="record", sample_time=1.0, channels=channels, values=values)
        >>> check_stability(model, Excursions.of([trace], ["u"], ["y"]), count=20).stable
        True
    """
    low, high = sequences.output_range
    width, until = np.where(high > low, high - low, 1.0), now() + seconds
    unbounded = judged = unsettled = drawn = further = 0
    largest = np.nan
    worst: tuple[tuple[bool, float], InputSequence, NDArray[np.float64]] | None = None
    begun: list[Begun] = []
    runs = partial(free_runs, model, within=(low, high))

    def again() -> list[Begun]:
        drawn_again = () if commands is None else commands.draw(min(drawn, TWICE), seed)
        return [(one, output.reshape(len(one.inputs), -1)) for one, output in runs(drawn_again)]

    for sequence, output in runs(_in_time(sequences.draw(count, seed), until)):
        drawn += 1
        outputs = output.reshape(len(sequence.inputs), -1)
        begun += [(sequence, outputs)] if commands is None and drawn <= TWICE else []
        lost, error = _lost(outputs, low, high), _away(outputs, sequence, width)
        if (lost or error > tolerance) and _says_nothing(sequence, reference(), (low, high), tolerance, lost=lost):
            further += 1
            worst = worst or ((False, -1.0), sequence, outputs)
            continue
        if lost:
            unbounded, error = unbounded + 1, 0.0
        elif sequence.judged.any():
            unsettled += error > tolerance
            largest = float(np.fmax(largest, error))
        judged += bool(sequence.judged.any())
        if worst is None or (lost, error) > worst[0]:
            worst = (lost, error), sequence, outputs
    if worst is None:
        raise TraceError("there are no sequences to run", expected="at least one", got=f"count = {count}")
    return Stability(
        source=sequences.source,
        seed=seed,
        sequences=drawn,
        unbounded=unbounded,
        judged=judged,
        unsettled=unsettled,
        tolerance=tolerance,
        largest_plateau_error=largest,
        worst=worst[1],
        worst_outputs=worst[2],
        columns=(sequences.inputs, sequences.outputs),
        sample_time=sequences.sample_time,
        beyond=further,
        asked=sequences.available(count),
        # What runs away is not asked whether it forgets.
        beginnings=None if unbounded or unsettled else compare_beginnings(runs, begun or again(), width),
    )


def _in_time(sequences: Iterable[InputSequence], until: float) -> Iterator[InputSequence]:
    """Sequences for which there is time."""
    for number, sequence in enumerate(sequences):
        if number >= FEWEST and now() > until:
            return
        yield sequence


def _lost(outputs: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    width = np.where(high > low, high - low, 1.0)
    beyond = np.maximum(low - outputs, outputs - high) / width
    return not bool(np.all(beyond < REACH * (1.0 - 1e-9)))  # NaN counts as lost


def _away(outputs: NDArray[np.float64], sequence: InputSequence, width: NDArray[np.float64]) -> float:
    """How far a run is from its plateau at most, as a share of the output's range; 0 where nothing is judged."""
    return float(np.max(np.abs(outputs - sequence.targets)[sequence.judged] / width, initial=0.0))


def _says_nothing(
    sequence: InputSequence,
    reference: Run | None,
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]],
    tolerance: float,
    *,
    lost: bool,
) -> bool:
    """Whether linear models of the records do the same: leave the bounds, or have not settled by then."""
    if reference is None:
        return False
    low, high = bounds
    outputs = reference(sequence)
    if lost:
        return _lost(outputs, low, high)
    return not _away(outputs, sequence, np.where(high > low, high - low, 1.0)) <= tolerance


def free_runs(
    model: AbstractModel | Run,
    sequences: Iterable[InputSequence],
    *,
    within: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> Iterator[tuple[InputSequence, NDArray[np.float64]]]:
    """Each sequence with the run over it, in order; a model's kernels leave the interpreter to a second thread.

    Where parameters differ by case, the sequences are dealt out to the cases.

    Args:
        model: A model of the sequences' outputs, or a function that runs anything over a sequence.
        sequences: What is run.
        within: Least and greatest output of the records. A model with a state begins where nothing changes at the first
            inputs, which a slow system may never have come near: it then begins by the first outputs of the sequence.

    Yields:
        A sequence, and the outputs: shape ``(n_samples,)`` or ``(n_samples, n_outputs)``.
    """
    if not isinstance(model, AbstractModel):
        yield from ((sequence, model(sequence)) for sequence in sequences)
        return
    several, dealt = model.structure.several_outputs, model.variants
    begun: dict[tuple[int, bytes], Beginning | None] = {}

    def begins(one: InputSequence, variant: AbstractModel) -> Beginning | None:
        """Where a run begins that would not begin within the records; sequences of one record begin alike."""
        if within is None:
            return None
        key = id(variant), np.concatenate([one.inputs[0], one.targets[0]]).tobytes()
        if key not in begun:
            first = variant.simulate(one.inputs[:1], one.history(several=several)).reshape(1, -1)
            targets = one.targets if several else one.targets[:, 0]
            lost = _lost(first, *within)
            begun[key] = beginning(variant, one.inputs, targets, Start(kind=StartKind.ESTIMATED)) if lost else None
        return begun[key]

    def run(one: InputSequence, variant: AbstractModel, at: Beginning | None) -> NDArray[np.float64]:
        if at is None:
            return variant.simulate(one.inputs, one.history(several=several))
        before = one.targets[: at.first] if several else one.targets[: at.first, 0]
        return np.concatenate([before, variant.simulate(one.inputs[at.first :], at.history)])

    waiting, turns = iter(sequences), cycle(dealt)
    with ThreadPoolExecutor(1) as pool:
        while some := list(islice(waiting, AT_ONCE)):
            jobs = [(one, variant, begins(one, variant)) for one, variant in zip(some, turns, strict=False)]
            half = len(jobs) // 2
            # Half of them at once: to hand over each by itself took as long as a short run.
            others = pool.submit(lambda dealt: [run(*job) for job in dealt], jobs[half:])
            yield from zip(some, [run(*job) for job in jobs[:half]] + others.result(), strict=True)
