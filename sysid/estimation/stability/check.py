"""How a fit's free run is checked: a linear model by its poles, a network over random sequences."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from sysid.errors import ConfigError, TraceError, shortened
from sysid.estimation.clock import now
from sysid.estimation.results.result import NOT_STABLE, FitResult, Loop, Status
from sysid.estimation.stability.beginnings import TWICE, Beginnings
from sysid.estimation.stability.excursions import Excursions
from sysid.estimation.stability.free_run import SEED, SEQUENCES, TOLERANCE, Run, Stability, check_stability
from sysid.estimation.stability.linear_stand_in import GROWTH, linear_stand_in
from sysid.estimation.stability.other_commands import OtherCommands
from sysid.estimation.stability.sequences import AbstractSequences, TraceSequences
from sysid.models import AbstractModel, Mapping
from sysid.models.orders.lags import whole
from sysid.models.orders.typed_fields import TypedFields
from sysid.traces import Trace

STILL_S = 20.0
"""Seconds for which a declared sequence's output has to stand still before it is judged."""

LEAST_S, TIME_SHARE = 60.0, 1.0
"""Seconds that a check may take whatever its fit took, and share of the fit's time that it may take beyond these."""

Vet = Callable[[AbstractModel], bool]
"""Whether a model's free run is stable."""


@dataclass(frozen=True, kw_only=True)
class StabilityOptions(TypedFields):
    """Over which sequences a network's free run has to stay bounded and to settle; a linear model has its poles.

    A surrogate that will be asked for more than was recorded is asked for it before it is chosen: with ``amplitude:
    1.5`` inputs go half as far again from their middle, and a start that runs away there gives way to one that stays.

    Args:
        count: How many sequences at most; 0 checks nothing.
        tolerance: How far from its plateau a run may settle, as a share of the output's range.
        seed: Seed of the sequences.
        choose: Whether the best start gives way to the best stable one. It never does in a fit of the open loop, which
            is not made to run free.
        sequences: Traces that are run as they are; by default excursions made from the estimation traces.
        source: Where those traces come from, as a sentence.
        time_share: Share of the fit's own time that its checks may take together, and a minute in any case; on how
            many sequences the verdict then rests is said. Infinity for no bound.
        amplitude: How many times as far from the middle of their range as in the estimation traces the inputs of
            excursions go; beyond 1 only whether a run stays bounded is judged.
        also: What else a start has to pass to be chosen. It is no matter of what was found, and not among the terms:
            who asks it has it in his keys.
        unless: Why starts are refused that do not pass that, in words.

    Raises:
        ConfigError: If a number cannot be used.
    """

    count: int = SEQUENCES
    tolerance: float = TOLERANCE
    seed: int = SEED
    choose: bool = True
    sequences: tuple[Trace, ...] = ()
    source: str = "Given traces."
    time_share: float = TIME_SHARE
    amplitude: float = 1.0
    also: Vet | None = None
    unless: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.sequences, Iterable):
            raise ConfigError(
                "sequences are not traces", where="sequences", expected="traces that are run as they are",
                got=shortened(self.sequences), remedy="how many random sequences there are is count",
            )  # fmt: skip
        object.__setattr__(self, "sequences", tuple(self.sequences))
        for name in ("count", "seed"):
            if not whole(getattr(self, name)) or getattr(self, name) < 0:
                raise ConfigError(
                    f"{name} is not a number that can be used", where=name, expected="a whole number, 0 or more",
                    got=shortened(getattr(self, name)), remedy=f"write for example {name}: 100",
                )  # fmt: skip
        for name, usual in (("tolerance", TOLERANCE), ("time_share", TIME_SHARE), ("amplitude", 1.0)):
            value = getattr(self, name)
            if not (isinstance(value, int | float) and value > 0.0):
                raise ConfigError(
                    f"{name} is not a number that can be used", where=name, expected="a number above 0",
                    got=shortened(value), remedy=f"write for example {name}: {usual}",
                )  # fmt: skip

    @property
    def terms(self) -> dict[str, Any]:
        """JSON values that what is found depends on, beside the model and the estimation traces."""
        numbers = {name: getattr(self, name) for name in ("count", "tolerance", "seed", "choose", "source")}
        # Absent where it is the usual one, so that older files keep their digest.
        share = {} if self.time_share == TIME_SHARE else {"time_share": self.time_share}
        beyond = {} if self.amplitude == 1.0 else {"amplitude": self.amplitude}
        return {**numbers, **share, **beyond, "sequences": [trace.digest for trace in self.sequences]}


class AbstractStabilityCheck(ABC):
    """Checks the candidates of one fit, and the fit."""

    by_poles = False
    """Whether it costs nothing, for it runs nothing."""

    @classmethod
    @abstractmethod
    def of(cls, options: StabilityOptions, mapping: Mapping, estimation: Sequence[Trace]) -> AbstractStabilityCheck:
        """The check of a fit.

        Args:
            options: What is asked.
            mapping: Inputs and output.
            estimation: The estimation traces.

        Returns:
            The check; it asks nothing where the traces are too short to make sequences from.
        """

    def vet(self, loop: Loop) -> Vet | None:
        """What a fit asks of its candidates; ``None`` where it takes the best as it is.

        Args:
            loop: In which loop it is trained.
        """
        del loop
        return None

    def fitted(self, estimator: Callable[..., FitResult], *given: Any, **named: Any) -> FitResult:
        """A fit whose candidates are asked for a stable free run, where its estimator has several, and that is checked.

        Args:
            estimator: Fits.
            given: What it is given: traces, mapping, structure and options.
            named: What it is given by name.

        Returns:
            The fit with what was found.
        """
        loop = getattr(given[-1], "loop", None)
        vet = {} if loop is None else {"vet": self.vet(loop)}
        return self.applied(estimator(*given, **named, **vet))

    @abstractmethod
    def applied(self, fit: FitResult) -> FitResult:
        """A fit with what the check found of its model.

        Args:
            fit: The fit.

        Returns:
            The fit; its status says so where the free run is unstable.
        """


class NoCheck(AbstractStabilityCheck):
    """Asks nothing."""

    @classmethod
    def of(cls, options: StabilityOptions, mapping: Mapping, estimation: Sequence[Trace]) -> NoCheck:
        """The check that asks nothing, whatever is given."""
        del options, mapping, estimation
        return cls()

    def applied(self, fit: FitResult) -> FitResult:
        """The fit as it is."""
        return fit


class PoleCheck(AbstractStabilityCheck):
    """The largest pole of a linear model, of which its estimator says so in a note."""

    by_poles = True

    @classmethod
    def of(cls, options: StabilityOptions, mapping: Mapping, estimation: Sequence[Trace]) -> PoleCheck:
        """The check, which needs no sequences."""
        del options, mapping, estimation
        return cls()

    def applied(self, fit: FitResult) -> FitResult:
        """The fit, with the status ``UNSTABLE`` where a pole lies outside the unit circle."""
        radius = fit.model.pole_radius
        return fit if radius is None or radius <= 1.0 + GROWTH else replace(fit, status=_unstable(fit.status))


@dataclass(kw_only=True, eq=False)
class _Clock:
    """What the checks of one fit have taken, beside what the fit has."""

    began: float = field(default_factory=now)
    spent_s: float = 0.0

    @contextmanager
    def left(self, share: float, trained_s: float) -> Iterator[float]:
        """Counts what is done in it, which may take so many seconds."""
        at = now()
        fitted_s = max(trained_s, at - self.began) - self.spent_s
        yield max(LEAST_S, share * fitted_s) - self.spent_s
        self.spent_s += now() - at


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeRunCheck(AbstractStabilityCheck):
    """The free run over random sequences; each model is run once.

    Args:
        options: What is asked.
        source: Where the sequences come from; ``None`` checks nothing.
        mapping: Inputs and output of the fit.
        estimation: The traces that excursions are made of; none for sequences that are given.
    """

    options: StabilityOptions
    source: AbstractSequences | None
    mapping: Mapping | None = None
    estimation: tuple[Trace, ...] = ()
    found: dict[int, tuple[AbstractModel, Stability]] = field(default_factory=dict)
    """What was found, by the model's identity; the model is kept so that no other takes its place."""
    reasons: set[str] = field(default_factory=set)
    """Why candidates were refused."""
    clock: _Clock = field(default_factory=_Clock)

    @classmethod
    def of(cls, options: StabilityOptions, mapping: Mapping, estimation: Sequence[Trace]) -> FreeRunCheck:
        """The check over the sequences that are given, or excursions of the estimation traces."""
        inputs, outputs, given = mapping.inputs, mapping.outputs, options.sequences
        if options.count == 0:
            return cls(options=options, source=None)
        if not given:
            try:
                source = Excursions.of(estimation, inputs, outputs, options.amplitude)
                return cls(options=options, source=source, mapping=mapping, estimation=tuple(estimation))
            except TraceError:  # too short to make sequences from, which is no reason not to fit
                return cls(options=options, source=None)
        sequences = TraceSequences(
            inputs=inputs,
            outputs=outputs,
            sample_time=given[0].sample_time,
            traces=given,
            source_text=options.source,
            still=max(1, round(STILL_S / given[0].sample_time)),
        )
        return cls(options=options, source=sequences)

    def vet(self, loop: Loop) -> Vet | None:
        """What a fit asks of its candidates; ``None`` where it takes the best as it is.

        Args:
            loop: In which loop it is trained.
        """
        return self if self.options.choose and loop is Loop.CLOSED else None

    def __call__(self, model: AbstractModel) -> bool:
        """Whether a model's free run is stable, and passes what else is asked.

        Args:
            model: The model.

        Returns:
            The verdict; true where nothing is asked.
        """
        if self.options.also is not None and not self.options.also(model):
            self.reasons.add(self.options.unless)
            return False
        found = self.finding(model)
        if found is None or found.stable:
            return True
        self.reasons.add(NOT_STABLE)
        return False

    def apart(self, model: AbstractModel) -> int:
        """On how many commands a model's free run hangs on where it began.

        Args:
            model: The model.

        Returns:
            The number; 0 where nothing is asked.
        """
        found = self.finding(model)
        return 0 if found is None or found.beginnings is None else found.beginnings.apart

    @property
    def refusal(self) -> str:
        """Why candidates were refused, in words."""
        return ", or ".join(sorted(self.reasons)) or NOT_STABLE

    def applied(self, fit: FitResult) -> FitResult:
        """A fit with what the sequences found; the sentence is among its notes."""
        found = self.finding(fit.model, trained_s=fit.train_time_s)
        if found is None:
            return fit
        status = fit.status if found.stable else _unstable(fit.status)
        attempts = tuple(replace(one, stable=found.stable) if one.chosen else one for one in fit.attempts)
        told = () if found.forgets or found.beginnings is None else (found.beginnings.sentence,)
        fit = _unchecked(fit)
        notes, warnings = (*fit.notes, found.sentence, *told), (*fit.warnings, *told)
        return replace(fit, status=status, stability=found.to_dict(), attempts=attempts, notes=notes, warnings=warnings)

    @cached_property
    def commands(self) -> OtherCommands | None:
        """What the system may be asked next, over which a run is to forget where it began; of what is recorded."""
        if self.mapping is None:
            return None
        return OtherCommands.of(self.estimation, self.mapping.inputs, self.mapping.outputs)

    @cached_property
    def reference(self) -> Run | None:
        """Linear models that follow the estimation traces; ``None`` where there are none, or none is asked."""
        return linear_stand_in(self.estimation, self.mapping) if self.mapping else None

    def finding(self, model: AbstractModel, *, trained_s: float = 0.0) -> Stability | None:
        """What the sequences say of a model.

        Args:
            model: The model; it is run once.
            trained_s: What its fit took, where that is known; else it is what has passed since the check was made.

        Returns:
            The finding; ``None`` where nothing is asked.
        """
        if self.source is None:
            return None
        if id(model) not in self.found:
            asked = self.options
            with self.clock.left(asked.time_share, trained_s) as seconds:
                found = check_stability(
                    model, self.source, tolerance=asked.tolerance, count=asked.count, seed=asked.seed,
                    reference=lambda: self.reference, seconds=seconds, commands=self.commands,
                )  # fmt: skip
            self.found[id(model)] = (model, found)
        return self.found[id(model)][1]


def _unchecked(fit: FitResult) -> FitResult:
    """A fit without what was said of a check before."""
    if fit.stability is None:
        return fit
    said = {fit.stability["text"]}
    if apart := fit.stability.get("apart"):
        said.add(Beginnings(sequences=min(TWICE, fit.stability["sequences"]), apart=apart).sentence)
    return replace(
        fit,
        notes=tuple(one for one in fit.notes if one not in said),
        warnings=tuple(one for one in fit.warnings if one not in said),
    )


def _unstable(status: Status) -> Status:
    """An interrupted fit stays so, and is done again."""
    return status if status is Status.INTERRUPTED else Status.UNSTABLE
