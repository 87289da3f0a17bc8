"""How far models that did alike are apart on other commands: what the record does not show.

Parts of a record that are held out are of the same movement as the rest of it. Of five steps, each of which came to
rest before the next, a network may meet every part and be far off where a step follows sooner. Nobody knows what the
plant would do there, but models from other parts, starts and structures, all of which meet the record, say how well it
is known: where they differ, most of them are wrong (query by committee: Seung, Opper and Sompolinsky 1992; ambiguity of
an ensemble: Krogh and Vedelsby 1995). The middle of them is the best guess there is, and who stands alone is not
chosen.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
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
from sysid.workbench.runner.store import digest

AS_GOOD = 1.5
"""Times the least error up to which a trial's models are looked at: to be in the middle is no merit of one that meets
the record worse."""
ALONE = 1.5
"""Times the distance of all from their middle beyond which a trial's models stand alone. Nearer ones are not told from
each other: to count every distance like an error chose no better on ten records (``auto_beyond``)."""
TOLD, LOTTERY = 2.0, 1.0
"""Times the error of the chosen model from which on that is told, and from which on the start that is fitted in the end
matters more than its structure."""
FEWEST = 4
"""Models that have a middle: those of one trial, from each of the parts. A short search may have no more."""
MOST_TRIALS, COMMANDS = 8, 20
"""Trials that are looked at, and commands over which their models run."""
MOST_BYTES = 64_000_000
"""Of all runs together; where they would take more, there are fewer commands."""
BEGINNING = 0.1
"""Part of a run that does not count: where it began is given by nothing but the first output."""
FAR = 10.0
"""Ranges of an output beyond which a run that leaves it is no further away."""

Models = Sequence[AbstractModel]
"""Of one fit: one a model of all outputs, or one an output."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Middle:
    """The middle of models that did alike, on other commands.

    Args:
        asked: The commands, by the mapping of the model that is run over them.
        outputs: Names of all outputs.
        runs: The median of all runs, shape ``(n_samples, n_outputs)``.
        sizes: What the square of an error of each output counts over, shape ``(n_outputs,)``.
        spreads: How far the models are from it, output by output: medians of mean squares, shape ``(n_outputs,)``.
    """

    asked: Callable[[ChannelMapping], _Asked]
    outputs: tuple[str, ...]
    runs: NDArray[np.float64]
    sizes: NDArray[np.float64]
    spreads: NDArray[np.float64]

    @property
    def digest(self) -> str:
        """Of all that a verdict by it depends on."""
        values = (self.runs, self.sizes, self.spreads)
        return digest([self.outputs, *(hashlib.sha256(one.tobytes()).hexdigest() for one in values)])

    def away(self, models: Models) -> float:
        """How far models of some or all outputs are from it.

        Args:
            models: One of several outputs, or one an output.

        Returns:
            A mean square, as errors count.
        """
        return float(np.mean(self.off(np.hstack([self.asked(one.mapping).run(one) for one in models]), models)))

    def usual(self, models: Models) -> float:
        """How far all are from it, over the outputs of some.

        Args:
            models: As for :meth:`away`.

        Returns:
            Likewise.
        """
        return float(np.mean(self.spreads[self._places(models)]))

    def off(self, runs: NDArray[np.float64], models: Models) -> NDArray[np.float64]:
        """Mean squares of runs from it, output by output; what rounding leaves of exact models is none.

        Args:
            runs: Over all commands, shape ``(n_samples, n_outputs)``.
            models: Whose.

        Returns:
            Shape ``(n_outputs,)``.
        """
        some = self._places(models)
        off = np.mean((runs - self.runs[:, some]) ** 2, axis=0) / self.sizes[some]
        spans = np.concatenate([self.asked(one.mapping).span for one in models])
        off[off <= EXACT**2 * spans**2 / self.sizes[some]] = 0.0
        return np.asarray(off)

    def _places(self, models: Models) -> list[int]:
        return [self.outputs.index(name) for one in models for name in one.mapping.outputs]


@dataclass(frozen=True, kw_only=True)
class Beyond:
    """How far models are apart on other commands; nothing where there were too few to tell.

    Args:
        models: How many had a say in where the middle is.
        spread: How far they are from it: median of the mean squares, as errors count.
        apart: The same of the models of each trial that was looked at, by its number.
        middle: What they are compared with.
    """

    models: int = 0
    spread: float = 0.0
    apart: Mapping[int, float] = field(default_factory=dict)
    middle: Middle | None = None

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

    @property
    def digest(self) -> str:
        """Of all that :meth:`alone` depends on, beside the model and the error."""
        return "" if self.middle is None else self.middle.digest

    def alone(self, model: AbstractModel, error: float) -> bool:
        """Whether a model is further from the middle than the others are, and than the error lets expect.

        Args:
            model: Of all outputs, or of one.
            error: Of what was chosen, on what chose: nearer models are not told from each other.

        Returns:
            Whether it is; never where there is no middle.
        """
        middle = self.middle
        return middle is not None and middle.away([model]) > ALONE**2 * max(middle.usual([model]), error)

    def tells(self, error: float) -> bool:
        """Whether they are further apart than the error of the one that was chosen lets expect.

        Args:
            error: Its error on what chose, a mean square.

        Returns:
            Whether they are.
        """
        return self.spread > TOLD**2 * error

    def is_lottery(self, error: float) -> bool:
        """Whether they are so far apart that one start of the chosen structure would say little.

        Args:
            error: As for :meth:`tells`.

        Returns:
            Whether they are.
        """
        return self.spread > LOTTERY**2 * error

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
        apart = f"{self.models} models that did alike are {shown(math.sqrt(self.spread))} (root mean square, median)"
        return _not_shown(f"{apart} from the middle of them", self.spread, error)

    def sentence_of(self, model: AbstractModel, error: float, shown: Callable[[float], str]) -> str:
        """The same of the model that was fitted in the end, where it stands alone though all are near each other.

        Args:
            model: As for :meth:`alone`.
            error: As for :meth:`tells`.
            shown: As for :meth:`sentence`.

        Returns:
            The sentence; empty where it does not.
        """
        if self.middle is None or self.tells(error) or not self.alone(model, error):
            return self.sentence(error, shown)
        own, usual = (math.sqrt(one([model])) for one in (self.middle.away, self.middle.usual))
        all_of_them = f"the middle of {self.models} models that did alike, which are {shown(usual)} from it (median)"
        return _not_shown(f"this one is {shown(own)} (root mean square) from {all_of_them}", own**2, error)


def _not_shown(what: str, apart: float, error: float) -> str:
    own = math.sqrt(error)
    times = f"{math.sqrt(apart) / own:.2g} times its error on what chose" if own else "where what chose shows no error"
    return (
        f"Not shown by the record: on other commands, made of pieces of its own inputs in other order, {what}, "
        f"{times}. "
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
    outputs = tuple(name for model in found[0][1] for name in model.mapping.outputs)
    middle = Middle(
        asked=asked, outputs=outputs, runs=np.median(runs, axis=0), sizes=np.asarray(sizes, dtype=np.float64),
        spreads=np.zeros(len(outputs)),
    )  # fmt: skip
    off = np.array([middle.off(one, models) for one, (_, models) in zip(runs, found, strict=True)])
    away, own = off.mean(axis=1), dict[int, list[float]]()
    for (trial, _), one in zip(found, away.tolist(), strict=True):
        own.setdefault(trial.number, []).append(one)
    apart = {number: median(some) for number, some in own.items()}
    middle = replace(middle, spreads=np.median(off, axis=0))
    return Beyond(models=len(found), spread=float(np.median(away)), apart=apart, middle=middle)


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
