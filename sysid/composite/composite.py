"""What a composite model is declared to be: members that are fitted, submodels that are fixed, how they are wired.

A member is one network with a mapping of its own. It may stand in several instances: the same weights over other
channels, one set of names for each. Nothing here is trained yet; :mod:`sysid.composite.training` does that.
"""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from sysid.equations.functions import OWN
from sysid.equations.syntax import Call, Delayed, nodes_of
from sysid.equations.system import written_name
from sysid.errors import ConfigError
from sysid.estimation import StabilityOptions, Training, estimators
from sysid.models import NARX, AbstractStructure, GreyBox, Limit, Mapping
from sysid.models.cascade_run import Level
from sysid.models.grey_box import Table, lowered


@dataclass(frozen=True, kw_only=True)
class Standing:
    """What stands in one instance or in several.

    Args:
        mapping: Inputs and output, such as ``BP+AR -> BC``; in the first instance as they are.
        instances: Suffixes of the channel names, one for each instance: ``("", "10")`` makes one over ``BP -> AR`` and
            one over ``BP10 -> AR10``.
        shared: Inputs that have the same name in every instance.
    """

    mapping: Mapping
    instances: tuple[str, ...] = ("",)
    shared: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "instances", tuple(self.instances))
        object.__setattr__(self, "shared", tuple(self.shared))
        if not self.instances:
            raise ConfigError(
                f"{self.mapping} stands nowhere",
                where="instances",
                expected="a suffix for each instance; an empty one for the first",
                got="none",
                remedy='leave instances out: one instance, ("",)',
            )

    @property
    def output(self) -> str:
        """What it writes in its first instance, by which it is called."""
        return self.mapping.output

    def channel(self, name: str, instance: str) -> str:
        """Name of one of its channels in one of its instances.

        Args:
            name: The channel in the first instance.
            instance: The instance's suffix.

        Returns:
            The channel there.
        """
        return name if name in self.shared else f"{name}{instance}"

    @property
    def outputs(self) -> list[str]:
        """What it writes, instance after instance."""
        return [self.channel(self.output, instance) for instance in self.instances]


@dataclass(frozen=True, kw_only=True)
class Member(Standing):
    """One network, fitted on traces of all its instances.

    Args:
        structure: What is fitted: a NARX; without neurons it is linear.
        alternatives: Other such structures that are fitted too, among which the whole chooses as well.
        training: How it is trained; its seed is that of the first candidate.
        rest: The output at rest, in its unit.
        candidates: Fits of each structure from different seeds, among which the whole chooses.
        traces: Estimation traces that it is fitted on, the first so many; all by default.
        stability: How its free run is checked when it is fitted alone. By default the check changes no choice, for a
            member is chosen by the error of the whole; the fit's status says what it found.

    Raises:
        ConfigError: If a structure is no NARX or does not fit the mapping, or a number is too small.
    """

    structure: NARX
    alternatives: tuple[NARX, ...] = ()
    training: Training = field(default_factory=Training)
    rest: float
    candidates: int = 1
    traces: int | None = None
    stability: StabilityOptions | None = field(default_factory=lambda: StabilityOptions(choose=False))

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "alternatives", tuple(self.alternatives))
        for structure in (self.structure, *self.alternatives):
            _check_structure(self.mapping, structure, self.training)
        for name, value, least in (("candidates", self.candidates, 0), ("traces", self.traces, 1)):
            if value is not None and value < least:
                raise ConfigError(
                    f"{name} of {self.mapping} is too small", where=name, expected=f"{least} or more", got=value
                )

    @property
    def variants(self) -> tuple[Member, ...]:
        """The member with each of its structures alone."""
        return tuple(self.of_structure(structure) for structure in (self.structure, *self.alternatives))

    def of_structure(self, structure: NARX) -> Member:
        """The member with one structure and no other.

        Args:
            structure: The structure.

        Returns:
            The member.
        """
        return replace(self, structure=structure, alternatives=())

    def trained(self, **options: Any) -> Member:
        """The member with some options of its training changed.

        Args:
            options: By their names in :class:`sysid.estimation.Training`.

        Returns:
            The member.
        """
        return replace(self, training=replace(self.training, **options))

    @property
    def terms(self) -> dict[str, Any]:
        """JSON values that a fit of it depends on, beside traces and code."""
        return {
            "mapping": str(self.mapping),
            "instances": list(self.instances),
            "shared": list(self.shared),
            "structure": self.structure.to_dict(),
            "training": {**asdict(self.training), "loop": self.training.loop.value},
            "rest": self.rest,
            "traces": self.traces,
            "stability": None if self.stability is None else self.stability.terms,
        }


def _check_structure(mapping: Mapping, structure: AbstractStructure, training: Training) -> None:
    row = estimators.estimator_of(structure)
    if not row.joins:
        raise ConfigError(
            f"{row.name} cannot be a member of a whole",
            where="structure",
            expected=f"{', '.join(estimators.JOINING)} for {mapping}; without neurons it is linear",
            got=structure.kind,
            remedy=f"use the kind {estimators.JOINING[0]}",
        )
    estimators.check(structure, mapping, training=training)


@dataclass(frozen=True, kw_only=True)
class FixedMember(Standing):
    """A submodel that is declared and not fitted: an expression of its inputs, held between two bounds.

    A weighted sum has its weights in ``gains``, and runs as one; any other expression is an ``equation``.

    Args:
        equation: The expression, in the language of equations, which reads all inputs and remembers nothing else:
            ``"max(a, b[k-1])*c"``. Its output's own past is an input under another name.
        tables: By name the points of functions that it calls.
        gains: The weight of each input, in the output's unit per the input's, or its weights by lag (``{0: 2, 1: -1}``
            looks one sample ahead); under the output's own name the weight of its last value: 1 sums up, more is a
            relay with hysteresis.
        constant: What is added, in the output's unit.
        low: Least value; none by default.
        high: Greatest value; none by default.
        rest: Value at rest.
        unit: Of the output; a pure number by default.

    Raises:
        ConfigError: If the gains, or what the equation reads, are not those of the inputs; if the equation cannot be
            read, or remembers; or if the bounds do not hold the rest.
    """

    gains: Dict[str, float | Dict[int, float]] = field(default_factory=dict)
    equation: str = ""
    tables: tuple[Table, ...] | Dict[str, Any] = ()
    constant: float = 0.0
    low: float = -math.inf
    high: float = math.inf
    rest: float
    unit: str = "1"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "tables", self.grey_box.tables if self.equation else tuple(self.tables))
        if self.equation:
            self._check_equation()
        else:
            self._check_gains()
        if not self.low <= self.rest <= self.high or self.low == self.high:
            raise ConfigError(
                f"the bounds of {self.output} do not hold its rest",
                where="low, high",
                expected="low at most rest, rest at most high, low below high",
                got=f"low {self.low:g}, rest {self.rest:g}, high {self.high:g}",
                remedy="correct the bounds",
            )

    @property
    def points(self) -> dict[str, tuple[tuple[float, float], ...]]:
        """By table its points."""
        return dict(self.tables)

    @property
    def grey_box(self) -> GreyBox:
        """The equation as a structure without parameters."""
        return GreyBox(equations=f"{written_name(self.output)} = {self.equation}", tables=self.tables)

    def _check_equation(self) -> None:
        system = self.grey_box.system
        lowered(self.grey_box, self.mapping.inputs, (self.output,), None)
        parts = [node for one in system.equations for node in nodes_of(one.right)]
        lost = any(isinstance(node, Delayed) and (node.seconds or node.name == self.output) for node in parts)
        remembers = any(isinstance(node, Call) and node.function in OWN for node in parts)
        if lost or remembers or self.gains or self.constant or set(system.others) != set(self.mapping.inputs):
            raise ConfigError(
                f"the equation of {self.mapping} is none of these inputs",
                where="equation",
                expected=f"an expression of {', '.join(self.mapping.inputs)}, now or whole samples ago, that remembers "
                "nothing, and neither gains nor a constant beside it",
                got=self.equation,
                remedy="correct the mapping, or write it under equations: what is remembered is made a channel there",
            )

    def _check_gains(self) -> None:
        if set(self.gains) - {self.output} != set(self.mapping.inputs) or self.tables:
            raise ConfigError(
                f"the gains of {self.mapping} are not those of its inputs",
                where="gains",
                expected=f"one for each of {', '.join(self.mapping.inputs)}, with or without {self.output}",
                got=", ".join(self.gains) or "none",
                remedy="correct the gains or the mapping, or write an equation, which alone calls tables",
            )
        own = self.gains.get(self.output, 0.0)
        if isinstance(own, Dict):
            raise ConfigError(
                f"{self.output} has weights by lag for its own past",
                where="gains",
                expected="one number, the weight of its last value",
                got=", ".join(f"{lag}: {weight:g}" for lag, weight in own.items()),
                remedy="write the weight of its last value",
            )
        for name in self.mapping.inputs:
            given = self.gains[name]
            if isinstance(given, Dict) and (not given or min(given) < 0):
                raise ConfigError(
                    f"the weights of {name} in {self.mapping} have no such lags",
                    where="gains",
                    expected="a weight for at least one lag, from 0 on",
                    got=", ".join(str(lag) for lag in given) or "none",
                    remedy="write a number for the newest sample alone, or lags from 0 on",
                )

    @property
    def weights(self) -> tuple[Dict[int, float], ...]:
        """For each input its weights by lag."""
        given = (self.gains[name] for name in self.mapping.inputs)
        return tuple(one if isinstance(one, Dict) else {0: one} for one in given)

    @property
    def memory(self) -> float:
        """The weight of its own last value."""
        own = self.gains.get(self.output, 0.0)
        return 0.0 if isinstance(own, Dict) else own


@dataclass(frozen=True, kw_only=True)
class Composite:
    """Members and fixed submodels as one system: who reads whom follows from the names of the channels.

    Args:
        members: What is fitted.
        fixed: Submodels that are declared; members may read them, and they the members.
        rest: Levels at rest that are inputs' (``{"BP": "STP"}``: charged to where the handle stands).
        limits: Limits of outputs; in its other instances a member has those of its first, unless they have their own.

    Raises:
        ConfigError: If two of them write one channel, or nothing is fitted.
    """

    members: tuple[Member, ...]
    fixed: tuple[FixedMember, ...] = ()
    rest: Dict[str, Level] = field(default_factory=dict)
    limits: Dict[str, Limit] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "members", tuple(self.members))
        object.__setattr__(self, "fixed", tuple(self.fixed))
        if not self.members:
            raise ConfigError("no member is fitted", where="members", expected="at least one", got="none")
        written = [name for one in self.standing for name in one.outputs]
        if len(set(written)) < len(written):
            raise ConfigError(
                "two members write one channel",
                where="members",
                expected="each channel written by one member in one instance",
                got=", ".join(sorted(name for name in set(written) if written.count(name) > 1)),
                remedy="correct the mapping or the instances",
            )

    @property
    def standing(self) -> tuple[Standing, ...]:
        """All of them, the fitted ones first."""
        return (*self.members, *self.fixed)

    def member(self, output: str) -> Member:
        """The member of an output.

        Args:
            output: What it writes in its first instance.

        Returns:
            The member.

        Raises:
            ConfigError: If no member writes it.
        """
        for one in self.members:
            if one.output == output:
                return one
        raise ConfigError(
            f"no member writes {output}",
            where="members",
            expected=f"one of {', '.join(one.output for one in self.members)}",
            got=output,
            remedy="correct the name, or add a member",
        )
