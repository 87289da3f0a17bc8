"""How the points of a sweep are gone through; the only file that imports Optuna.

The driver alone asks and tells. That is what keeps Optuna's traps shut: samplers with a seed of their own in every
worker draw the same points or miss some; a trial whose worker is killed stays ``RUNNING`` for ever; samplers of small
grids ask for points twice; a study of several objectives cannot prune. Here trials live in the sweep's own folder, a
grid is enumerated, a point that is asked for again is answered from what is known, and only finished trials are ever
written into a study that others can read.
"""

from __future__ import annotations

import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from sysid.errors import ConfigError
from sysid.extras import need
from sysid.reporting.sweep_record import FIGURES, SweepRecord, Trial
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.search_space import Point, Space

need("optuna", "a sweep")

import optuna  # noqa: E402 - after it was looked for
from optuna.distributions import (  # noqa: E402 - as above
    BaseDistribution,
    CategoricalDistribution,
    FloatDistribution,
    IntDistribution,
)
from optuna.trial import TrialState, create_trial  # noqa: E402 - as above

KEY = "sysid.key"
"""Attribute of an Optuna trial that holds the trial's digest."""

MAX_REPEATS = 40
"""Times that a sampler may ask for known points in a row before it is given a new one: on a small grid it converges."""

optuna.logging.set_verbosity(optuna.logging.WARNING)


class AbstractStrategy(ABC):
    """Asks for points in batches; the next batch knows the results of all before it."""

    @abstractmethod
    def ask(self) -> list[Point]:
        """The next points, none of which was asked for before; empty when there are no more."""

    @abstractmethod
    def tell(self, trials: Sequence[Trial]) -> None:
        """The results of the last batch, in its order."""


class Listed(AbstractStrategy):
    """Points that are known from the beginning: one batch.

    Args:
        points: The points.
    """

    def __init__(self, points: Sequence[Point]) -> None:
        self._points = list(points)

    def ask(self) -> list[Point]:
        """All of them, once."""
        points, self._points = self._points, []
        return points

    def tell(self, trials: Sequence[Trial]) -> None:
        """Nothing follows from them."""


class Sampled(AbstractStrategy):
    """Points that an Optuna sampler asks for, knowing the results so far.

    Args:
        space: What can be tried.
        config: The sweep.
    """

    def __init__(self, space: Space, config: SweepConfig) -> None:
        self._space, self._config = space, config
        self._names = config.objectives if config.method.name == "nsga-ii" else (config.choose.by,)
        self._study = optuna.create_study(directions=["minimize"] * len(self._names), sampler=_sampler(config))
        self._left = config.method.trials or 0
        self._points = {_place(point): point for point in space.points()}
        self._order = np.random.default_rng(config.seed).permutation(len(self._points))
        self._values: dict[int, list[float] | None] = {}
        self._open: list[tuple[optuna.trial.Trial, Point]] = []

    def ask(self) -> list[Point]:
        """The next batch."""
        n = min(self._left, self._config.method.batch, len(self._points) - len(self._values))
        taken = set(self._values)
        for _ in range(n):
            trial, point = self._new(taken)
            taken.add(point.number)
            self._open.append((trial, point))
        self._left -= n
        return [point for _, point in self._open]

    def tell(self, trials: Sequence[Trial]) -> None:
        """Pass the figures on."""
        for (asked, point), trial in zip(self._open, trials, strict=True):
            values = [FIGURES[name].of(trial, self._config.choose.on) for name in self._names]
            usable = trial.usable and all(math.isfinite(value) for value in values)
            self._values[point.number] = values if usable else None
            self._answer(asked, point)
        self._open = []

    def _new(self, taken: set[int]) -> tuple[optuna.trial.Trial, Point]:
        """A trial at a point that is not taken; a known point is answered at once, so that the sampler moves on."""
        for _ in range(MAX_REPEATS):
            trial = self._study.ask()
            point = self._suggested(trial)
            if point is not None and point.number not in taken:
                return trial, point
            self._answer(trial, point)
        points = list(self._points.values())
        point = next(points[i] for i in self._order if points[i].number not in taken)
        index, values = _place(point)
        self._study.enqueue_trial(dict(_parameters(self._space, index, dict(values))))
        trial = self._study.ask()
        self._suggested(trial)
        return trial, point

    def _answer(self, trial: optuna.trial.Trial, point: Point | None) -> None:
        values = None if point is None else self._values.get(point.number)
        if values is None:
            # No such structure, one that cannot be used, or one that is being tried in this very batch.
            self._study.tell(trial, state=TrialState.FAIL)
        else:
            self._study.tell(trial, values)

    def _suggested(self, trial: optuna.trial.Trial) -> Point | None:
        alternatives = self._space.alternatives
        index = trial.suggest_int("structure", 0, len(alternatives) - 1) if len(alternatives) > 1 else 0
        values = []
        for dimension in alternatives[index].dimensions:
            name = f"{index}.{dimension.name}"
            place = _suggest(trial, name, len(dimension.values), numeric=dimension.numeric)
            values.append((dimension.name, repr(dimension.values[place])))
        return self._points.get((index, tuple(values)))


def strategy(config: SweepConfig, space: Space) -> AbstractStrategy:
    """How a sweep goes through its points.

    Args:
        config: The sweep.
        space: What it can try.

    Returns:
        The strategy.

    Raises:
        ConfigError: If more different points are asked for than there are.
    """
    points, trials = space.points(), config.method.trials
    if trials is not None and trials > len(points):
        raise ConfigError(
            f"the sweep asks for more trials than there are different points, {len(points)}",
            where="method.trials",
            expected=f"up to {len(points)}",
            got=trials,
            remedy="ask for fewer, or take method: grid, which tries every point once",
        )
    if config.method.name == "grid":
        return Listed(points)
    if config.method.name == "random":
        chosen = np.random.default_rng(config.seed).permutation(len(points))[:trials]
        return Listed([points[i] for i in sorted(chosen)])
    return Sampled(space, config)


def publish(record: SweepRecord, url: str) -> int:
    """Write a sweep's trials into an Optuna study, for its dashboard and for other tools.

    Args:
        record: What the sweep found.
        url: The database, such as ``postgresql+psycopg://user@host/optuna`` or ``sqlite:///optuna.db``.

    Returns:
        Number of trials that were added; those that are there already are not added again.
    """
    with _quiet(), _database(url) as storage:
        study = optuna.create_study(
            study_name=record.name,
            storage=storage,
            load_if_exists=True,
            directions=["minimize"] * len(record.objectives),
        )
        study.set_metric_names(record.objectives)
        known = {trial.user_attrs.get(KEY) for trial in study.get_trials(deepcopy=False)}
        added = [_finished(trial, record) for trial in record.trials if trial.key not in known]
        study.add_trials(added)
    return len(added)


@contextmanager
def _database(url: str) -> Iterator[optuna.storages.RDBStorage]:
    """A database of studies, whose connections are closed when we are done with it."""
    storage = optuna.storages.RDBStorage(url)
    try:
        yield storage
    finally:
        storage.remove_session()
        storage.engine.dispose()


def _finished(trial: Trial, record: SweepRecord) -> optuna.trial.FrozenTrial:
    """A trial as Optuna keeps it, finished: never one that runs, which a killed sweep would leave behind."""
    values = [record.figure(trial, name) for name in record.objectives]
    good = trial.in_full and all(math.isfinite(value) for value in values)
    params = {name: _plain(value) for name, value in trial.values.items()}
    distributions = {name: _distribution([*record.ranges.get(name, []), trial.values[name]]) for name in params}
    attributes = {KEY: trial.key, "label": trial.label, "status": trial.status}
    return create_trial(
        state=TrialState.COMPLETE if good else TrialState.FAIL,
        values=values if good else None,
        params=params,
        distributions=distributions,
        user_attrs=attributes,
    )


def _distribution(values: Sequence[Any]) -> BaseDistribution:
    """How Optuna describes a range; it takes one description of a field in all trials of a study."""
    plain = list(dict.fromkeys(_plain(value) for value in values))
    if all(isinstance(value, int) and not isinstance(value, bool) for value in plain):
        return IntDistribution(min(plain), max(plain))
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in plain):
        return FloatDistribution(min(plain), max(plain))
    return CategoricalDistribution(plain)


def _plain(value: Any) -> Any:
    return value if isinstance(value, bool | int | float | str | None) else repr(value)


def _sampler(config: SweepConfig) -> optuna.samplers.BaseSampler:
    with _quiet():
        if config.method.name == "nsga-ii":
            return optuna.samplers.NSGAIISampler(seed=config.seed, population_size=config.method.batch)
        # A batch is asked for before any of it is answered: the liar keeps its points apart.
        return optuna.samplers.TPESampler(seed=config.seed, constant_liar=True)


@contextmanager
def _quiet() -> Iterator[None]:
    """What Optuna calls experimental is not the user's business."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        yield


def _suggest(trial: optuna.trial.Trial, name: str, n: int, *, numeric: bool) -> int:
    """The place of a value among the values of a dimension."""
    if numeric:
        return trial.suggest_int(name, 0, n - 1)
    return int(trial.suggest_categorical(name, list(range(n))))


def _place(point: Point) -> tuple[int, tuple[tuple[str, str], ...]]:
    """Where a point lies: the alternative, and the value of each dimension in order."""
    return point.alternative, tuple((name, repr(value)) for name, value in point.values.items())


def _parameters(space: Space, index: int, values: Mapping[str, str]) -> dict[str, int]:
    """A place as the parameters of an Optuna trial."""
    found = {"structure": index} if len(space.alternatives) > 1 else {}
    for dimension in space.alternatives[index].dimensions:
        texts = [repr(value) for value in dimension.values]
        found[f"{index}.{dimension.name}"] = texts.index(values[dimension.name])
    return found
