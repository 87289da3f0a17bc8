"""One round of training end to end: what of the whole it trains, on what, and what its result depends on.

A round runs and trains what its targets depend on, no more. So its result depends on that part of the whole alone, and
on those channels of the traces: what is declared or wired elsewhere leaves a round as it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sysid.composite.composite import Composite
from sysid.composite.fixed.member import Standing
from sysid.composite.keeper import Report
from sysid.composite.members import free_runs, mean_squares, seen_from
from sysid.composite.parameters import trained_equations, values_in, with_values
from sysid.composite.plan import RoundPlan
from sysid.composite.rounds.shared_weights import SharedWeights
from sysid.composite.stages import reading_more
from sysid.estimation import CascadeFit, JointTraining, fit_cascade
from sysid.estimation.networks.together.fit import NEGLIGIBLE
from sysid.models import Cascade, Ends
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True, eq=False)
class JointRound:
    """A round that is ready to be trained.

    Args:
        whole: Where it starts.
        part: What of it the targets depend on; everything else is as measured.
        trained: Outputs of the members that are trained.
        targets: The error of each output that counts as one, in its unit.
        training: How.
        estimation: Traces to fit, over the part's channels.
        selection: Traces that choose among the states on the way, likewise.
        shared: The instances, where the members keep one set of weights for all of theirs.
        parameters: Names of the parameters of equations, each of which is one wherever it acts.
    """

    whole: Cascade
    part: Cascade
    trained: tuple[str, ...]
    targets: dict[str, float]
    training: JointTraining
    estimation: tuple[Trace, ...]
    selection: tuple[Trace, ...]
    shared: SharedWeights | None
    parameters: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        composite: Composite,
        asked: RoundPlan,
        whole: Cascade,
        *,
        estimation: Sequence[Trace],
        selection: Sequence[Trace],
    ) -> JointRound:
        """Get a round ready.

        Args:
            composite: What is declared.
            asked: The round.
            whole: Where it starts.
            estimation: Traces of the whole to fit.
            selection: Traces of the whole that choose.

        Returns:
            The round.

        Raises:
            ConfigError: If the round is to share weights and cannot.
        """
        used, stand = (
            estimation[: asked.traces],
            SharedWeights.of(composite, asked, whole) if asked.share_weights else None,
        )
        if stand is not None:
            part, trained = stand.part, [member.output for member in stand.members]
            used, selection = stand.traces(used), stand.traces(selection)
        else:
            # What no target depends on would be run, and its sensitivities with it, for nothing.
            part = whole.upstream_of(asked.targets, given=asked.measured)
            named = asked.members or None
            asked_for: list[Standing] = [one for one in composite.members if named is None or one.output in named]
            asked_for += [*trained_equations(composite.fixed, named)]
            trained = [name for member in asked_for for name in member.outputs if name in part.outputs]
        part = _in_own_order(part)
        return cls(
            whole=whole,
            part=part,
            trained=tuple(trained),
            targets=dict(asked.targets),
            training=asked.training,
            estimation=tuple(_of_part(part, trace) for trace in used),
            selection=tuple(_of_part(part, trace) for trace in selection),
            shared=stand,
            parameters=composite.free,
        )

    @property
    def terms(self) -> dict[str, Any]:
        """JSON values that the result depends on, beside the code and how it is asked for."""
        return {
            "start": self.part.to_dict(),
            "trained": list(self.trained),
            "estimation": [trace.digest for trace in self.estimation],
            "selection": [trace.digest for trace in self.selection],
        }

    def error(self, whole: Cascade) -> float:
        """The error by which a round's states are chosen.

        Args:
            whole: With this round's part in some state.

        Returns:
            Geometric mean over selection traces and targets of the mean squared error of the part's free run, each in
            the error of its target that counts as one.
        """
        models = tuple(whole.member(Ends.of(model).outputs[0]) for model in self.part.models)
        ones = np.array(list(self.targets.values()))
        runs = free_runs(replace(self.part, models=models), self.selection, list(self.targets))
        squares = mean_squares(runs, self.selection, list(self.targets)) / ones**2
        # As in the fit: a target that is met exactly, such as a switch that never moves, must not outweigh all others.
        return float(np.exp(np.mean(np.log(np.maximum(squares, NEGLIGIBLE)))))

    def fit(self, report: Report = lambda _: None) -> CascadeFit:
        """Train it.

        Args:
            report: Told after every iteration.

        Returns:
            The fit of the part; :meth:`put` has it in its place.
        """
        return fit_cascade(
            self.part,
            self.estimation,
            targets=self.targets,
            trained=self.trained,
            training=self.training,
            selection=self.selection,
            shared=self.parameters,
            on_progress=report,
        )

    def put(self, fit: CascadeFit) -> CascadeFit:
        """The fit of the whole as it stands: what this round made of its part, in its place.

        Args:
            fit: Of the part, or of a whole that had the same part.

        Returns:
            The fit with the whole as its model. A member that stood in several instances may now differ between them,
            unless it shares its weights.
        """
        if self.shared is not None:
            return replace(fit, model=self.shared.put(fit.model))
        whole = self.whole
        for model in self.part.models:
            whole = whole.with_member(fit.model.member(Ends.of(model).outputs[0]))
        return replace(fit, model=with_values(whole, values_in(fit.model)) if self.parameters else whole)


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainedRound:
    """A round that was trained.

    Args:
        name: What it is called: ``2``, or ``2.1 of active learning``.
        trained: Outputs of the members that it trained, each in its first instance.
        shared: Whether it trained them in all of their instances.
        measured: Outputs that were as measured.
        traces: How many traces it was fitted to.
        before: Error on the selection traces where it started.
        after: The same of the state that was chosen.
        fit: What came of it.
    """

    name: str
    trained: tuple[str, ...]
    shared: bool
    measured: tuple[str, ...]
    traces: int
    before: float
    after: float
    fit: CascadeFit

    @classmethod
    def of(cls, composite: Composite, asked: RoundPlan, ready: JointRound, fit: CascadeFit, name: str) -> TrainedRound:
        """Say what a round did.

        Args:
            composite: What is declared.
            asked: The round.
            ready: What it trained, and on what.
            fit: What came of it.
            name: What it is called.

        Returns:
            The round.
        """
        return cls(
            name=name,
            trained=tuple(one.output for one in composite.standing if not set(one.outputs).isdisjoint(ready.trained)),
            shared=asked.share_weights,
            measured=asked.measured,
            traces=len(ready.estimation),
            before=ready.error(ready.whole),
            after=ready.error(fit.model),
            fit=fit,
        )

    @property
    def iterations(self) -> int:
        """How far the state that was chosen had come; 0 is where the round started."""
        return int(self.fit.history["iteration"][-1]) if len(self.fit.history["iteration"]) else 0

    @property
    def loss(self) -> float | None:
        """Mean squared residual of that state; ``None`` where no step was worth taking, which leaves no curve."""
        return float(self.fit.history["loss"][-1]) if len(self.fit.history["loss"]) else None

    @property
    def sentences(self) -> list[str]:
        """All that its fit says: which states were looked at, which was chosen, and how it ended."""
        return [
            f"Round {self.name}: {said}"
            for said in (*self.fit.notes, *self.fit.told_of_equations, self.fit.status.value)
        ]


def train_round(
    composite: Composite,
    asked: RoundPlan,
    whole: Cascade,
    *,
    estimation: Sequence[Trace],
    selection: Sequence[Trace],
    report: Report = lambda _: None,
) -> CascadeFit:
    """Train a whole end to end in one round.

    Args:
        composite: What is declared.
        asked: The round.
        whole: Where it starts.
        estimation: Traces of the whole to fit.
        selection: Traces of the whole that choose among the states on the way.
        report: Told after every iteration.

    Returns:
        The fit, with the whole as its model.

    Raises:
        ConfigError: If the round cannot be trained so.
    """
    started = reading_more(whole, asked.reads)
    ready = JointRound.of(composite, asked, started, estimation=estimation, selection=selection)
    return ready.put(ready.fit(report))


def _in_own_order(part: Cascade) -> Cascade:
    """The part with its members by name, as far as the wiring lets them: not as the whole happens to have them."""
    return replace(part, models=tuple(sorted(part.models, key=lambda model: Ends.of(model).outputs)))


def _of_part(part: Cascade, trace: Trace) -> Trace:
    """A trace with the channels that a part of the whole reads or writes, as far as it has them."""
    names = [name for name in (*part.inputs, *part.outputs) if name in trace.channel_names]
    return seen_from("", trace, {name: name for name in names})
