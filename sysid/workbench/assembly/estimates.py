"""How long the later stages of an assembly will take, before there is a member: what a dry run says of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from sysid.composite import TrainingData, dealt
from sysid.composite.candidates import sample_fit
from sysid.composite.plan import RoundPlan
from sysid.composite.rounds.times import RoundTime, stand_in, time_round
from sysid.errors import SysidError
from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.fits.estimates import network_time
from sysid.workbench.runner.dry_run import PATIENCE_S, worked_s
from sysid.workbench.runner.steps import NOT_KNOWN, Estimate


@dataclass(kw_only=True)
class RoundEstimates:
    """Rounds of training end to end, timed with stand-ins for the members, now on this machine.

    Args:
        config: The pipeline.
        data: Its traces, once they are loaded.
    """

    config: AssemblyConfig
    data: list[TrainingData] = field(default_factory=list)

    def of(self, name: str) -> Estimate:
        """How long a round takes.

        Args:
            name: Of its step.

        Returns:
            At most so long; not known where its traces are not there, or timing the rounds before took too long.
        """
        return self._found.get(name, NOT_KNOWN)

    def of_retraining(self, output: str) -> Estimate:
        """How long it takes to train a member again, on what the others put out.

        Args:
            output: The member's.

        Returns:
            At most so long.
        """
        asked = self.config.plan.retrain
        if not self.data or asked is None:
            return NOT_KNOWN
        if output not in self._retraining:
            data, member = self.data[0], self.config.composite.member(output)
            few = member.trained(
                max_iterations=asked.max_iterations, starts=1, ensemble=1, pretraining=0, input_subsets=()
            )
            again = replace(few, stability=None)
            sample = sample_fit(again, data.estimation[: member.traces], data.selection[:1])
            self._retraining[output] = network_time(sample.training, sample.fit, share=sample.share)
        return self._retraining[output]

    @cached_property
    def _retraining(self) -> dict[str, Estimate]:
        return {}

    @cached_property
    def _found(self) -> dict[str, Estimate]:
        if not self.data:
            return {}
        began, found = worked_s(), dict[str, Estimate]()
        try:
            for name, timed in self._timed(self.data[0]):
                found[name] = _estimate(timed)
                if worked_s() - began > PATIENCE_S:
                    break
        except SysidError:  # a run says what is wrong, when it comes to it
            pass
        return found

    def _timed(self, data: TrainingData) -> Iterator[tuple[str, RoundTime]]:
        plan, composite = self.config.plan, self.config.composite
        if not plan.rounds:
            return
        whole = stand_in(composite, data.estimation[0])
        for number, one in enumerate(plan.rounds, start=1):
            timed, whole = time_round(composite, one, whole, estimation=_traces(one, data), selection=data.selection)
            yield ("together" if number == 1 else f"together-{number}"), timed
        if (asked := plan.active_learning) is None or data.pool is None:
            return
        traces = _traces(plan.rounds[-1], data)[: plan.rounds[-1].traces]
        parts = []
        for one in asked.rounds:
            timed, whole = time_round(
                composite, replace(one, traces=None), whole, estimation=traces,
                selection=[*data.selection, *data.held_out],
            )  # fmt: skip
            parts.append(timed)
        # The pool may be made on demand; its sequences are like those that are held out.
        before, samples = _samples(traces), _samples(data.held_out) / len(data.held_out)
        for number in range(1, len(asked.additions) + 1):
            share = 1.0 + sum(asked.additions[:number]) * samples / before
            for part, timed in enumerate(parts, start=1):
                suffix = f"-{part}" if len(parts) > 1 else ""
                yield f"active-learning-{number}{suffix}", replace(timed, iteration_s=timed.iteration_s * share)


def _traces(one: RoundPlan, data: TrainingData) -> list[Trace]:
    return dealt([data.estimation, *(data.also[name][0] for name in one.also)])


def _samples(traces: Sequence[Trace]) -> int:
    return sum(len(trace) for trace in traces)


def _estimate(timed: RoundTime) -> Estimate:
    each = f"{timed.iterations} iterations of {1e3 * timed.iteration_s:.3g} ms"
    lengths = f" on each of {timed.windows} lengths of windows and over whole traces" if timed.windows else ""
    more = f", as many again{lengths}{'' if timed.asked else ' where the start is far off'}" if lengths else ""
    return Estimate(seconds=timed.seconds, basis=f"at most: {each}{more}, timed with untrained members")
