"""What a composite model is declared to be: members that are fitted, submodels that are fixed, how they are wired.

A member is one network with a mapping of its own. It may stand in several instances: the same weights over other
channels, one set of names for each. Nothing here is trained yet; :mod:`sysid.composite.training` does that.
"""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from sysid.composite.fixed.limits import named_limits
from sysid.composite.fixed.member import FixedMember, Standing, parameters_of
from sysid.composite.parameters import check_names, declared
from sysid.errors import ConfigError
from sysid.estimation import StabilityOptions, Training, estimators, fitting
from sysid.models import NARX, AbstractStructure, Limit, Mapping
from sysid.models.cascades.cascade_run import Level
from sysid.models.grey_box.declared import Parameter


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
    fitting.check(structure, mapping, training=training)


@dataclass(frozen=True, kw_only=True)
class Composite:
    """Members and fixed submodels as one system: who reads whom follows from the names of the channels.

    Args:
        members: What is fitted.
        fixed: Submodels that are declared; members may read them, and they the members.
        rest: Levels at rest that are inputs' (``{"BP": "STP"}``: charged to where the handle stands).
        limits: Limits of outputs; in its other instances a member has those of its first, unless they have their own.
            A side may be any expression of channels, ``"min(BP, 1.2*AR[k-1])"``: it becomes a fixed submodel, called
            after the output (:mod:`sysid.composite.fixed.limits`).
        parameters: What limits name that is estimated, by name as in :class:`~sysid.composite.FixedMember`; those of
            the fixed submodels are known in limits as well.

    Raises:
        ConfigError: If two of them write one channel, or nothing is fitted.
    """

    members: tuple[Member, ...]
    fixed: tuple[FixedMember, ...] = ()
    rest: Dict[str, Level] = field(default_factory=dict)
    limits: Dict[str, Limit] = field(default_factory=dict)
    parameters: tuple[Parameter, ...] | Dict[str, Any] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "members", tuple(self.members))
        object.__setattr__(self, "fixed", tuple(self.fixed))
        if not self.members:
            raise ConfigError("no member is fitted", where="members", expected="at least one", got="none")
        object.__setattr__(self, "parameters", parameters_of(self.parameters))
        more, limits = named_limits(self.standing, self.limits, declared(self.fixed, self._parameters))
        object.__setattr__(self, "fixed", (*self.fixed, *more))
        object.__setattr__(self, "limits", limits)
        self._check_parameters()
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
    def _parameters(self) -> tuple[Parameter, ...]:
        return self.parameters  # type: ignore[return-value]  # brought into this form when it was made

    def _check_parameters(self) -> None:
        read = declared(self.fixed)
        if strangers := [one.name for one in self._parameters if one.name not in read]:
            raise ConfigError(
                f"nothing reads the parameter {strangers[0]}",
                where=f"parameters, {strangers[0]}",
                expected="a parameter that a limit names",
                got=strangers[0],
                remedy="correct the name, or leave it out",
            )
        check_names(read, self.standing)

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the parameters that are estimated."""
        return tuple(dict.fromkeys(parameter.name for one in self.fixed for parameter in one.free))

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
        known = [one.output for one in self.members]
        what, otherwise = f"no member writes {output}", "correct the name, or add a member"
        raise ConfigError.unknown(what, output, known, otherwise, where="members")
