"""A trace set: traces of the same channels and sample time, and what each may be used for."""

from __future__ import annotations

import enum
import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np

from sysid.errors import ConfigError, TraceError, did_you_mean
from sysid.traces.channel import Channel
from sysid.traces.trace import Trace


class Role(enum.Enum):
    """What a trace may be used for. Scores on a trace count only if nothing was chosen on it."""

    ESTIMATION = "estimation"
    SELECTION = "selection"
    VALIDATION = "validation"
    TEST = "test"


class Roles(dict[str, Role]):
    """Roles by name that stay as they are: a set of traces is what its digest says. With ``|`` others are made."""

    def __reduce__(self) -> tuple[type[Roles], tuple[dict[str, Role]]]:
        return Roles, (dict(self),)

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TraceError(
            "the roles of a trace set stay as they are",
            expected="another set with other roles",
            got="a change of its roles",
            remedy='write dataclasses.replace(traces, roles=traces.roles | {"A": Role.TEST})',
        )

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse


@dataclass(frozen=True, kw_only=True, eq=False)
class TraceSet:
    """Named traces with a role each.

    Args:
        name: Name of the data set.
        traces: The experiments; all share sample time and channels.
        roles: Role of each trace, by name; those not named are for validation.
        source: How the traces came to be, for people (a command, a file, a rig).

    Raises:
        TraceError: If names repeat, a role names no trace, or sample times or channels differ.
    """

    name: str
    traces: tuple[Trace, ...]
    roles: Mapping[str, Role] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "traces", tuple(self.traces))
        roles = {t.name: self.roles.get(t.name, Role.VALIDATION) for t in self.traces} | dict(self.roles)
        object.__setattr__(self, "roles", Roles(roles))
        if not self.traces:
            raise TraceError("the trace set is empty", where=f"data set {self.name}", remedy="give at least one trace")
        names = self.names
        if len(set(names)) != len(names):
            raise TraceError(
                "two traces have the same name",
                where=f"data set {self.name}",
                expected="a different name for each trace",
                got=", ".join(names),
                remedy="rename one of them",
            )
        strangers = sorted(set(self.roles) - set(names))
        if strangers:
            raise TraceError(
                f"a role is given to {', '.join(strangers)}, which is not in the set",
                where=f"data set {self.name}",
                expected=f"one of {', '.join(names)}",
                got=", ".join(strangers),
                remedy=did_you_mean(strangers[0], names, "correct the name in roles"),
            )
        first = self.traces[0]
        for trace in self.traces[1:]:
            self._check_alike(first, trace)

    def _check_alike(self, first: Trace, other: Trace) -> None:
        if not np.isclose(first.sample_time, other.sample_time, rtol=1e-9, atol=0.0):
            raise TraceError(
                "the traces have different sample times",
                where=f"data set {self.name}, trace {other.name}",
                expected=f"{first.sample_time:g} s as in {first.name}",
                got=f"{other.sample_time:g} s",
                remedy="resample them to one sample time at ingest",
            )
        ours, theirs = ([(c.name, c.unit, c.reference) for c in t.channels] for t in (first, other))
        if ours != theirs:
            raise TraceError(
                "the traces have different channels",
                where=f"data set {self.name}, trace {other.name}",
                expected=", ".join(channel.label for channel in first.channels),
                got=", ".join(channel.label for channel in other.channels),
                remedy="choose the same channels, in the same units, for every trace",
            )

    def __len__(self) -> int:
        return len(self.traces)

    def __repr__(self) -> str:
        first, samples = self.traces[0], sum(map(len, self.traces))
        roles = ", ".join(f"{len(ours)} {role.value}" for role in Role if (ours := self.with_role(role)))
        channels = ", ".join(channel.label for channel in first.channels)
        return f"<TraceSet {self.name}: {roles}; {samples:,} samples of {first.sample_time:g} s; {channels}>"

    def __iter__(self) -> Iterator[Trace]:
        return iter(self.traces)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> Trace:
        for trace in self.traces:
            if trace.name == name:
                return trace
        raise TraceError.unknown(
            f"no trace named {name}", name, self.names, "correct the name of the case", where=f"data set {self.name}"
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the traces, in order."""
        return tuple(trace.name for trace in self.traces)

    @property
    def sample_time(self) -> float:
        """Seconds between samples, the same for every trace."""
        return self.traces[0].sample_time

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels that every trace has."""
        return self.traces[0].channels

    @property
    def digest(self) -> str:
        """SHA-256 over names, roles and the digests of the traces."""
        parts = [[t.name, self.roles[t.name].value, t.digest] for t in self.traces]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()

    @property
    def shared(self) -> tuple[tuple[str, str], ...]:
        """Cases that choose or are scored and have samples of one that is fitted, with the name of that one.

        Found where both have the same values at the same times, be it by a copy or by two cuts of one record.
        """
        fitted = self.with_role(Role.ESTIMATION)
        scored = self.with_role(Role.SELECTION, Role.VALIDATION, Role.TEST)
        pairs = ((one, next((other for other in fitted if _share_samples(one, other)), None)) for one in scored)
        return tuple((one.name, other.name) for one, other in pairs if other is not None)

    def with_role(self, *roles: Role) -> tuple[Trace, ...]:
        """The traces that have one of these roles, in order."""
        return tuple(trace for trace in self.traces if self.roles[trace.name] in roles)

    @property
    def estimation(self) -> tuple[Trace, ...]:
        """The traces that are fitted; :class:`ConfigError` where there are none."""
        found = self.with_role(Role.ESTIMATION)
        if not found:
            raise ConfigError(
                "no trace is for estimation",
                where=f"data set {self.name}",
                expected="a case with role: estimation",
                got=", ".join(f"{name}: {role.value}" for name, role in self.roles.items()),
                remedy="give a case that role in the data set's dataset.yaml, or from Python in the roles of its "
                f"TraceSet: roles={{{self.names[0]!r}: Role.ESTIMATION}}",
            )
        return found


def _share_samples(one: Trace, other: Trace) -> bool:
    """Whether two records have the same values where their times overlap, and these are no constants."""
    later = round((other.start_time - one.start_time) / one.sample_time)
    mine, theirs = one.values[max(later, 0) :], other.values[max(-later, 0) :]
    n = min(len(mine), len(theirs))
    return n > 1 and np.array_equal(mine[:n], theirs[:n]) and bool((np.ptp(mine[:n], axis=0) > 0.0).any())
