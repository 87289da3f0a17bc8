"""Training end to end where members stand in several places: one set of weights, on traces of every place in turn.

Each place of a line has the same valve behind another pressure. Trained in one place only, its members would learn
that place; trained in each for itself, there would be as many valves as places. Here the members run in their first
place's names, trace after trace, each as one place sees it: what comes from elsewhere is as measured there, or as the
whole puts it out. That is not trained and does not answer: where it reads the members in turn, it reads them as they
stood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sysid.composite.members import placed, seen_from, simulated_inputs
from sysid.errors import ConfigError
from sysid.models import Cascade, NARXModel
from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.member_config import MemberConfig
from sysid.workbench.assembly.stage_config import TogetherConfig


@dataclass(frozen=True, kw_only=True, eq=False)
class Everywhere:
    """What a round trains in all its places.

    Args:
        whole: The whole.
        part: What the targets depend on at one place, in the first place's names; the rest is its inputs.
        members: The members that are trained.
        places: Suffixes of their places.
        shared: Inputs that have the same name in every place.
        measured: Channels that are as measured, in the first place's names.
    """

    whole: Cascade
    part: Cascade
    members: tuple[MemberConfig, ...]
    places: tuple[str, ...]
    shared: frozenset[str]
    measured: tuple[str, ...]

    @classmethod
    def of(cls, config: AssemblyConfig, asked: TogetherConfig, whole: Cascade) -> Everywhere:
        """What a round trains.

        Args:
            config: The pipeline.
            asked: The round.
            whole: Where it starts.

        Returns:
            Its part of the whole.

        Raises:
            ConfigError: If its members do not stand in the same several places, or a target does not stand there.
        """
        members = tuple(one for one in config.members if one.mapping.output in (asked.members or ()))
        places = members[0].places
        beside = [one for one in config.standing if one.places == places]
        there = {one.mapping.output for one in beside}
        strangers = [name for name in (*(asked.members or ()), *asked.targets) if name not in there]
        if strangers or len(places) < 2:
            raise ConfigError(
                "the round cannot be trained everywhere",
                where="together, everywhere",
                expected="members and targets that stand in the same places, two or more",
                got=f"{members[0].mapping.output} at {len(places)}, {', '.join(strangers) or 'nothing'} elsewhere",
                remedy="give them the same places, or leave everywhere out",
            )
        return cls(
            whole=whole,
            part=whole.upstream_of(asked.targets, given={*asked.measured, *(set(whole.outputs) - there)}),
            members=members,
            places=places,
            shared=frozenset(name for one in beside for name in one.shared),
            measured=asked.measured,
        )

    def traces(self, traces: Sequence[Trace]) -> list[Trace]:
        """Traces as the places see them, each as one of them in turn.

        Args:
            traces: Traces of the whole.

        Returns:
            As many traces, in the first place's names.
        """
        count = len(self.places)
        found = [self._from(place, traces[i::count]) for i, place in enumerate(self.places)]
        return [found[i % count][i // count] for i in range(len(traces))]

    def _from(self, place: str, traces: Sequence[Trace]) -> list[Trace]:
        names = {name: self._at(name, place) for name in (*self.part.inputs, *self.part.outputs)}
        ran = {names[name] for name in self.part.inputs if name not in self.measured} & set(self.whole.outputs)
        if ran:
            given = [self._at(name, place) for name in self.measured]
            traces = simulated_inputs(self.whole.upstream_of(ran, given=given), traces, only=ran)
        return [seen_from(place, trace, names) for trace in traces]

    def put(self, part: Cascade) -> Cascade:
        """The whole with what was trained, in every place.

        Args:
            part: What the round made of its part.

        Returns:
            The whole.
        """
        whole = self.whole
        for one in self.members:
            model = part.member(one.mapping.output)
            if not isinstance(model, NARXModel):
                raise TypeError(f"{one.mapping} is no NARX")  # refused when the YAML was read
            for place in self.places:
                whole = whole.with_member(placed(one, model, place))
        return whole

    def _at(self, name: str, place: str) -> str:
        return name if name in self.shared else f"{name}{place}"
