"""One row of the table of estimators: how a kind of structure is fitted, what it takes, how its fits are checked."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property, partial
from typing import Any

from sysid.errors import ConfigError
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear.polynomial.fit import PolynomialTraining
from sysid.estimation.linear.state_space.training import StateSpaceTraining
from sysid.estimation.linear.transfer_function.training import TransferFunctionTraining
from sysid.estimation.linear_posteriors import LinearPosterior, linear_posterior
from sysid.estimation.networks.posterior import calibrate
from sysid.estimation.networks.training import Training
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.remarks.equilibrium import equilibrium_notes
from sysid.estimation.remarks.parameter_doubt import unsure
from sysid.estimation.remarks.record_notes import (
    between_levels,
    contradicted,
    held,
    hidden,
    outnumbered,
    underexcited,
    undetermined,
)
from sysid.estimation.results.result import FitResult, Loop
from sysid.estimation.stability.check import (
    AbstractStabilityCheck,
    FreeRunCheck,
    NoCheck,
    StabilityOptions,
)
from sysid.models import (
    AbstractStructure,
    Mapping,
    Start,
)
from sysid.traces import Trace

Options = Training | TransferFunctionTraining | StateSpaceTraining | PolynomialTraining
"""What some estimator takes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Estimator:
    """One row of the table.

    Args:
        structure: The class of the structures that it fits.
        name: What people call them, with an article.
        fit: Fits one: a function of traces, mapping, structure and, where there are options, those; and by name of
            ``start``, ``rest_output`` and as many of ``selection``, ``initial``, ``vet``, ``resume``,
            ``on_checkpoint`` and ``on_progress`` as it knows.
        training: The class of its options; ``None`` where there is nothing to choose.
        check_training: Refuses options of that class that do not apply.
        initial: Refuses an initial fit that it cannot start from, from the two structures and the number of inputs;
            ``None`` where it takes none.
        begins: Where a fit begins that takes no initial one.
        stability: How the stability of its fits is checked.
        posterior: What its fits' covariance says of the output; ``None`` where the estimator gives a posterior itself.
        no_posterior: Why a fit may have none.
        joins: Whether its models can be members of a whole that are trained together.
        of_residuals: What a reader of its residuals should know; empty for nothing.
        starts: Starts of a network's fit that asks for none.
        unites: Whether several starts can be one model, each of them trained to its end.
        twice: Whether a short record is fitted a second time, cautiously.
        each: Whether a sample counts for one output where another lacks it; else it counts for none.
    """

    structure: type[AbstractStructure]
    name: str
    fit: Callable[..., FitResult]
    training: type[Options] | None = None
    check_training: Callable[[Any], None] = lambda _: None
    initial: Callable[[AbstractStructure, AbstractStructure, int], None] | None = None
    begins: str = ""
    stability: type[AbstractStabilityCheck] = FreeRunCheck
    posterior: LinearPosterior | None = None
    no_posterior: str = ""
    joins: bool = False
    of_residuals: str = ""
    starts: int = 1
    unites: bool = False
    twice: bool = False
    each: bool = False

    @cached_property
    def knows(self) -> frozenset[str]:
        """Names of the arguments that its function takes."""
        return frozenset(inspect.signature(self.fit).parameters)

    @property
    def linear(self) -> bool:
        """Whether its models are linear: they have poles and frequency responses."""
        return self.stability.by_poles

    @property
    def selects(self) -> bool:
        """Whether selection traces have a say in the fit."""
        return "selection" in self.knows

    def chooses(self, training: Options | None) -> bool:
        """Whether its fit chooses between several starts.

        Args:
            training: The options that are asked for.

        Returns:
            Whether it does.
        """
        return (getattr(training, "starts", None) or self.starts) > 1

    @property
    def resumes(self) -> bool:
        """Whether it goes on from a checkpoint, so that it can be trained piece by piece."""
        return "resume" in self.knows

    @property
    def runs(self) -> tuple[Callable[..., Any], type[AbstractStabilityCheck]]:
        """The code that a fit depends on: of all rows only this one's."""
        return (self.fit, self.stability)

    @property
    def kind(self) -> str:
        """The structure's kind, as files name it."""
        return self.structure.kind

    def options(self, given: Dict[str, Any] | None, *, seed: int) -> Options | None:
        """Its options from those that are given, by name.

        Args:
            given: The options; a seed among them counts.
            seed: The seed where none is among them.

        Returns:
            The options; ``None`` where it takes none.

        Raises:
            ConfigError: If there are options where there is nothing to choose, or one does not apply.
        """
        if self.training is None:
            if given is not None:
                raise self.takes_none(given)
            return None
        options = self.training(**{"seed": seed, **(given or {})})
        self.check_training(options)
        return options

    def check(
        self, training: object, initial: AbstractStructure | None, structure: AbstractStructure, mapping: Mapping
    ) -> None:
        """Refuse what does not go together; see :func:`check`."""
        structure.check_mapping(mapping)
        if training is not None:
            if self.training is None:
                raise self.takes_none(training)
            if not isinstance(training, self.training):
                raise ConfigError(
                    f"{self.name} takes other options",
                    where="training",
                    expected=self.training.__name__,
                    got=type(training).__name__,
                    remedy=f"write {_likewise(training, self.training)}, or leave training out",
                )
            self.check_training(training)
        if initial is not None:
            if self.initial is None:
                raise ConfigError(
                    f"{self.name} takes no initial fit",
                    where="initial",
                    expected=f"none: {self.begins}",
                    got=initial.label,
                    remedy="leave initial out",
                )
            self.initial(structure, initial, len(mapping.inputs))

    def run(
        self,
        traces: Sequence[Trace],
        mapping: Mapping,
        structure: AbstractStructure,
        training: Options | None,
        stability: StabilityOptions | None,
        *,
        remarks: bool = True,
        **given: Any,
    ) -> FitResult:
        """Fit and check; see :func:`fit`.

        Args:
            traces: Estimation traces.
            mapping: Which channels go in, which comes out.
            structure: What is fitted.
            training: Its options; ``None`` for the defaults.
            stability: How the free run is checked; ``None`` checks nothing.
            remarks: Whether posterior and notes are made; see :meth:`remarked`.
            given: What else a fit may be given, by name.

        Returns:
            The fit.
        """
        whole, chooses = traces, given.get("selection", ())
        traces = [trace.seen_by(mapping.channels, each=self.each) for trace in traces]
        if chooses:
            given["selection"] = [one.seen_by(mapping.channels, each=self.each) for one in chooses]
        options = self.options(None, seed=0) if training is None else training
        checked = NoCheck() if stability is None else self.stability.of(stability, mapping, traces)
        chosen = () if self.training is None else (options,)
        known = {name: value for name, value in given.items() if name in self.knows}

        def noted(*args: Any, **named: Any) -> FitResult:
            """The fit with what its records say of how they begin, before what its check says."""
            found = self.fit(*args, **named)
            if not remarks:
                return found
            return self.remarked(found, whole, mapping, options, start=named["start"], selection=chooses)

        with one_blas_thread():
            return checked.fitted(noted, traces, mapping, structure, *chosen, **known)

    @one_blas_thread()
    def remarked(
        self,
        found: FitResult,
        traces: Sequence[Trace],
        mapping: Mapping,
        options: object,
        *,
        start: Start,
        selection: Sequence[Trace] = (),
    ) -> FitResult:
        """A fit with its posterior, and with what its records say of it.

        Of the many fits of a search one is looked at: these take longer than most of them, and are made of that one.

        Args:
            found: The fit.
            traces: Estimation traces.
            mapping: Which channels go in, which comes out.
            options: How it was fitted.
            start: What stands before each.
            selection: Traces that widen its intervals to the errors on them.

        Returns:
            The fit; notes of a check of its free run, which it may have had, stay last.
        """
        lost = () if self.each else hidden(traces, mapping)
        traces, selection = (
            [trace.seen_by(mapping.channels, each=self.each) for trace in some] for some in (traces, selection)
        )
        last = len(found.notes) - (found.stability is not None)  # what a check says comes last
        own, checked = found.notes[:last], found.notes[last:]
        found = self.with_posterior(found, traces, start, selection)
        told = () if found.posterior is not None else (f"No interval of the output: {self._unsure(options)}.",)
        off = equilibrium_notes(found.model, traces, start)
        linear = found.loop is Loop.CLOSED and found.model.pole_radius is not None
        errors = found.history.get("mse") if linear else None
        trained = float(errors[-1]) if errors is not None and len(errors) else None
        against = contradicted(found.model, traces, start, options, uncertainty=found.uncertainty, trained=trained)
        few = (*outnumbered(found.model, traces), *underexcited(found.model, traces), *held(found.model, traces))
        if found.posterior is not None and found.loop is Loop.OPEN:
            variance_of = partial(found.posterior.parameter_variance, found.model, loop=Loop.CLOSED)
            few = (*few, *unsure(variance_of, found.model, traces, start))
        switches, levels = between_levels(found.model, traces)
        warned = (*undetermined(traces, mapping), *lost, *few, *against, *off, *levels)
        notes = (*own, *told, *switches, *warned, *checked)
        return replace(found, notes=notes, warnings=(*found.warnings, *warned))

    def _unsure(self, options: Any) -> str:
        """Why a fit has no posterior."""
        given = getattr(options, "regularisation", None)
        return self.no_posterior if given is None else f"regularisation: {given:g} was given, not found by the evidence"

    def with_posterior(
        self, fit: FitResult, traces: Sequence[Trace], start: Start, selection: Sequence[Trace]
    ) -> FitResult:
        """A fit with the posterior that follows from what its estimator knows of its parameters.

        Args:
            fit: The fit.
            traces: Estimation traces.
            start: What stands before each.
            selection: Traces that widen its intervals to the errors on them.

        Returns:
            The fit; as it is where its estimator gives a posterior itself, or there is none.
        """
        found = None if self.posterior is None else linear_posterior(self.posterior, fit, traces, start)
        if found is None:
            return fit
        others = [Experiment.for_model(trace, fit.model, start) for trace in selection]
        return replace(fit, posterior=calibrate(found, fit.model, others))

    def takes_none(self, training: object) -> ConfigError:
        """The refusal of options where there is nothing to choose.

        Args:
            training: What was given.

        Returns:
            The error.
        """
        return ConfigError(
            f"{self.name} takes no training",
            where="training",
            expected="none: least squares has nothing to choose",
            got=", ".join(training) or "an empty one" if isinstance(training, Dict) else type(training).__name__,
            remedy="leave training out",
        )


def _likewise(given: object, kind: type[Any]) -> str:
    """Options of another kind with what it knows of those that were given."""
    known = {one.name for one in fields(kind)}
    own = fields(given) if is_dataclass(given) else ()
    said = {one.name: getattr(given, one.name) for one in own if getattr(given, one.name) != one.default}
    kept = ", ".join(f"{name}={value!r}" for name, value in said.items() if name in known)
    lost = ", ".join(name for name in said if name not in known)
    return f"{kind.__name__}({kept})" + (f", which has no {lost}" if lost else "")
