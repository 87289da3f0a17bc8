"""One round of training end to end: what of the whole it trains, on what, and what its result depends on.

A round runs and trains what its targets depend on, no more. So its result depends on that part of the whole alone, and
on those channels of the traces: what is declared or wired elsewhere leaves a round as it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sysid.composite.members import free_runs, mean_squares, placed_outputs, seen_from
from sysid.composite.shared_weights import Everywhere
from sysid.composite.stages import Report
from sysid.estimation import CascadeFit, JointTraining, fit_cascade
from sysid.estimation.networks.joint import NEGLIGIBLE
from sysid.models import Cascade, Ends
from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.stage_config import TogetherConfig


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
        everywhere: The places, where the members are trained in all of theirs.
    """

    whole: Cascade
    part: Cascade
    trained: tuple[str, ...]
    targets: dict[str, float]
    training: JointTraining
    estimation: tuple[Trace, ...]
    selection: tuple[Trace, ...]
    everywhere: Everywhere | None

    @classmethod
    def of(
        cls,
        config: AssemblyConfig,
        asked: TogetherConfig,
        whole: Cascade,
        *,
        estimation: Sequence[Trace],
        selection: Sequence[Trace],
    ) -> JointRound:
        """Get a round ready.

        Args:
            config: The pipeline.
            asked: The round.
            whole: Where it starts.
            estimation: Traces of the whole to fit.
            selection: Traces of the whole that choose.

        Returns:
            The round.

        Raises:
            ConfigError: If the round is to be trained everywhere and cannot.
        """
        used, stand = estimation[: asked.traces], Everywhere.of(config, asked, whole) if asked.everywhere else None
        if stand is not None:
            part, trained = stand.part, [member.mapping.output for member in stand.members]
            used, selection = stand.traces(used), stand.traces(selection)
        else:
            # What no target depends on would be run, and its sensitivities with it, for nothing.
            part = whole.upstream_of(asked.targets, given=asked.measured)
            asked_for = [one for one in config.members if not asked.members or one.mapping.output in asked.members]
            trained = [name for member in asked_for for name in placed_outputs(member) if name in part.outputs]
        part = _in_own_order(part)
        return cls(
            whole=whole,
            part=part,
            trained=tuple(trained),
            targets=dict(asked.targets),
            training=asked.training_options(config.seed),
            estimation=tuple(_of_part(part, trace) for trace in used),
            selection=tuple(_of_part(part, trace) for trace in selection),
            everywhere=stand,
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

    def fit(self, report: Report) -> CascadeFit:
        """Train it.

        Args:
            report: Told after every iteration.

        Returns:
            The fit of the whole. A member that stood in several places may now differ between them, unless it was
            trained everywhere.
        """
        fit = fit_cascade(
            self.part,
            self.estimation,
            targets=self.targets,
            trained=self.trained,
            training=self.training,
            selection=self.selection,
            on_progress=report,
        )
        return self.put(fit)

    def put(self, fit: CascadeFit) -> CascadeFit:
        """The fit of the whole as it stands: what this round made of its part, in its place.

        Args:
            fit: Of the part, or of a whole that had the same part.

        Returns:
            The fit with the whole as its model.
        """
        if self.everywhere is not None:
            return replace(fit, model=self.everywhere.put(fit.model))
        whole = self.whole
        for model in self.part.models:
            whole = whole.with_member(fit.model.member(Ends.of(model).outputs[0]))
        return replace(fit, model=whole)


def _in_own_order(part: Cascade) -> Cascade:
    """The part with its members by name, as far as the wiring lets them: not as the whole happens to have them."""
    return replace(part, models=tuple(sorted(part.models, key=lambda model: Ends.of(model).outputs)))


def _of_part(part: Cascade, trace: Trace) -> Trace:
    """A trace with the channels that a part of the whole reads or writes, as far as it has them."""
    names = [name for name in (*part.inputs, *part.outputs) if name in trace.channel_names]
    return seen_from("", trace, {name: name for name in names})
