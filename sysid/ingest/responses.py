"""Measured frequency responses: the columns of a file or a table as complex numbers over rad/s."""

from __future__ import annotations

import itertools
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError, ReaderError
from sysid.ingest.cells.headers import unit_in_name
from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.ingest.memory.memory_table import table_of
from sysid.ingest.readers.text_source import bare_stem
from sysid.ingest.reading import read_table
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.frames import columns_by_name
from sysid.ingest.tables.gain_and_phase import Agreement, agreement
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.over_frequency import called_frequency, frequencies_in
from sysid.traces.measured_response import MeasuredResponse

Array = NDArray[np.float64]

_CALLED: Final = {
    "coherence": re.compile(r"\bcoh|\bgamma", re.IGNORECASE),
    "real": re.compile(r"\bz?re(?:al)?\b", re.IGNORECASE),
    "imaginary": re.compile(r"\bz?im(?:ag(?:inary)?)?\b", re.IGNORECASE),
    "phase": re.compile(r"\bz?ph(?:ase|i|z|s)?\b|\barg|\bangle|\bwinkel|\bfase", re.IGNORECASE),
    "gain": re.compile(
        r"\bz?mag|\bgain|\bampl|\babs|\bz?mod(?:ulus)?\b|\bbetrag|\bdb\b|\bratio\b|\bverst", re.IGNORECASE
    ),
}
"""What columns are called, the surest word first."""
_PARTNERS: Final = {"gain": "phase", "phase": "gain", "real": "imaginary", "imaginary": "real"}
ROLES: Final = ("frequency", *_CALLED, "complex")
"""What a column may hold."""
_FACTORS: Final = {
    "frequency": {"hz": 2e0 * np.pi, "khz": 2e3 * np.pi, "mhz": 2e6 * np.pi, "ghz": 2e9 * np.pi, "rad/s": 1.0},
    "phase": {"deg": np.pi / 180.0, "rad": 1.0, "-deg": -np.pi / 180.0, "-rad": -1.0},
    "gain": {"db": 0.0, "1": 1.0},
    "imaginary": {"1": 1.0, "-1": -1.0},
}
_SPELT: Final = {
    **{"°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad", "abs": "1", "-": "1"},
    **{"radians/second": "rad/s", "rad/sec": "rad/s", "hertz": "hz", "decibel": "db", "": ""},
}
_RADIANS: Final = re.compile(r"^(?:w|omega|ω|rad.*)$", re.IGNORECASE)
_TURN: Final = 2.0 * np.pi


@dataclass(frozen=True, kw_only=True, eq=False)
class _Told:
    """What is said of a response: what was guessed, of which the reader is warned, and what else is worth knowing."""

    guessed: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


def read_response(
    source: Any,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    files: FileOptions | None = None,
    name: str | None = None,
) -> MeasuredResponse:
    """Read a measured frequency response.

    Args:
        source: A file; or a frame, or a dict of columns, whose names may carry units (``"mag [dB]"``).
        columns: Which column holds what, where their names do not say it: ``frequency``, and ``gain`` and ``phase``, or
            ``real`` and ``imaginary``, or ``complex``; and ``coherence``.
        units: Of ``frequency`` (``Hz``, ``kHz``, ``MHz``, ``GHz``, ``rad/s``), ``gain`` (``dB`` or ``1``) and ``phase``
            (``deg`` or ``rad``, and ``-deg`` or ``-rad`` of lags that are positive), where the columns do not say
            them; of ``imaginary`` its sign, ``1`` or ``-1``.
        files: How a file is read.
        name: What it is called; the file's name by default.

    Returns:
        The response, its frequencies rising; rows with a blank are left out.

    Raises:
        ReaderError: If the file cannot be read, no column rises as frequencies do, or there are several responses.
        ConfigError: If ``columns`` or ``units`` do not apply.
        ChannelError: If a named column is missing.

    Warns:
        GuessedWarning: If a unit or a sign was guessed.
    """
    columns, units = dict(columns or {}), dict(units or {})
    _check_names(columns, units)
    if isinstance(source, str | Path):
        table = read_table(source, files=files)
        called, where, held = name or bare_stem(Path(source)), str(source), list(table.columns)
    else:
        named = columns_by_name(source)
        if named is None:
            raise ConfigError(
                "not a frequency response", where="source", expected="a file, a frame, or a dict of columns",
                got=type(source).__name__, remedy='give for example {"freq [Hz]": f, "mag [dB]": m, "phase [deg]": p}',
            )  # fmt: skip
        called = where = name or "response"
        held = list(table_of(dict(named), name=called, channels=[], timed=False).columns)
    chosen = _chosen(held, columns, where)
    told = _Told()
    frequency = _frequency(chosen["frequency"], units, told.guessed)
    values = _values(held, chosen, frequency=frequency, units=units, told=told, where=where)
    coherence = chosen["coherence"].values if "coherence" in chosen else None
    order = _whole_rows(frequency, values, coherence, told.remarks, where)
    for one in told.guessed:
        warnings.warn(f"{where}: guessed: {one}", GuessedWarning, stacklevel=3)
    return MeasuredResponse(
        name=called,
        frequency=frequency[order],
        values=values[order],
        coherence=None if coherence is None else coherence[order],
        notes=(*told.guessed, *told.remarks),
    )


def _check_names(columns: Mapping[str, str], units: Mapping[str, str]) -> None:
    for what, given, known in (("columns", columns, ROLES), ("units", units, tuple(_FACTORS))):
        for role in given:
            if role not in known:
                raise ConfigError.unknown(f"{what} has no {role}", role, known, f"correct {what}", where=what)


def _chosen(held: Sequence[RawColumn], columns: Mapping[str, str], where: str) -> dict[str, RawColumn]:
    """The columns by what they hold: as they were named, and else as they are called."""
    by_name = {column.name: column for column in held}
    missing = [named for named in columns.values() if named not in by_name]
    if missing:
        raise ChannelError(missing, list(by_name), where=where)
    found = {role: by_name[named] for role, named in columns.items()}
    if "frequency" not in found:
        swept = frequencies_in(held)
        likely = [swept] if swept is not None else [one for one in held if called_frequency(one)]
        if len(likely) != 1:
            raise ReaderError(
                "no column rises as the frequencies of a sweep do", where=where,
                expected="a column of frequencies, each above the one before", got=", ".join(by_name),
                remedy="name it: columns={'frequency': 'f'} (--column frequency=f)",
            )  # fmt: skip
        found["frequency"] = likely[0]
    rest = [column for column in held if column is not found["frequency"] and column.name not in columns.values()]
    partners = [_PARTNERS[role] for role in columns if role in _PARTNERS]
    for role in ("coherence", *partners) if {*_PARTNERS, "complex"} & set(columns) else ("complex", *_CALLED):
        if role in columns:
            continue
        fitting = [column for column in rest if _role(column) == role]
        if len(fitting) > 1:
            raise ReaderError(
                f"several columns may be the {role}", where=where, expected="the columns of one response",
                got=", ".join(column.name for column in fitting),
                remedy=f"name those of one: columns={{'{role}': {fitting[0].name!r}, ...}} "
                f"(--column {role}={fitting[0].name})",
            )  # fmt: skip
        found |= {role: fitting[0]} if fitting else {}
    return found


def _role(column: RawColumn) -> str:
    """What a column holds by its name and unit; empty where nothing says it."""
    if column.complex_values is not None:
        return "complex"
    if "'" in column.name:  # of an impedance Z' and Z''
        return "imaginary" if "''" in column.name else "real"
    words = re.sub(r"(?<=[a-z])(?=[A-Z])|[_\W\d]+", " ", column.name)
    unit = _spelt(column.unit or unit_in_name(column.name) or "")
    by_unit = {"deg": "phase", "rad": "phase", "db": "gain"}.get(unit, "")
    return next((role for role, called in _CALLED.items() if called.search(words)), by_unit)


def _others(held: Sequence[RawColumn], chosen: Mapping[str, RawColumn]) -> str:
    """The columns of which nothing says what they hold."""
    rest = [column.name for column in held if all(column is not one for one in chosen.values())]
    return f"; and {', '.join(rest)}" if rest else ""


def _values(
    held: Sequence[RawColumn],
    chosen: Mapping[str, RawColumn],
    *,
    frequency: Array,
    units: Mapping[str, str],
    told: _Told,
    where: str,
) -> NDArray[Any]:
    """The complex numbers."""
    if "complex" in chosen:
        values = chosen["complex"].complex_values
        return chosen["complex"].values.astype(np.complex128) if values is None else values
    if {"real", "imaginary"} <= set(chosen):
        real, imaginary = chosen["real"], chosen["imaginary"]
        said = _said("imaginary", imaginary, units) if "imaginary" in units else None
        minus = imaginary.name.lstrip().startswith("-") if said is None else said == "-1"
        values = np.asarray(real.values + 1j * (-1.0 if minus else 1.0) * imaginary.values)
        if said is not None or minus:
            return values
        with np.errstate(divide="ignore", invalid="ignore"):
            found = _agreement_of(frequency, np.log(np.abs(values)), np.angle(values))
        return _turned(values, found, imaginary.name, ("imaginary", "1"), told)
    if {"gain", "phase"} <= set(chosen):
        polar = _Polar(frequency=frequency, gain=chosen["gain"], phase=chosen["phase"], units=units)
        return polar.values(told)
    lacking = next((other for role, other in _PARTNERS.items() if role in chosen), "phase, and the gain")
    raise ReaderError(
        f"the {lacking} of the response is missing",
        where=where,
        expected="gain and phase, real and imaginary part, or complex numbers",
        got=", ".join(f"{role}: {column.name}" for role, column in chosen.items()) + _others(held, chosen),
        remedy="name the columns: columns={'gain': 'A', 'phase': 'B'} (--column gain=A --column phase=B)",
    )


def _spelt(unit: str) -> str:
    word = unit.strip().lower()
    return _SPELT.get(word, word)


def _said(role: str, column: RawColumn, units: Mapping[str, str]) -> str | None:
    """The unit of a column, as it was given or as its name says it; ``None`` where nothing does."""
    known = _FACTORS[role]
    if role in units:
        word = _spelt(units[role])
        if word not in known:
            raise ConfigError.unknown(f"no such unit of {role}", units[role], known, "correct units", where="units")
        return word
    said = [column.unit or "", unit_in_name(column.name) or "", *re.split(r"[_\s/]+", column.name)]
    return next((word for word in map(_spelt, said) if word in known), None)


def _frequency(column: RawColumn, units: Mapping[str, str], notes: list[str]) -> Array:
    """In rad/s."""
    said = _said("frequency", column, units)
    if said is None:
        # An frd of MATLAB counts in rad/s unless it says another unit.
        radians = _RADIANS.match(column.name) or column.name == "Frequency"
        said, why = ("rad/s", "as it is called") if radians else ("hz", "as nothing says its unit")
        notes.append(_guess(column, "frequency", "Hz" if said == "hz" else said, why))
    return np.asarray(column.values * _FACTORS["frequency"][said])


def _guess(column: RawColumn, role: str, unit: str, why: str) -> str:
    return f"{column.name} in {unit}, {why}; units={{'{role}': ...}} (--unit {role}=...) says another"


@dataclass(frozen=True, kw_only=True, eq=False)
class _Polar:
    """Gain and phase of a file, and in which units they may be."""

    frequency: Array
    gain: RawColumn
    phase: RawColumn
    units: Mapping[str, str]

    def values(self, told: _Told) -> NDArray[Any]:
        """The complex numbers, in the units that are said, else in those in which gain and phase go together."""
        said = {role: _said(role, column, self.units) for role, column in self._columns}
        likely = {role: said[role] or _likely(role, column) for role, column in self._columns}
        negative = bool(np.any(self.gain.values < 0.0))  # of no ratio
        gains = [said["gain"]] if said["gain"] else ["db"] if negative else ["db", "1"]
        phases = [said["phase"]] if said["phase"] else ["deg", "rad"]
        fitting = [(g, p) for g, p in itertools.product(gains, phases) if self._follows(g, p)]
        known = len(fitting) == 1
        gain, phase = fitting[0] if known else (likely["gain"], likely["phase"])
        for role, unit in (("gain", gain), ("phase", phase)):
            column = dict(self._columns)[role]
            if said[role] is None:
                sure = known and (role == "phase" or not negative)
                why = "as gain and phase go together so" if sure else _WHY[unit]
                told.guessed.append(_guess(column, role, "dB" if unit == "db" else unit, why))
        told.remarks.extend(self._doubts(said, gain, phase))
        return self._signed(gain, phase, told)

    @property
    def _columns(self) -> tuple[tuple[str, RawColumn], ...]:
        return ("gain", self.gain), ("phase", self.phase)

    def _log_gain(self, unit: str) -> Array:
        values = self.gain.values
        if unit == "db":
            return np.asarray(values * np.log(10.0) / 20.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.log(values))

    def _agreement(self, gain: str, phase: str) -> Agreement | None:
        return _agreement_of(self.frequency, self._log_gain(gain), self.phase.values * _FACTORS["phase"][phase])

    def _follows(self, gain: str, phase: str) -> bool:
        found = self._agreement(gain, phase)
        return found is not None and found.follows

    def _doubts(self, said: Mapping[str, str | None], gain: str, phase: str) -> list[str]:
        """That gain and phase go together in another unit of the phase than its name says."""
        other = {"deg": "rad", "rad": "deg"}.get(phase)
        named = said["phase"] is not None and "phase" not in self.units
        if other is None or not named or self._follows(gain, phase) or not self._follows(gain, other):
            return []
        return [
            f"{self.phase.name} says {phase}, and gain and phase go together in {other}: units={{'phase': '{other}'}} "
            f"(--unit phase={other}) takes it so"
        ]

    def _signed(self, gain: str, phase: str, told: _Told) -> NDArray[Any]:
        """The numbers, their phase turned where it is a lag that is written as a positive number."""
        size = 10.0 ** (self.gain.values / 20.0) if gain == "db" else self.gain.values
        values = np.asarray(size * np.exp(1j * self.phase.values * _FACTORS["phase"][phase]))
        if "phase" in self.units:  # who says its unit says its sign
            return values
        return _turned(values, self._agreement(gain, phase), self.phase.name, ("phase", phase), told)


def _turned(
    values: NDArray[Any], found: Agreement | None, name: str, said: tuple[str, str], told: _Told
) -> NDArray[Any]:
    """The conjugate, where gain and phase go together so alone, and the gain is positive then.

    Of a negative gain an unstable pole turns the phase as a lag that is written as a positive number does.
    """
    role, unit = said
    if found is None or not found.turned:
        return values
    keeps, turns = (f"units={{'{role}': '{one}'}} (--unit {role}={one})" for one in (unit, f"-{unit}"))
    if found.opposite:
        told.remarks.append(
            f"{name} turns as that of an unstable plant, or of one whose lags are positive: {turns} turns it"
        )
        return values
    told.guessed.append(f"{name} with its sign turned, as gain and phase go together so; {keeps} keeps it")
    return np.asarray(values.conj())


def _agreement_of(frequency: Array, log_gain: Array, phase: Array) -> Agreement | None:
    """How phase and gain go together over the rows that are whole; ``None`` where they do not tell."""
    whole = np.isfinite(frequency) & np.isfinite(log_gain) & np.isfinite(phase) & (frequency > 0.0)
    rows = np.flatnonzero(whole)
    rows = rows[np.argsort(frequency[rows], kind="stable")]
    if not np.all(np.diff(frequency[rows]) > 0.0):  # several sweeps, which are refused
        return None
    return agreement(frequency[rows], log_gain[rows], phase[rows])


_WHY: Final = {
    "db": "as some are below 0",
    "1": "a ratio, as none is below 0",
    "deg": "as some are beyond a turn in rad",
    "rad": "as all are within a turn",
}
"""What speaks for a unit where gain and phase do not tell."""


def _likely(role: str, column: RawColumn) -> str:
    """The likely unit of a column of gain or phase, by its numbers alone."""
    values = column.values[np.isfinite(column.values)]
    if role == "gain":
        return "db" if len(values) > 0 and values.min() < 0.0 else "1"
    return "deg" if len(values) > 0 and float(np.abs(values).max()) > _TURN else "rad"


def _whole_rows(
    frequency: Array, values: NDArray[Any], coherence: Array | None, notes: list[str], where: str
) -> NDArray[np.intp]:
    """Rows without a blank, by rising frequency."""
    whole = np.isfinite(frequency) & np.isfinite(values)
    whole &= True if coherence is None else np.isfinite(coherence)
    kept = np.flatnonzero(whole)
    if len(kept) < len(frequency):
        notes.append(f"{len(frequency) - len(kept)} rows with a blank left out")
    rising = kept[np.argsort(frequency[kept], kind="stable")]
    if len(kept) < 2 or np.any(np.diff(frequency[rising]) == 0.0):
        raise ReaderError(
            "these are several sweeps, or none",
            where=where,
            expected="each frequency once",
            got=f"{len(kept)} rows, {len(np.unique(frequency[kept]))} frequencies",
            remedy="keep the rows of one sweep (rows: of the file, --rows 1:50), or average those that repeat one",
        )
    return rising
