"""How a network is trained, and what is seen of it while it is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sysid.errors import ConfigError
from sysid.estimation.least_squares.damping import DAMPINGS
from sysid.estimation.results.result import Loop
from sysid.models.orders.typed_fields import TypedFields

CHOICES = {
    "choose_by": ("selection", "evidence"),
    "damping": tuple(DAMPINGS),
    "basis": ("incremental", "plain"),
    "shooting": ("auto", "single", "multiple", "growing"),
}
"""Options that are words, and what they may be; the first is a good example."""


LEAST_WINDOW = 10
"""Samples of a window at least."""


def check_choice(name: str, value: object, choices: Sequence[str]) -> None:
    """Refuse a word that is none of some.

    Args:
        name: Of the option.
        value: What it is.
        choices: What it may be; the first is a good example.

    Raises:
        ConfigError: If it is none of them.
    """
    if value not in choices:
        raise ConfigError(
            f"unknown value of {name}",
            where=name,
            expected=" or ".join(choices),
            got=repr(value),
            remedy=f"write for example {name}: {choices[0]}",
        )


def _check_listed(value: object, kind: Any, name: str, example: str) -> None:
    if not isinstance(value, list | tuple) or not all(isinstance(one, kind) for one in value):
        raise ConfigError(
            f"not a list of {name}",
            where=name,
            expected=f"a list as {example}",
            got=repr(value),
            remedy=f"write for example {name}={example}",
        )


@dataclass(frozen=True, kw_only=True)
class Training(TypedFields):
    """How a network is trained.

    Args:
        loop: ``closed`` minimises the error of the free run, ``open`` that of the one-step prediction.
        max_iterations: Levenberg-Marquardt iterations of a start that is never dropped.
        max_time_s: Wall time of the whole fit in seconds, shared out among the starts. A fit that it ends cannot be
            repeated exactly; leave it out where that matters. The check of its free run comes after it, and takes up to
            a minute more (``StabilityOptions``).
        tolerance: Relative improvement over ``patience`` iterations below which a start has converged.
        patience: Iterations over which improvement is judged.
        starts: Starts; successive halving: half of them dropped at each of four checkpoints. By default as many as the
            structure needs: one for lagged regressors, several for hidden states, half as many again as an ensemble has
            members. Three or more of a NARX on a short record without selection traces all come to their end.
        seed: Seed of the first start; the others count up from it.
        choose_by: What chooses in the end: ``selection`` (least error on traces that are used for nothing else; where
            there are none the evidence, or of the NARX above who stands in the middle of all, ``middle.py``) or
            ``evidence``.
        within: Share of each output's range over the selection traces that the root mean square of its error may come
            to: who stays within it on more of these traces comes before who has the least mean, which hides one that
            fails. By default the mean alone chooses.
        workers: Starts that run at the same time.
        basis: ``incremental`` (the delta form) trains on each channel's newest sample and its rates of change,
            ``plain`` on the lagged samples as they are. The finished model is over lagged samples either way.
        offsets: Constant offsets, by channel and in its unit, with each of which the estimation traces are used once
            more; the output among them where it moves with the inputs, as reservoirs that feed each other do. A record
            says little about what its absolute levels do and what their changes do when the two always go together;
            copies that differ in level alone tell the network which to follow, and how far a sensor may be off.
        regularisation: ``None`` lets the evidence weigh the weights' sizes against the residuals, group by group. A
            number is that weight, the same for all and never changed: 0 is plain Levenberg-Marquardt (``trainlm``).
        damping: How far a step may go: ``marquardt`` by the curvature of each parameter, ``levenberg`` the same for
            all, as ``trainlm`` and ``trainbr``.
        pretraining: Samples on which a random start is trained one step ahead before the free run
            (``pretraining.py``): cheap iterations that find what switches where. 0 for none.
        pretraining_iterations: Iterations of the pretraining.
        stride: Every so-manieth sample counts in the loss. Residuals of a free run are correlated over tens of samples:
            a few of them say nearly as much as all, and the price of the normal equations falls with them.
        window: Samples of a window of a long record: starts are raced on eight windows, and what is chosen is trained
            on over all samples (``windows.py``). By default 5,000 where the records have more than 200,000 samples
            together; 0 for never.
        thin: Starts of a neural state space are raced on every so-manieth sample of low-passed records, and what is
            chosen is trained on over all of them (``thinned.py``). By default as the band of the inputs allows where
            the records have more than 20,000 samples together; 1 for never.
        stable: Whether the linear part of a neural state space has to die away without its neurons: where these are
            bounded nothing runs away then, whatever drives it. By default where starts are raced on thinned records,
            as of structures that swing; elsewhere the check of the free run tells (``StabilityOptions``).
        ensemble: So many starts at most as one model; 1 for none. Of a NARX its map one step ahead is the mean of
            theirs (``ensemble.py``), and each adds its neurons; of hidden states its free run is
            (``neural/ensemble.py``), and each adds its states. Selection traces elect the members, of a NARX also the
            same start at an earlier look, or twice; without them the best starts count alike, less those that stand
            alone (``starts/united.py``).
        input_subsets: Sets of inputs, such as ``[[ER]]``: the starts are shared out between networks over all inputs
            and networks that do without each of the sets (``input_subsets.py``), for an ensemble whose members differ
            in what they rely on. All see everything by default.
        shooting: How starts of a grey box begin: ``single`` by the free run of whole records, ``multiple`` by that of
            short windows which are drawn together (``shooting.py``), which finds the minimum from parameters that are
            further off. ``auto`` looks at the declared start by single shooting first, begins no other where it comes
            down to the noise, and takes it by multiple shooting next. ``growing`` runs a growing part of each record:
            what sticks and slips, or swings by itself, counts its cycles wrongly over all at once.
    """

    loop: Loop = Loop.CLOSED
    max_iterations: int = 500
    max_time_s: float = float("inf")
    tolerance: float = 1e-3
    patience: int = 50
    starts: int | None = None
    seed: int = 0
    choose_by: str = "selection"
    within: float | None = None
    workers: int = 2
    basis: str = "incremental"
    offsets: tuple[Mapping[str, float], ...] = ()
    regularisation: float | None = None
    damping: str = "marquardt"
    pretraining: int = 0
    pretraining_iterations: int = 300
    stride: int = 1
    window: int | None = None
    thin: int | None = None
    stable: bool | None = None
    ensemble: int = 1
    input_subsets: tuple[tuple[str, ...], ...] = ()
    shooting: str = "auto"

    def __post_init__(self) -> None:
        check_choice("loop", getattr(self.loop, "value", self.loop), tuple(one.value for one in Loop))
        object.__setattr__(self, "loop", Loop(self.loop))
        _check_listed(self.offsets, dict, "offsets", '[{"u": 0.1}]')
        _check_listed(self.input_subsets, list | tuple, "input_subsets", '[["u1"]]')
        object.__setattr__(self, "offsets", tuple(dict(offset) for offset in self.offsets))
        object.__setattr__(self, "input_subsets", tuple(tuple(names) for names in self.input_subsets))
        for name, choices in CHOICES.items():
            check_choice(name, getattr(self, name), choices)
        for name in (
            "max_iterations",
            "patience",
            "starts",
            "workers",
            "pretraining_iterations",
            "stride",
            "thin",
            "ensemble",
        ):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise ConfigError(f"{name} is too small", where=name, expected="1 or more", got=value)
        if self.input_subsets and self.n_starts <= len(self.input_subsets):
            raise ConfigError(
                "not every set of inputs has a start",
                where="input_subsets",
                expected=f"{1 + len(self.input_subsets)} starts or more",
                got=f"{self.n_starts} starts",
                remedy="raise starts, or leave out fewer sets",
            )
        if self.pretraining < 0:
            raise ConfigError(
                "pretraining is too small", where="pretraining", expected="0 or more", got=self.pretraining
            )
        if self.within is not None and not 0.0 < self.within < 1.0:
            raise ConfigError("not a share", where="within", expected="between 0 and 1, or nothing", got=self.within)
        if self.window is not None and 0 != self.window < LEAST_WINDOW:
            raise ConfigError(
                "window is too small",
                where="window",
                expected=f"{LEAST_WINDOW} samples or more, or 0 for whole records",
                got=self.window,
                remedy="make it longer than what the system remembers",
            )
        if self.regularisation is not None and not 0.0 <= self.regularisation < float("inf"):
            raise ConfigError(
                "not a regularisation",
                where="regularisation",
                expected="a number from 0 on, or nothing for the evidence's",
                got=self.regularisation,
            )

    @property
    def n_starts(self) -> int:
        """Starts that are asked for; one where none are."""
        return self.starts or 1

    def with_starts(self, n: int) -> Training:
        """The same training, with so many starts where none are asked for, and some to spare for an ensemble.

        Args:
            n: Starts that the structure needs.

        Returns:
            The training.
        """
        spare = math.ceil(SPARE * self.ensemble) if self.ensemble > 1 else 0
        return self if self.starts is not None else replace(self, starts=max(n, spare))


@dataclass(frozen=True, kw_only=True)
class FitProgress:
    """What a progress bar shows.

    Args:
        stage: What is being minimised, in words.
        start: Which start, from 1 on.
        starts: How many there are.
        iteration: Iterations of this start done.
        max_iterations: At most so many.
        mse: Mean squared error on the estimation traces, in the output's unit squared.
        elapsed_s: Seconds that this start has taken.
        fraction: Share of the fit's expected work that is done, 0 to 1; starts that converge early make it run ahead.
    """

    stage: str
    start: int
    starts: int
    iteration: int
    max_iterations: int
    mse: float
    elapsed_s: float
    fraction: float


SPARE = 1.5
"""Starts of a fit that asks for none, for each member of an ensemble: not all will be among them."""
LAGGED_ONLY = ("basis", "offsets", "pretraining", "stride", "ensemble", "input_subsets")
"""Options of a training that concern lagged regressors."""


def _check_shooting(name: str, training: Training) -> None:
    """Refuse what is for grey boxes alone: how to shoot."""
    if training.shooting != Training().shooting:
        raise ConfigError(
            f"{name} has no equations to shoot with",
            where="shooting",
            expected="a grey box",
            got=training.shooting,
            remedy="leave shooting out: it is for parameters of equations that start far off",
        )


def check_lagged(name: str, training: Training) -> None:
    """Refuse what does not apply to a network of lagged regressors.

    Args:
        name: What is trained, with an article.
        training: How to train.

    Raises:
        ConfigError: If it says how to shoot, or asks for an ensemble of a single start.
    """
    _check_shooting(name, training)
    if training.ensemble > 1 and training.starts == 1:
        raise ConfigError(
            "an ensemble of a single start is that start", where="ensemble", expected="starts of 2 or more beside it",
            got=f"ensemble {training.ensemble} of {training.n_starts} start",
            remedy=f"write starts: {2 * training.ensemble}, or leave ensemble out",
        )  # fmt: skip


def check_members(training: Training) -> None:
    """Refuse an ensemble of more members than there are starts, where each start is one member at most.

    Args:
        training: How to train.

    Raises:
        ConfigError: If it asks for one.
    """
    if training.starts is not None and training.starts < training.ensemble:
        raise ConfigError(
            "an ensemble has more members than there are starts",
            where="ensemble",
            expected=f"at most starts: {training.starts}",
            got=training.ensemble,
            remedy="raise starts, or leave it out for as many as are needed",
        )


def check_hidden_states(name: str, training: Training, *, unites: bool = False, shoots: bool = False) -> None:
    """Refuse what does not apply to hidden states.

    Args:
        name: What is trained, with an article.
        training: How to train.
        unites: Whether its starts can be united.
        shoots: Whether its starts can begin by multiple shooting.

    Raises:
        ConfigError: If it is for one step ahead, or has options that are for lagged regressors alone.
    """
    if training.loop is not Loop.CLOSED:
        raise ConfigError(
            f"{name} has no open loop",
            where="loop",
            expected="closed",
            got=training.loop.value,
            remedy="leave loop out: its states are hidden, and only the free run can be compared with a measurement",
        )
    if not shoots:
        _check_shooting(name, training)
    strange = [option for option in LAGGED_ONLY if not (unites and option == "ensemble")]
    strangers = [option for option in strange if getattr(training, option) != getattr(Training(), option)]
    if strangers:
        raise ConfigError(
            f"{name} is not trained with {', '.join(strangers)}",
            where="training",
            expected="options that do not concern lagged regressors",
            remedy=f"leave out {', '.join(strangers)}",
        )
