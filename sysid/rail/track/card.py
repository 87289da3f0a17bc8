"""The track card: what the driver's timetable card holds about the line, section by section, and how it is read ahead.

After "A train operation control apparatus": rows of section code, distance, information code and value.
"""

from __future__ import annotations

import csv
import enum
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sysid.errors import ConfigError, ReaderError
from sysid.rail.constants import KMH
from sysid.rail.dynamics.track import STRAIGHT, TrackProfile

LONGEST_SECTION = 500e3
"""In m from a station: what lies farther was written in metres."""

HEADER = ("section", "distance_km", "code", "value")
"""Columns of the file."""


class CardCode(enum.Enum):
    """What a row of the card is about; the value is what stands on the card."""

    GRADE = "GRADE"
    """Per mille, positive uphill."""
    CURVE = "CURVE"
    """Radius in m; 99999 is straight track."""
    LIMIT = "SPEED LIM"
    """Km/h."""


@dataclass(frozen=True, kw_only=True)
class CardRow:
    """One row.

    Args:
        section: Code of the section, that of its first station.
        distance: From that station in m (the file has km).
        code: What the row is about.
        value: In the unit of its code.
    """

    section: str
    distance: float
    code: CardCode
    value: float


@dataclass(frozen=True, kw_only=True)
class TrackCard:
    """A card.

    Args:
        rows: In the order of the line.

    Raises:
        ConfigError: If distances of one code fall within a section, or a value cannot be.

    Example:
        >>> row = CardRow(section="A", distance=100.0, code=CardCode.GRADE, value=-20.0)
        >>> card = TrackCard(rows=(row,))
        >>> card.sections, card.profile("A").grade(150.0).tolist()
        (('A',), -0.02)
    """

    rows: tuple[CardRow, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", tuple(self.rows))
        last: dict[tuple[str, CardCode], float] = {}
        for number, row in enumerate(self.rows, start=1):
            place = (row.section, row.code)
            if row.distance <= last.get(place, -1.0):
                raise _wrong(number, "the distances of a section do not increase", "increasing distances", row.distance)
            last[place] = row.distance
            if row.distance > LONGEST_SECTION:
                raise _wrong(
                    number, "a section is longer than any line", "distances in km from its first station",
                    f"{row.distance / 1000.0:g} km",
                )  # fmt: skip
            if row.code is not CardCode.GRADE and row.value <= 0.0:
                raise _wrong(number, f"a {row.code.value} is not positive", "a radius in m or km/h above 0", row.value)

    @property
    def sections(self) -> tuple[str, ...]:
        """Codes of the sections, in order."""
        return tuple(dict.fromkeys(row.section for row in self.rows))

    def section(self, code: str) -> tuple[CardRow, ...]:
        """The rows that are read when the train departs from a station.

        Args:
            code: Of the section.

        Returns:
            Its rows.

        Raises:
            ConfigError: If there is no such section.
        """
        found = tuple(row for row in self.rows if row.section == code)
        if not found:
            raise ConfigError.unknown(
                f"the card has no section {code}", code, self.sections, "name one of these", where="track card"
            )
        return found

    def profile(self, code: str) -> TrackProfile:
        """The section's track, positions in m from its first station."""
        return _profile_of(self.section(code), name=f"section {code}")


def _wrong(number: int, what: str, expected: str, got: object) -> ConfigError:
    return ConfigError(what, where=f"track card, row {number}", expected=expected, got=got, remedy="correct the row")


def _profile_of(rows: Sequence[CardRow], *, name: str) -> TrackProfile:
    """The track that rows of one section describe; what no row tells is level, straight and without limit."""
    picked = {code: [(row.distance, row.value) for row in rows if row.code is code] for code in CardCode}
    return TrackProfile.from_steps(
        name,
        grade=[(x, value / 1000.0) for x, value in picked[CardCode.GRADE]] or ((0.0, 0.0),),
        curvature=[(x, 0.0 if radius >= STRAIGHT else 1.0 / radius) for x, radius in picked[CardCode.CURVE]],
        speed_limit=[(x, value * KMH) for x, value in picked[CardCode.LIMIT]],
    )


def read_card(path: Path) -> TrackCard:
    """Read a card.

    Args:
        path: CSV with the columns ``section,distance_km,code,value``.

    Returns:
        The card.

    Raises:
        ReaderError: If the file cannot be read as a card.
        ConfigError: If its rows make no card.
    """
    try:
        lines = list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError) as error:
        raise ReaderError("the card cannot be read", where=path, expected="a CSV file in UTF-8", got=error) from error
    if not lines or tuple(cell.strip() for cell in lines[0]) != HEADER:
        raise ReaderError(
            "this is no track card",
            where=path,
            expected=",".join(HEADER),
            got=",".join(lines[0]) if lines else "nothing",
        )
    if not any(lines[1:]):
        raise ReaderError(
            "the card has no rows", where=path, expected=f"rows of {','.join(HEADER)}", got="a header alone"
        )
    return TrackCard(
        rows=tuple(_row(cells, f"{path}, line {k}") for k, cells in enumerate(lines[1:], start=2) if cells)
    )


def _row(cells: list[str], where: str) -> CardRow:
    try:
        section, distance, code, value = (cell.strip() for cell in cells)
        # Rounded to millimetres: the product with 1000 is not exact.
        return CardRow(
            section=section, distance=round(float(distance) * 1000.0, 3), code=CardCode(code), value=float(value)
        )
    except ValueError as error:
        raise ReaderError(
            "a row of the card cannot be read",
            where=where,
            expected=f"section, km, one of {', '.join(code.value for code in CardCode)}, number",
            got=",".join(cells),
            remedy=str(error),
        ) from None


class CardReader:
    """Reads a section of a card as the train goes: a row is known once the train is ``offset`` before it.

    Args:
        card: The card.
        section: The section that the train departs into.
        offset: How far ahead in m.

    Raises:
        ConfigError: If the card has no such section.
    """

    def __init__(self, card: TrackCard, section: str, *, offset: float) -> None:
        self._left = sorted(card.section(section), key=lambda row: row.distance)
        self._known: list[CardRow] = []
        self._name = f"section {section}, as read"
        self.offset = offset
        self.profile = _profile_of((), name=self._name)

    def read(self, travelled: float) -> tuple[CardRow, ...]:
        """Read on.

        Args:
            travelled: Distance from the station in m.

        Returns:
            The rows read now; ``profile`` is the track as known from then on.
        """
        fresh = [row for row in self._left if row.distance <= travelled + self.offset]
        if fresh:
            self._left = self._left[len(fresh) :]
            self._known += fresh
            self.profile = _profile_of(self._known, name=self._name)
        return tuple(fresh)
