"""Which orders a measured frequency response asks for: by its errors at frequencies that were left out of the fits.

Errors at all frequencies fall with every pole. So each fifth frequency in turn is left out, and the others are fitted
from the poles of the fit to all. Noise need not be alike at all frequencies, and in a criterion such as BIC the few at
which it is largest would speak for all: of what is left out they cost more where they are fitted as well. BIC's price
of a parameter comes on top, in the noise that the errors of the best fit show.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sysid.api.measured_responses.left_out import left_out_errors
from sysid.api.measured_responses.problem import POINTS_A_PERIOD, ResponseProblem
from sysid.api.measured_responses.response_fit import ResponseFit, response_fit
from sysid.errors import ConfigError, UserError
from sysid.estimation import TransferFunctionTraining
from sysid.models import Domain, TransferFunction, TransferFunctionModel

if TYPE_CHECKING:
    import pandas as pd

PATIENCE = 2
"""Orders that are tried beyond the best: a mode more brings two poles."""
FEWEST, MOST = 1, 6
"""Numbers of poles that are tried by default."""
SHARE = 0.5
"""Parameters a real number that is fitted, of which no more are tried."""
ALIKE = 1e-3
"""Part of the response that no error below it says anything of: no analyser is better, and files are rounded."""
MENTION = 2.0
"""Difference of two scores, as of BIC, that is worth no more than a bare mention (Kass and Raftery 1995)."""
FIRST = 2
"""Numbers of poles whose dead times are searched as far as they may reach; what more poles find is no longer."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Tried:
    """A structure that was fitted.

    Args:
        poles: How many.
        zeros: How many.
        fit: The fit to all frequencies.
        left_out: Weighted squared error of each point in fits without it, shape ``(n_points,)``.
        begun: Whether it was fitted from the poles and with the dead time of another alone.
    """

    poles: int
    zeros: int
    fit: ResponseFit
    left_out: NDArray[np.float64]
    begun: bool = False

    @property
    def model(self) -> TransferFunctionModel:
        """The fitted model."""
        model = self.fit.model
        assert isinstance(model, TransferFunctionModel)  # noqa: S101 - no other is fitted to a response
        return model

    @property
    def dead_time(self) -> float:
        """In seconds."""
        return float(self.model.delays[0] * self.model.sample_time)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ResponseOrderSearch:
    """What structures of rising order come to.

    Args:
        tried: Those that were fitted, in the order in which they were.
        power: Weighted square of each point of the response, shape ``(n_points,)``.
        poles: The least and the largest number that was allowed.
        delays: The dead time that was asked for, in samples.
        failed: Which could not be fitted, and why.
    """

    tried: tuple[Tried, ...]
    power: NDArray[np.float64]
    poles: tuple[int, int]
    delays: tuple[int, ...] | None = None
    failed: tuple[str, ...] = ()

    @property
    def noise(self) -> float:
        """Variance of a real number's weighted error, of those by which parameters are known.

        Of errors alike at all points it is their variance; else that of the larger ones, which pull at parameters.
        """
        best = min((one.left_out for one in self.tried), key=np.sum)
        least = float(np.mean(self.power)) * ALIKE**2 / 2.0
        return max(float(np.sum(best**2) / max(np.sum(best), 1e-300) / 4.0), least)

    def score(self, one: Tried) -> float:
        """What is left of the frequencies that were left out, and the price of the parameters; smaller is better.

        Args:
            one: Of those tried.

        Returns:
            In variances of the noise.
        """
        count = one.poles + one.zeros + 1
        price = max(np.log(2.0 * len(self.power)) - 2.0, 0.0)
        return float(np.sum(one.left_out) / self.noise + count * price)

    @property
    def ranked(self) -> tuple[Tried, ...]:
        """The best first: that with the fewest parameters of those that are about as good as any, then the others."""
        scores = [self.score(one) for one in self.tried]
        alike = [one for one, score in zip(self.tried, scores, strict=True) if score <= min(scores) + MENTION]
        first = min(alike, key=lambda one: one.poles + one.zeros)
        return first, *sorted((one for one in self.tried if one is not first), key=self.score)

    @property
    def best(self) -> TransferFunction:
        """The structure to go on with, its dead time left open where it was searched."""
        first = self.ranked[0]
        return replace(first.model.orders, delays=self.delays)

    @property
    def fit(self) -> ResponseFit:
        """The fit of the best structure, which says how it was chosen."""
        best = self.ranked[0].fit
        edge = self.at_edge
        return replace(
            best,
            notes=(best.notes[0], self.told, *edge, *best.notes[1:]),
            warnings=(*edge, *best.warnings),
            orders=self,
        )

    @property
    def told(self) -> str:
        """What was taken, and by what."""
        first, *rest = self.ranked
        counts = sorted({one.poles for one in self.tried})
        text = (
            f"Orders: {_named(first)}, of {len(self.tried)} structures of {counts[0]} to {counts[-1]} poles the one "
            f"with the least error at frequencies left out of the fit, each fifth in turn "
            f"({self.left_out_percent(first):.3g} % of the response), and BIC's price of a parameter"
        )
        return text + (f"; next is {_named(rest[0])} ({self.left_out_percent(rest[0]):.3g} %)." if rest else ".")

    @property
    def at_edge(self) -> tuple[str, ...]:
        """That the best stands at the end of what was tried, where it does."""
        first, most = self.ranked[0], max(one.poles for one in self.tried)
        if first.poles < most or most == self.poles[0] == self.poles[1]:
            return ()
        return (f"{_named(first)} stand at the end of what was tried: allow more (poles 1:{most + 4}).",)

    def left_out_percent(self, one: Tried) -> float:
        """Root mean square of the errors at frequencies left out, in per cent of that of the response, weighted."""
        return 100.0 * float(np.sqrt(np.sum(one.left_out) / np.sum(self.power)))

    def to_frame(self) -> pd.DataFrame:
        """All that were tried, the best first.

        Returns:
            Columns ``poles``, ``zeros``, ``dead_time`` (s), ``left_out`` (error at frequencies left out, per cent of
            the response, weighted), ``fit`` (per cent) and ``score`` (beyond the first, in variances of the noise;
            below 0 where more parameters are better by no more than chance).
        """
        import pandas as pd

        least = self.score(self.ranked[0])
        rows = [
            {
                "poles": one.poles,
                "zeros": one.zeros,
                "dead_time": one.dead_time,
                "left_out": self.left_out_percent(one),
                "fit": one.fit.fit_percent,
                "score": self.score(one) - least,
            }
            for one in self.ranked
        ]
        return pd.DataFrame(rows)

    def __str__(self) -> str:
        rows = [f"{'poles':>5}{'zeros':>7}{'dead time [s]':>15}{'left out, error %':>19}{'fit %':>9}{'score':>9}"]
        rows += [
            f"{row.poles:>5}{row.zeros:>7}{row.dead_time:>15.4g}{row.left_out:>19.3g}{row.fit:>9.2f}{row.score:>9.3g}"
            for row in self.to_frame().itertuples()
        ]
        return "\n".join([*rows, self.told, *self.at_edge, *self.failed])

    __repr__ = __str__


def search_orders_of(
    problem: ResponseProblem,
    poles: tuple[int, int] = (FEWEST, MOST),
    zeros: int | None = None,
    *,
    domain: Domain = Domain.CONTINUOUS,
    delays: tuple[int, ...] | None = None,
    on_tried: Callable[[Tried], None] = lambda _: None,
) -> ResponseOrderSearch:
    """Fit structures of rising order until more poles say no more; then with fewer zeros, and with as many as poles.

    Args:
        problem: The response, and what counts of its errors.
        poles: The least and the largest number.
        zeros: Of all of them; by default one less than poles at first, and then as many as are needed.
        domain: Of the models.
        delays: The dead time in samples; searched by default.
        on_tried: Told of each that was fitted.

    Returns:
        The search.

    Raises:
        ConfigError: If the range is none, or nothing could be fitted.
    """
    lowest, highest = _range_of(poles)
    search = _Search(problem=problem, domain=domain, delays=delays, on_tried=on_tried, poles=(lowest, highest))
    for n in range(lowest, highest + 1):
        search.try_(n, n - 1 if zeros is None else min(zeros, n))
        if search.tried and n >= search.best.poles + PATIENCE:
            break
    if not search.tried:
        raise ConfigError(
            "no structure of these orders can be fitted", where="poles", expected="orders that the points allow",
            got="; ".join(search.failed), remedy="allow fewer poles, or measure more points",
        )  # fmt: skip
    if zeros is None:
        n = search.best.poles
        for fewer in range(n - 2, -1, -1):
            search.try_(n, fewer, begin=search.best)
            if search.best.zeros != fewer:
                break
        if domain is Domain.CONTINUOUS:
            search.try_(n, n, begin=search.best)
            search.try_(n - 1, n - 1)
        search.finish()
    return search.result


def _range_of(poles: tuple[int, int]) -> tuple[int, int]:
    low, high = poles
    if not (isinstance(low, int) and isinstance(high, int) and 1 <= low <= high):
        raise ConfigError(
            "not a range of poles", where="poles", expected="two whole numbers from 1 on, such as (1, 6)", got=poles,
            remedy="correct it",
        )  # fmt: skip
    return low, high


@dataclass(kw_only=True, eq=False)
class _Search:
    """What was tried so far."""

    problem: ResponseProblem
    domain: Domain
    delays: tuple[int, ...] | None
    on_tried: Callable[[Tried], None]
    poles: tuple[int, int]

    def __post_init__(self) -> None:
        self.tried: list[Tried] = []
        self.failed: list[str] = []

    @property
    def result(self) -> ResponseOrderSearch:
        """The search as it stands."""
        power = self.problem.weights * np.abs(self.problem.measured.values) ** 2
        return ResponseOrderSearch(
            tried=tuple(self.tried), power=power, poles=self.poles, delays=self.delays,
            failed=tuple(dict.fromkeys(self.failed)),
        )  # fmt: skip

    @property
    def best(self) -> Tried:
        """The best of those tried."""
        return self.result.ranked[0]

    def finish(self) -> None:
        """Fit the best as it would be alone, where it began at the poles of another."""
        best = self.best
        if best.begun:
            self.tried.remove(best)
            self.try_(best.poles, best.zeros)
            if all((one.poles, one.zeros) != (best.poles, best.zeros) for one in self.tried):
                self.tried.append(best)

    def try_(self, poles: int, zeros: int, *, begin: Tried | None = None) -> None:
        """Fit a structure, where that is new and the points are enough; from the poles and dead time of another."""
        if poles < self.poles[0] or any((one.poles, one.zeros) == (poles, zeros) for one in self.tried):
            return
        structure = TransferFunction(
            poles=(poles,), zeros=(zeros,), delays=self.delays, domain=self.domain, intercept=False
        )
        if poles + zeros + 1 > SHARE * 2 * len(self.problem.measured):
            self.failed.append(f"{len(self.problem.measured)} points are too few for {poles} poles and more.")
            return
        problem = self._near() if len({one.poles for one in self.tried}) >= FIRST else self.problem
        try:
            found = problem.fitted(structure) if begin is None else problem.fitted_from(structure, begin.model)
            left_out = left_out_errors(problem, structure, found)
            fit = response_fit(problem, found, left_out)
        except UserError as error:  # no start that stays finite
            self.failed.append(f"{poles} poles and {zeros} zeros were not fitted: {error.what}.")
            return
        self.tried.append(Tried(poles=poles, zeros=zeros, fit=fit, left_out=left_out, begun=begin is not None))
        self.on_tried(self.tried[-1])

    def _near(self) -> ResponseProblem:
        """The problem with dead times up to twice the longest that was found, and a period of the highest frequency."""
        training = self.problem.training or TransferFunctionTraining()
        if training.max_delay is not None or self.delays is not None:
            return self.problem
        period = 2.0 * np.pi / self.problem.measured.frequency[-1]
        seconds = 2.0 * max(one.dead_time for one in self.tried) + period
        sample_time = self.problem.sample_time or period / POINTS_A_PERIOD
        return replace(self.problem, training=replace(training, max_delay=int(np.ceil(seconds / sample_time))))


def _named(one: Tried) -> str:
    return f"{one.poles} pole{'s' * (one.poles > 1)} and {one.zeros} zero{'s' * (one.zeros != 1)}"
