"""Which members of a cascade change while some are trained, and where their parameters and sensitivities stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.kernels.arrays import read_only
from sysid.kernels.cascade_layout import Program
from sysid.kernels.cascade_plan import Plan
from sysid.models import Cascade, Ends, Member
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.models.lagged.cascade_program import program_of


@dataclass(frozen=True, eq=False)
class TrainedMembers:
    """A cascade as its training runs it.

    Members that neither are trained nor read a trained one are not run.

    Args:
        members: The trained members, in the order of the parameters.
        program: The members that are run, with all their parameters.
        plan: How they are laid out.
        depth: Rows of regressors that the program holds before the first sample.
        places: For each trained member where its parameters stand in the program, among the weights of all and behind
            these the registers of equations, and where among those that are trained.
        own_first: For each member that is run the first of its trained parameters; -1 where it has none.
        extent: For each output the parameters up to which its sensitivities are not zero.
        source: For each regressor the output that it holds; -1 for an input.
        carry: For each output the longest lag with which it is read.
    """

    members: tuple[Member, ...]
    program: Program
    plan: Plan
    depth: int
    places: tuple[tuple[slice, slice], ...]
    own_first: NDArray[np.int64]
    extent: NDArray[np.int64]
    source: NDArray[np.int64]
    carry: NDArray[np.int64]

    @classmethod
    def of(cls, cascade: Cascade, trained: Sequence[str] | None) -> TrainedMembers:
        """Those of a cascade.

        Args:
            cascade: The whole.
            trained: Outputs of the members that are trained; all that have parameters by default.

        Returns:
            Them.

        Raises:
            ConfigError: If a member that would have to pass on sensitivities cannot.
        """
        run, flags = _to_run(cascade, trained)
        if not any(flags):
            raise ConfigError(
                "nothing is left to train",
                where="trained",
                expected="a member that has parameters",
                got=", ".join(str(model.mapping) for model in cascade.models),
                remedy="a whole of equations alone is complete: run it, or fit a GreyBox with free parameters",
            )
        members = [_columns(model) for model in run]
        for model, columns, yes in zip(run, members, flags, strict=True):
            if yes and columns.equation is not None and columns.equation.free == slice(0, 0):
                raise _cannot(model)
        program = program_of(members, [Ends.of(model) for model in run], cascade.wiring.channels, cascade.limits)
        return cls.of_program(program, members, flags, tuple(m for m, yes in zip(run, flags, strict=True) if yes))

    @classmethod
    def of_program(
        cls,
        program: Program,
        columns: Sequence[ColumnRecursion],
        trained: Sequence[bool],
        members: tuple[Member, ...] = (),
    ) -> TrainedMembers:
        """Those of a program that is there already, such as one network in its scaled numbers.

        Args:
            program: What is run.
            columns: Each member of it.
            trained: Whether each is trained.
            members: The trained ones as models, where their parameters are put back.

        Returns:
            Them.
        """
        places = _places(columns, trained, program)
        output_of = {int(channel): i for i, channel in enumerate(program.output_channel)}
        source = np.array([output_of.get(int(channel), -1) for channel in program.regressor_channel], dtype=np.int64)
        own_first = np.full(len(columns), -1, dtype=np.int64)
        own_first[np.flatnonzero(trained)] = [own.start for _, own in places]
        return cls(
            members=members,
            program=program,
            plan=Plan.of(program),
            depth=max(one.lags.depth for one in columns),
            places=places,
            own_first=own_first,
            extent=_extent(program, source, trained, [own for _, own in places]),
            source=source,
            carry=_carry(program, source),
        )

    @property
    def theta(self) -> NDArray[np.float64]:
        """The parameters that the trained members have, shape ``(n_parameters,)``."""
        return np.concatenate([self._numbers[whole] for whole, _ in self.places])

    @cached_property
    def _alone(self) -> bool:
        """Whether the trained parameters are all that there are, in the same order."""
        return self.places == ((slice(0, len(self._numbers)),) * 2,)

    @cached_property
    def _numbers(self) -> NDArray[np.float64]:
        return self.program.numbers

    def numbers_at(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the pass is given with these parameters of the trained members."""
        if self._alone:
            return read_only(np.ascontiguousarray(theta))
        whole = self._numbers.copy()
        for place, own in self.places:
            whole[place] = theta[own]
        return read_only(whole)

    def program_at(self, theta: NDArray[np.float64]) -> Program:
        """The program with these parameters of the trained members."""
        whole, n = self.numbers_at(theta).copy(), len(self.program.theta)
        return self.program._replace(theta=whole[:n], equations=self.program.equations._replace(registers=whole[n:]))

    def put(self, cascade: Cascade, theta: NDArray[np.float64]) -> Cascade:
        """The cascade with these parameters of the trained members."""
        for member, (_, own) in zip(self.members, self.places, strict=True):
            cascade = cascade.with_member(with_theta(member, theta[own]))
        return cascade


def with_theta(member: Member, theta: NDArray[np.float64]) -> Member:
    """A member with other parameters.

    Args:
        member: An ARX model, a network of one or several outputs, or an equation.
        theta: Its flat parameters, as its recursion has them.

    Returns:
        The member.

    Raises:
        ConfigError: If it has no flat parameters.
    """
    found = member.with_theta(theta)
    if found is None:
        raise _cannot(member)
    return found


def _to_run(cascade: Cascade, trained: Sequence[str] | None) -> tuple[list[Member], list[bool]]:
    """Members that change while the trained ones do, and which of them are trained."""

    def asked(model: Member) -> bool:
        return model.n_parameters > 0 if trained is None else bool(set(Ends.of(model).outputs) & set(trained))

    if any(cascade.wiring.feeds_back(Ends.of(model)) for model in cascade.models):
        return list(cascade.models), [asked(model) for model in cascade.models]
    changing: set[str] = set()
    run, flags = [], []
    for model in cascade.models:
        ends = Ends.of(model)
        own = asked(model)
        reads = {*ends.inputs, *(c for n in ends.outputs if n in cascade.limits for c in cascade.limits[n].channels)}
        if own or reads & changing:
            changing |= set(ends.outputs)
            run.append(model)
            flags.append(own)
    return run, flags


def _columns(model: Member) -> ColumnRecursion:
    columns = ColumnRecursion.of(model)
    if columns is None:
        raise _cannot(model)
    return columns


def _cannot(model: Member) -> ConfigError:
    return ConfigError(
        "a member cannot be trained with the others, or lies between trained members and a target",
        where=str(model.mapping),
        expected="ARX or NARX models, or equations with free parameters, from the first trained member on",
        got=model.structure.label,
        remedy="train only members downstream of it, or fit it as ARX or NARX",
    )


def _places(
    members: Sequence[ColumnRecursion], trained: Sequence[bool], program: Program
) -> tuple[tuple[slice, slice], ...]:
    places, own, equations = [], 0, program.equations
    for m in (m for m, yes in enumerate(trained) if yes):
        is_equation = members[m].equation is not None
        first = len(program.theta) + equations.free[m] if is_equation else program.theta_first[m]
        n = int(equations.n_free[m] if is_equation else program.theta_first[m + 1] - first)
        places.append((slice(int(first), int(first) + n), slice(own, own + n)))
        own += n
    return tuple(places)


def _carry(program: Program, source: NDArray[np.int64]) -> NDArray[np.int64]:
    longest = np.zeros(len(program.output_channel), dtype=np.int64)
    np.maximum.at(longest, source[source >= 0], program.regressor_lag[source >= 0])
    return longest


def _extent(
    program: Program, source: NDArray[np.int64], trained: Sequence[bool], own: Sequence[slice]
) -> NDArray[np.int64]:
    extent = np.zeros(len(program.output_channel), dtype=np.int64)
    # The last output of the member that each regressor belongs to: one that reads a later output stands in a circle.
    last = np.repeat(program.output_first[1:], np.diff(program.regressor_first)) - 1
    if own and (source > last).any():
        extent[:] = own[-1].stop
        return extent
    # Members run in order and parameters stand in that order: a row ends with the last trained member so far, unless
    # members read the past of later ones.
    ends = iter(own)
    reach = 0
    for m, yes in enumerate(trained):
        reach = next(ends).stop if yes else reach
        extent[program.output_first[m] : program.output_first[m + 1]] = reach
    return extent
