"""Weight sharing over instances: one set of weights, trained end to end on traces of every instance in turn.

Every instance of a valve sees another pressure. Trained in one only, its members would learn
that one; trained in each for itself, there would be as many valves as instances. Here the members run in their first
instance's names, trace after trace, each as one instance sees it: what comes from elsewhere is as measured there, or as
the whole puts it out. That is not trained and does not answer: where it reads the members in turn, it reads them as
they stood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sysid.composite.composite import Composite, Member
from sysid.composite.members import limit_of_the_first, network_of, placed, seen_from, simulated_inputs
from sysid.composite.plan import RoundPlan
from sysid.errors import ConfigError
from sysid.models import Cascade, Limit
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True, eq=False)
class SharedWeights:
    """What a round trains in all its instances.

    Args:
        whole: The whole.
        part: What the targets depend on at one instance, in the first one's names; the rest is its inputs.
        members: The members that are trained.
        instances: Suffixes of their instances.
        shared: Inputs that have the same name in every instance.
        measured: Channels that are as measured, in the first instance's names.
    """

    whole: Cascade
    part: Cascade
    members: tuple[Member, ...]
    instances: tuple[str, ...]
    shared: frozenset[str]
    measured: tuple[str, ...]

    @classmethod
    def of(cls, composite: Composite, asked: RoundPlan, whole: Cascade) -> SharedWeights:
        """What a round trains.

        Args:
            composite: What is declared.
            asked: The round.
            whole: Where it starts.

        Returns:
            Its part of the whole.

        Raises:
            ConfigError: If its members do not stand in the same several instances, a target does not stand there, or
                the limits of an instance are others than those of the first.
        """
        if free := [one.output for one in composite.fixed if one.free and one.output in (asked.members or ())]:
            raise ConfigError(
                "a round that shares weights estimates no parameters of equations",
                where="share_weights",
                expected="members that are networks",
                got=", ".join(free),
                remedy="estimate them in a round of their own: a parameter is the same in all instances there",
            )
        members = tuple(one for one in composite.members if one.output in (asked.members or ()))
        instances = members[0].instances
        beside = [one for one in composite.standing if one.instances == instances]
        there = {one.output for one in beside}
        strangers = [name for name in (*(asked.members or ()), *asked.targets) if name not in there]
        if strangers or len(instances) < 2:
            raise ConfigError(
                "the members of the round cannot share their weights",
                where="share_weights",
                expected="members and targets that stand in the same instances, two or more",
                got=f"{members[0].output} at {len(instances)}, {', '.join(strangers) or 'nothing'} elsewhere",
                remedy="give them the same instances, or train each for itself",
            )
        _check_limits(composite, instances)
        return cls(
            whole=whole,
            part=whole.upstream_of(asked.targets, given={*asked.measured, *(set(whole.outputs) - there)}),
            members=members,
            instances=instances,
            shared=frozenset(name for one in beside for name in one.shared),
            measured=asked.measured,
        )

    def traces(self, traces: Sequence[Trace]) -> list[Trace]:
        """Traces as the instances see them, each as one of them in turn.

        Args:
            traces: Traces of the whole.

        Returns:
            As many traces, in the first instance's names.
        """
        count = len(self.instances)
        found = [self._from(instance, traces[i::count]) for i, instance in enumerate(self.instances)]
        return [found[i % count][i // count] for i in range(len(traces))]

    def _from(self, instance: str, traces: Sequence[Trace]) -> list[Trace]:
        names = {name: self._at(name, instance) for name in (*self.part.inputs, *self.part.outputs)}
        ran = {names[name] for name in self.part.inputs if name not in self.measured} & set(self.whole.outputs)
        if ran:
            given = [self._at(name, instance) for name in self.measured]
            traces = simulated_inputs(self.whole.upstream_of(ran, given=given), traces, only=ran)
        return [seen_from(instance, trace, names) for trace in traces]

    def put(self, part: Cascade) -> Cascade:
        """The whole with what was trained, in every instance.

        Args:
            part: What the round made of its part.

        Returns:
            The whole.
        """
        whole = self.whole
        for one in self.members:
            model = network_of(part.member(one.output))
            if model is None:
                raise TypeError(f"{one.mapping} is no NARX")
            for instance in self.instances:
                whole = whole.with_member(placed(one, model, instance))
        return whole

    def _at(self, name: str, instance: str) -> str:
        return name if name in self.shared else f"{name}{instance}"


def _check_limits(composite: Composite, instances: tuple[str, ...]) -> None:
    """Refuse limits of an instance that are not those of the first: all are trained in the first one's place."""
    for member in (one for one in composite.members if one.instances == instances):
        for instance, name in zip(instances[1:], member.outputs[1:], strict=True):
            own, first = composite.limits.get(name), limit_of_the_first(composite, member, instance)
            if own is not None and own != first:
                raise ConfigError(
                    "instances that share their weights have different limits",
                    where="share_weights",
                    expected=f"for {name} the limits of {member.output}: {_said(first)}",
                    got=_said(own),
                    remedy=f"declare them for {member.output} alone, which every instance then has, or train each "
                    "instance for itself (share_weights: false)",
                )


def _said(limit: Limit | None) -> str:
    sides = {} if limit is None else {"low": limit.low, "high": limit.high}
    return ", ".join(f"{side} {value}" for side, value in sides.items() if value is not None) or "none"
