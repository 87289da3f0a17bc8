"""Grey box: equations that somebody wrote, with parameters to estimate and networks for what is not known."""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from itertools import pairwise
from typing import Any

from sysid.equations import RUNGE_KUTTA, SOLVERS, Lowered, System, Terms, lower
from sysid.errors import ConfigError, did_you_mean, shortened
from sysid.models.channels.history import Start, StartKind
from sysid.models.channels.mapping import Mapping
from sysid.models.grey_box.case_values import case_of, cases_among, cases_of, unknown_case
from sysid.models.grey_box.declared import CASE, InitialState, Parameter, entries, parameters_from, real
from sysid.models.orders.intersample import HELD, InterSample, intersample_of, marked, moving, to_fields
from sysid.models.orders.lags import whole
from sysid.models.orders.structure import AbstractStructure

MOST_SUBSTEPS = 1_000
MOST_POINTS = 10_000
"""Points of all tables together."""
WALD, PROFILE = "wald", "profile"
INTERVALS = (WALD, PROFILE)
"""How intervals of parameters are found."""


Table = tuple[str, tuple[tuple[float, float], ...]]


@dataclass(frozen=True, kw_only=True)
class GreyBox(AbstractStructure):
    """Equations with parameters to estimate, as MATLAB's ``idnlgrey`` and ``greyest``.

    Args:
        equations: One a line: ``dx/dt = ...``, ``x[k+1] = ...``, and what is computed now, ``y = ...``, the outputs
            among it. Names that are neither states, definitions nor parameters are inputs of the mapping.
        parameters: By name the start, or ``{start:, low:, high:, prior:, fixed:, unit:, per:}``.
        initial: By state its value before the first sample, or ``{start:, low:, high:, fixed:}``; of what is computed
            and read later, as ``y[k-1]``, the value of its past. What is not named is at equilibrium in a record that
            begins at rest, and estimated in others.
        tables: By name the points ``[[x, y], ...]`` of a function that is interpolated between them.
        substeps: Steps of the solver from sample to sample; by default as many as the records need, which is told.
        solver: ``runge-kutta``, or ``rosenbrock`` for stiff equations (implicit, as ``ode23s``); by default the one
            that the equations need where their parameters start, which is told.
        cases: By case the names of its records, which share its values of the parameters that are ``per: case``. A
            record that is not named is a case of its own.
        intersample: What inputs do between samples: ``zoh``, held, or ``foh``, straight to the next sample; for all,
            or by input as in ``{force: foh}``. A state with a rate then begins one sample before the first.
        intervals: ``wald``, from the curvature at the minimum; or ``profile``, by profile likelihood beside it, for
            which the others are fitted again some ten times for each parameter.

    Raises:
        ConfigError: With line and column of what is wrong with the equations, or naming another field.

    Example:
        >>> tank = GreyBox(equations="dlevel/dt = a*pump - b*sqrt(level)", parameters={"a": 0.1, "b": {"start": 0.2}})
        >>> tank.label
        'GreyBox 1/2'
    """

    equations: str
    parameters: tuple[Parameter, ...] | Dict[str, Any] = ()
    initial: tuple[InitialState, ...] | Dict[str, Any] = ()
    tables: tuple[Table, ...] | Dict[str, Any] = ()
    substeps: int | None = None
    solver: str | None = None
    cases: tuple[tuple[str, tuple[str, ...]], ...] | Dict[str, Any] = ()
    intervals: str = WALD
    intersample: InterSample | Dict[str, str] = HELD

    kind = "GreyBox"

    def __post_init__(self) -> None:
        text: Any = self.equations
        if isinstance(text, list | tuple) and all(isinstance(one, str) for one in text):
            text = "\n".join(text)
            object.__setattr__(self, "equations", text)
        if not isinstance(text, str):
            raise ConfigError(
                "the equations are no text", where="equations", expected="text, one equation a line",
                got=shortened(text), remedy="write equations: | and the equations below it, indented",
            )  # fmt: skip
        object.__setattr__(self, "parameters", parameters_from(self.parameters))
        object.__setattr__(self, "initial", entries(self.initial, InitialState, "initial"))
        object.__setattr__(self, "tables", _tables(self.tables))
        object.__setattr__(self, "cases", cases_of(self.cases))
        object.__setattr__(self, "intersample", intersample_of(self.intersample))
        if self.cases and not self.by_case:
            raise ConfigError(
                "no parameter has a value per case", where="cases", expected=f"a parameter with per: {CASE}",
                got=", ".join(name for name, _ in self.grouped),
                remedy=f"write for example k: {{start: 1, per: {CASE}}} among the parameters, or remove cases",
            )  # fmt: skip
        if self.substeps is not None and not (whole(self.substeps) and 1 <= self.substeps <= MOST_SUBSTEPS):
            raise ConfigError(
                "not a number of steps", where="substeps", expected=f"a whole number from 1 to {MOST_SUBSTEPS:,}",
                got=shortened(self.substeps), remedy="leave substeps out: as many as are needed are chosen",
            )  # fmt: skip
        if self.solver is not None and self.solver not in SOLVERS:
            raise ConfigError(
                "there is no such solver", where="solver", expected=f"one of {', '.join(SOLVERS)}",
                got=shortened(self.solver),
                remedy=did_you_mean(self.solver, SOLVERS, "leave solver out: the one that is needed is chosen"),
            )  # fmt: skip
        if self.intervals not in INTERVALS:
            raise ConfigError(
                "there are no such intervals", where="intervals", expected=f"one of {', '.join(INTERVALS)}",
                got=shortened(self.intervals), remedy=did_you_mean(self.intervals, INTERVALS, "leave intervals out"),
            )  # fmt: skip
        self._check_system()

    def _check_system(self) -> None:
        """Refuse equations that cannot be lowered for any mapping, before one is known."""
        system = self.system
        if any(self.moving(system.others)) and not system.continuous:
            raise ConfigError(
                "no equation has a rate, which inputs between samples would act on", where="intersample",
                expected=f"intersample: {HELD}, or an equation dx/dt = ...", got=self.intersample,
                remedy="remove intersample",
            )  # fmt: skip
        low = lowered(self, system.others, (*system.states, *system.definitions), None, self.solver or RUNGE_KUTTA)
        past = [name for name in system.definitions if f"{name}[k-1]" in low.states]
        known = (*system.states, *past)
        for one in self._states_given:
            if one.name not in known:
                raise ConfigError.unknown(
                    f"{one.name} is no state", one.name, known, "remove it", where="initial", none="none"
                )

    @property
    def named(self) -> tuple[Parameter, ...]:
        """The parameters."""
        return self.parameters  # type: ignore[return-value]  # brought into this form when it was made

    @property
    def _states_given(self) -> tuple[InitialState, ...]:
        return self.initial  # type: ignore[return-value]  # likewise

    @property
    def free(self) -> tuple[Parameter, ...]:
        """Parameters that are estimated."""
        return tuple(one for one in self.named if not one.fixed)

    @property
    def fixed(self) -> tuple[Parameter, ...]:
        """Parameters that are known."""
        return tuple(one for one in self.named if one.fixed)

    @property
    def by_case(self) -> tuple[Parameter, ...]:
        """Parameters that are estimated for each case."""
        return tuple(one for one in self.named if one.per)

    @property
    def grouped(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """Cases of several records, and the records."""
        return self.cases  # type: ignore[return-value]  # brought into this form when it was made

    @property
    def names_records(self) -> bool:
        """Whether a fit depends on what its records are called."""
        return bool(self.by_case)

    @property
    def learns_start(self) -> bool:
        """Whether ``initial`` says of a state where it begins."""
        return bool(self.initial)

    @property
    def begins(self) -> dict[str, InitialState]:
        """By state, and by what is read later, what is known of it before the first sample."""
        return {one.name: one for one in self._states_given}

    @property
    def points(self) -> dict[str, tuple[tuple[float, float], ...]]:
        """By table its points."""
        return dict(self.tables)

    def moving(self, inputs: Sequence[str]) -> tuple[bool, ...]:
        """By input, whether it goes straight from sample to sample; it is held otherwise."""
        return moving(self.intersample, inputs)  # type: ignore[arg-type]  # in this form when it was made

    @property
    def system(self) -> System:
        """The equations, read."""
        return _system(self.equations, tuple(one.name for one in self.named), tuple(self.points))

    @property
    def label(self) -> str:
        """States and estimated parameters, weights of networks, and ``foh``: ``GreyBox 2/5+41 foh``."""
        weights = lowered(self, self.system.others, (), None).n_weights
        size = f"{len(self.system.states)}/{len(self.free)}{f'+{weights}' if weights else ''}"
        return f"{self.kind} {size}{marked(self.intersample)}"  # type: ignore[arg-type]  # brought into this form

    def for_outputs(self, n_outputs: int) -> GreyBox:
        """The same equations of several outputs, where there are several: they share states and parameters."""
        if n_outputs == 1 or self.several_outputs:
            return self
        return VectorGreyBox(**{one.name: getattr(self, one.name) for one in fields(self)})

    def check_mapping(self, mapping: Mapping) -> None:
        """Refuse a mapping whose inputs or outputs the equations do not know."""
        self.system.check_names(mapping.inputs, mapping.outputs)

    def check_records(self, fitted: Sequence[str], run: Sequence[str], start: Start) -> None:
        """Refuse records that would be run with another case's values; see the base class."""
        if not self.by_case:
            return
        cases = cases_among(fitted, self.grouped)
        if start.kind in {StartKind.REST, StartKind.FIRST_SAMPLE}:
            for record in run:
                if case_of(record, self.grouped) not in cases:
                    raise unknown_case([one.name for one in self.by_case], cases, record)

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        found: dict[str, Any] = {
            "kind": self.kind,
            "equations": self.equations,
            "parameters": {one.name: one.to_dict() for one in self.named},
            "initial": {one.name: one.to_dict() for one in self._states_given},
            "tables": {name: [list(point) for point in points] for name, points in self.points.items()},
            "substeps": self.substeps,
            "solver": self.solver,
        }
        if self.cases:
            found["cases"] = {name: list(records) for name, records in self.grouped}
        found |= to_fields(self.intersample)  # type: ignore[arg-type]  # in this form when it was made
        return found if self.intervals == WALD else found | {"intervals": self.intervals}


@dataclass(frozen=True, kw_only=True)
class VectorGreyBox(GreyBox):
    """The same of several outputs, each of which counts over what is left of it."""

    kind = "VectorGreyBox"
    several_outputs = True


@lru_cache(maxsize=64)
def _system(text: str, parameters: tuple[str, ...], tables: tuple[str, ...]) -> System:
    return System.read(text, parameters, tables)


@lru_cache(maxsize=64)
def lowered(
    structure: GreyBox,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    sample_time: float | None,
    solver: str = RUNGE_KUTTA,
) -> Lowered:
    """The programs of a grey box.

    Args:
        structure: The grey box.
        inputs: Channels that go in.
        outputs: Channels that come out.
        sample_time: Seconds; ``None`` to see whether there are such programs.
        solver: How states with a rate go on.

    Returns:
        The programs.

    Raises:
        ConfigError: With line and column, of what cannot be lowered.
    """
    terms = Terms(
        inputs=inputs,
        outputs=outputs,
        sample_time=sample_time,
        free=tuple(one.name for one in structure.free),
        fixed=tuple(one.name for one in structure.fixed),
        tables=structure.points,
        solver=solver,
        moving=structure.moving(inputs),
    )
    return lower(structure.system, terms)


def _tables(given: Any) -> tuple[Table, ...]:
    """Tables from what people write."""
    pairs = list(given.items()) if isinstance(given, Dict) else given
    if not isinstance(pairs, list | tuple) or not all(isinstance(one, list | tuple) and len(one) == 2 for one in pairs):
        raise ConfigError(
            "not tables", where="tables", expected="names with points [[x, y], ...]", got=shortened(given),
            remedy="write for example {valve: [[0, 0], [1, 0.4], [2, 1]]}",
        )  # fmt: skip
    found: list[Table] = []
    for name, points in pairs:
        rows = (
            [point for point in points if isinstance(point, list | tuple) and len(point) == 2]
            if isinstance(points, list | tuple)
            else []
        )
        numbers = [tuple(real(value) for value in row) for row in rows]
        rising = all(a[0] < b[0] for a, b in pairwise(numbers))
        if len(numbers) < 2 or len(numbers) != len(points) or not rising or not all(map(_finite, numbers)):
            raise ConfigError(
                f"{name} is no table", where="tables", expected="points [[x, y], ...], at least two, x rising",
                got=shortened(points), remedy="write for example valve: [[0, 0], [1, 0.4], [2, 1]]",
            )  # fmt: skip
        found.append((str(name), tuple(numbers)))  # type: ignore[arg-type]  # pairs, by the check above
    if sum(len(points) for _, points in found) > MOST_POINTS:
        raise ConfigError(
            "too many points", where="tables", expected=f"at most {MOST_POINTS:,}", remedy="thin them out"
        )
    return tuple(found)


def _finite(values: Sequence[float]) -> bool:
    return all(math.isfinite(value) for value in values)
