"""How far models that did alike are apart on other commands: what the record does not show.

Parts of a record that are held out are of the same movement as the rest of it. Of five steps, each of which came to
rest before the next, a network may meet every part and be far off where a step follows sooner. Nobody knows what the
plant would do there, but models from other parts, starts and structures, all of which meet the record, say how well it
is known: where they differ, most of them are wrong (query by committee: Seung, Opper and Sompolinsky 1992; ambiguity of
an ensemble: Krogh and Vedelsby 1995). The middle of them is the best guess there is, and who stands alone is not
chosen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from statistics import median

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.stability.excursions import usable_parts
from sysid.estimation.stability.free_run import free_runs
from sysid.estimation.stability.other_commands import LONGEST, OtherCommands
from sysid.estimation.stability.sequences import InputSequence
from sysid.models import AbstractModel
from sysid.models import Mapping as ChannelMapping
from sysid.reporting.sweep_record import Trial
from sysid.traces import Trace
from sysid.workbench.auto.words import EXACT

AS_GOOD = 1.5
"""Times the least error up to which a trial's models are looked at: to be in the middle is no merit of one that meets
the record worse."""
ALONE = 1.5
"""Times the distance of all from their middle beyond which a trial's models stand alone. Nearer ones are not told from
each other: to count every distance like an error chose no better on ten records (``auto_beyond``)."""
TOLD = 2.0
"""Times the error of the chosen model from which on that is told."""
FEWEST = 6
"""Models that have a middle."""
MOST_TRIALS, COMMANDS = 8, 20
"""Trials that are looked at, and commands over which their models run."""
MOST_BYTES = 64_000_000
"""Of all runs together; where they would take more, there are fewer commands."""
BEGINNING = 0.1
"""Part of a run that does not count: where it began is given by nothing but the first output."""
FAR = 10.0
"""Ranges of an output beyond which a run that leaves it is no further away."""

Models = list[AbstractModel]
"""Of one fit: one a model of all outputs, or one an output."""


@dataclass(frozen=True, kw_only=True)
class Beyond:
    """How far models are apart on other commands; nothing where there were too few to tell.

    Args:
        models: How many had a say in where the middle is.
        spread: How far they are from it: median of the mean squares, as errors count.
        apart: The same of the models of each trial that was looked at, by its number.
    """

    models: int = 0
    spread: float = 0.0
    apart: Mapping[int, float] = field(default_factory=dict)

    def of(self, trial: Trial) -> float:
        """What is to be added to a trial's error.

        Args:
            trial: The trial.

        Returns:
            A mean square: how far from the middle its models are where they stand alone, and 0 elsewhere.
        """
        own = self.away(trial)
        return own if own > ALONE**2 * self.spread else 0.0

    def away(self, trial: Trial) -> float:
        """How far a trial's models are from the middle of all.

        Args:
            trial: The trial.

        Returns:
            A mean square; 0 of one that was not looked at.
        """
        return self.apart.get(trial.number, 0.0)

    def tells(self, error: float) -> bool:
        """Whether they are further apart than the error of the one that was chosen lets expect.

        Args:
            error: Its error on what chose, a mean square.

        Returns:
            Whether they are.
        """
        return self.spread > TOLD**2 * error

    def sentence(self, error: float, shown: Callable[[float], str]) -> str:
        """That they are, for people; empty where they are not.

        Args:
            error: As for :meth:`tells`.
            shown: Writes a root of a mean square with its unit.

        Returns:
            What it means, and what would help.
        """
        if not self.tells(error):
            return ""
        apart, own = math.sqrt(self.spread), math.sqrt(error)
        times = f"{apart / own:.2g} times its error on what chose" if own else "where what chose shows no error"
        return (
            "Not shown by the record: on other commands, made of pieces of its own inputs in other order, "
            f"{self.models} models that did alike are {shown(apart)} (root mean square, median) from the middle of "
            f"them, {times}. "
            "An error may be as large wherever inputs follow each other in other ways than here. "
            "Record more of these: levels and holding times at random, some shorter than the output takes to settle."
        )


def look_beyond(
    trials: Sequence[Trial],
    error: Callable[[Trial], float],
    fitted: Callable[[Trial], Sequence[Models]],
    traces: Sequence[Trace],
    sizes: Sequence[float],
    *,
    seed: int,
) -> Beyond:
    """Run what was fitted over other commands.

    Args:
        trials: What may be chosen.
        error: Of a trial, a mean square; infinite for what cannot be used.
        fitted: What a trial was fitted to: part by part, and from each start.
        traces: The estimation traces.
        sizes: What the square of an error of each output counts over.
        seed: Of the commands.

    Returns:
        How far they are apart.
    """
    least = min(map(error, trials), default=np.inf)
    near = sorted((t for t in trials if error(t) <= AS_GOOD**2 * least), key=error)[:MOST_TRIALS]
    found = [(trial, models) for trial in near for models in fitted(trial)]
    if not np.isfinite(least) or len(found) < FEWEST or not any(usable_parts(trace, ()) for trace in traces):
        return Beyond()
    count = max(2, min(COMMANDS, MOST_BYTES // (8 * LONGEST * len(sizes) * len(found))))
    asked = cache(lambda mapping: _Asked.of(mapping, traces, count, seed))
    runs = np.stack([np.hstack([asked(model.mapping).run(model) for model in models]) for _, models in found])
    away = np.mean((runs - np.median(runs, axis=0)) ** 2 / np.asarray(sizes), axis=(1, 2))
    spans = np.concatenate([asked(model.mapping).span for model in found[0][1]])
    away[away <= EXACT**2 * np.mean(spans**2 / np.asarray(sizes))] = 0.0  # what rounding leaves of exact models
    own = dict[int, list[float]]()
    for (trial, _), one in zip(found, away.tolist(), strict=True):
        own.setdefault(trial.number, []).append(one)
    apart = {number: median(some) for number, some in own.items()}
    return Beyond(models=len(found), spread=float(np.median(away)), apart=apart)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Asked:
    """Other commands for models of one mapping, drawn once.

    Args:
        commands: They.
        low: Least value of each output in the records, shape ``(n_outputs,)``.
        span: Their ranges.
    """

    commands: list[InputSequence]
    low: NDArray[np.float64]
    span: NDArray[np.float64]

    @classmethod
    def of(cls, mapping: ChannelMapping, traces: Sequence[Trace], count: int, seed: int) -> _Asked:
        source = OtherCommands.of(traces, mapping.inputs, mapping.outputs)
        low, high = source.output_range
        return cls(commands=list(source.draw(count, seed)), low=low, span=high - low)

    def run(self, model: AbstractModel) -> NDArray[np.float64]:
        """The runs over all commands, one after the other: shape ``(n_samples, n_outputs)``."""
        least, most = self.low - FAR * self.span, self.low + (1.0 + FAR) * self.span
        runs = [
            run.reshape(len(command.inputs), -1)[int(BEGINNING * len(run)) :]
            for command, run in free_runs(model, self.commands)
        ]
        lost = np.nan_to_num(np.concatenate(runs), nan=np.inf, posinf=np.inf, neginf=-np.inf)
        return np.asarray(np.clip(lost, least, most))
