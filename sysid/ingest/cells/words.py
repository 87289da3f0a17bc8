"""Columns of words: states that stand for numbers, by a table that is given or by themselves."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.cells.numbers import MISSING, MOST_WORDS

States = Mapping[str, float | Mapping[str, float]]
"""Numbers by word, for all columns or by the name of the column."""

TRUTH = {
    **dict.fromkeys(("true", "wahr", "vrai", "vero", "verdadero", "verdadeiro", "waar"), 1.0),
    **dict.fromkeys(("false", "falsch", "faux", "falso", "onwaar"), 0.0),
}
"""Words that are numbers without being asked: what spreadsheets write for truth, in the languages of Europe's west."""

PAIRS: tuple[dict[str, float], ...] = tuple(
    dict(zip(words.split(), (0.0, 1.0), strict=True))
    for words in (
        *(
            "off on",
            "aus ein",
            "aus an",
            "uit aan",
            "closed open",
            "closed opened",
            "close open",
            "zu auf",
            "dicht open",
            "shut open",
        ),
        *("no yes", "nein ja", "nee ja", "low high", "stop run", "stopped running", "inactive active", "idle active"),
        *("inaktiv aktiv", "deactivated activated", "unlocked locked", "absent present", ".f. .t.", "#false# #true#"),
        *("disabled enabled", "released applied", "released pressed", "f t", "n y"),
        *("down up", "ok alarm", "normal alarm", "ok fault", "manual auto", "ok nok"),
        *("non oui", "fermé ouvert", "fermée ouverte", "ferme ouvert", "arrêt marche", "arret marche", "éteint allumé"),
        *("spento acceso", "chiuso aperto", "no si", "no sì"),
        *("apagado encendido", "cerrado abierto", "cerrada abierta", "no sí"),
        *("desligado ligado", "fechado aberto", "fechada aberta", "não sim"),
        *("av på", "fra til", "stängd öppen", "lukket åpen", "lukket åben", "nej ja", "nei ja", "ei kyllä"),
        *("wyłączony włączony", "wył zał", "zamknięty otwarty", "nie tak", "vypnuto zapnuto", "ne ano"),
        *("kapalı açık", "hayır evet", "выкл вкл", "закрыт открыт", "закрыто открыто", "нет да"),
        *("关 开", "关闭 打开", "關 開", "停止 运行", "停止 運転", "オフ オン", "切 入", "閉 開", "否 是"),
    )
)
"""States that are known: proposed as numbers, to be checked."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Words:
    """A column of texts of which there are few.

    Args:
        codes: Shape ``(n_rows,)``: place of each row's text in ``texts``; -1 where there is none.
        texts: The different texts, in the order in which they come.
        complete: Whether ``texts`` are all; a column of remarks has too many to keep.
    """

    codes: NDArray[np.int32]
    texts: tuple[str, ...]
    complete: bool = True

    def values(self, states: Mapping[str, float]) -> NDArray[np.float64] | None:
        """The numbers that the texts stand for.

        Args:
            states: The number of each text.

        Returns:
            Shape ``(n_rows,)``, NaN where there is no text; ``None`` if a text has no number.
        """
        if not self.complete or not self.texts:
            return None
        table = dict(states) if not _truth(self.texts) else {**{t: TRUTH[t.casefold()] for t in self.texts}, **states}
        numbers = [table.get(text, _number(text)) for text in self.texts]
        if None in numbers:
            return None
        column: NDArray[np.float64] = np.array([*numbers, np.nan], dtype=np.float64)[self.codes]
        return column

    def problem(self, where: str) -> ReaderError:
        """Why the column cannot be used as it is.

        Args:
            where: File and column.

        Returns:
            The error to raise when it is asked for.
        """
        shown = ", ".join(f"{text[:30]!r}" for text in self.texts[:6])
        shown = shown if len(self.texts) <= 6 else f"{shown} and {len(self.texts) - 6} more"
        if self._are_stamps():
            return ReaderError(
                UNKNOWN_DATES,
                where=where,
                expected="ISO 8601 (2024-05-01 10:00:00.5), or a pattern",
                got=shown,
                remedy="if it is the time, give its pattern as for datetime.strptime: "
                "time: {column: ..., unit: datetime, format: '%d.%m.%Y %H:%M:%S.%f'}",
            )
        if not self.complete:
            return ReaderError(
                "the column holds remarks, no numbers",
                where=where,
                expected="numbers, or few different words",
                got=f"more than {MOST_WORDS} different texts, the first: {self.texts[0][:40]!r}",
                remedy="leave the column out",
            )
        if len(self.texts) == 1 and not any(map(str.isalnum, self.texts[0])):
            return ReaderError(
                "the column holds one mark and no values",
                where=where,
                expected="numbers, or words",
                got=f"{self.texts[0][:30]!r} in every row that has something",
                remedy="leave the column out",
            )
        # The one that stands for nothing is 0, whichever came first.
        ordered = sorted(self.texts[:6], key=lambda text: text.casefold() not in NOTHING)
        table = ", ".join(f"{quoted(text)}: {index}" for index, text in enumerate(ordered))
        return ReaderError(
            "the column holds words",
            where=where,
            expected="numbers, or a number for each word",
            got=shown,
            remedy=f"say what they stand for: states: {{{table}}}"
            + (", and so on for each word" if len(self.texts) > 6 else "")
            + f"; if one stands for a missing value, write missing: [{quoted(self.texts[0])}]",
        )

    def _are_stamps(self) -> bool:
        """Whether texts are dates or times in some form: of few words each has digits, of many also marks between.

        What is the same in every row, or numbers that begin with a letter, are those of a station or a device.
        """
        digits = all(sum(map(str.isdigit, text)) >= _DIGITS_OF_STAMPS for text in self.texts)
        stamps = [bool(_STAMP.search(text)) for text in self.texts]
        few = self.complete and len(self.texts) > 1
        if all(map(_VECTOR.fullmatch, self.texts)):
            return False
        return digits and (all(stamps) or (few and all(text[:1].isdigit() for text in self.texts)))


NOTHING = {"shut", "closed", *(word for pair in (TRUTH, *PAIRS) for word, number in pair.items() if not number)}
"""Words that stand for 0 beside their opposites."""

UNKNOWN_DATES = "the column holds dates or times in a form that is not known"

_STAMP = re.compile(r"[0-9]{1,4}[-./:_ TthH]+[0-9]{1,2}")
_VECTOR = re.compile(r"[+-]?[0-9]+\.[0-9]+(?:[ ,;|]+[+-]?[0-9]+\.[0-9]+)+")
"""Several numbers with decimals in one cell, as loggers write what a sensor has several of."""
_DIGITS_OF_STAMPS = 4
"""So many digits in every text are a date or a time, or none that states have."""


def quoted(text: str) -> str:
    """A text as YAML and the command line read it back.

    Args:
        text: A word.

    Returns:
        The word in quotes: YAML takes a bare ON for a truth value.
    """
    return "'" + text.replace("'", "''") + "'"


class WordCollector:
    """A column of texts that is read block by block."""

    def __init__(self, missing: Sequence[str] = ()) -> None:
        self._missing = {*MISSING, *missing}
        self._places: dict[str, int] = {}
        self._parts: list[NDArray[np.int32]] = []
        self._complete = True

    def add(self, cells: Sequence[str]) -> None:
        """Take a block of cells.

        Args:
            cells: Their texts.
        """
        self._parts.append(np.fromiter(map(self._place, cells), dtype=np.int32, count=len(cells)))

    def add_coded(self, codes: NDArray[np.int32], texts: Sequence[str]) -> None:
        """Take a block of cells that are coded already.

        Args:
            codes: Place of each in ``texts``; -1 where there is none.
            texts: The different texts.
        """
        table = np.array([*map(self._place, texts), -1], dtype=np.int32)
        self._parts.append(table[codes])

    def _place(self, cell: str) -> int:
        text = cell.strip()
        if text in self._places:
            return self._places[text]
        if text.casefold() in self._missing or text in self._missing:
            return -1
        if len(self._places) >= MOST_WORDS:
            self._complete = False
            return -1
        return self._places.setdefault(text, len(self._places))

    def finish(self) -> Words:
        """The whole column."""
        codes = np.concatenate(self._parts) if self._parts else np.zeros(0, dtype=np.int32)
        return Words(codes=codes, texts=tuple(self._places), complete=self._complete)


def states_for(states: States, column: str) -> dict[str, float]:
    """The table of one column.

    Args:
        states: As in the options.
        column: Name of the column.

    Returns:
        Numbers by word; what is given for the column goes before what is given for all.
    """
    own = states.get(column)
    common = {word: value for word, value in states.items() if not isinstance(value, Mapping)}
    return {**common, **own} if isinstance(own, Mapping) else common


def known_states(texts: Sequence[str]) -> dict[str, float] | None:
    """The numbers of states that are known.

    Args:
        texts: The different texts of a column.

    Returns:
        Numbers by text, or ``None`` if the texts are not a known pair, or one of a pair.
    """
    plain = {text: _folded(text) for text in texts}
    for pair in PAIRS:
        folded = {_folded(word): number for word, number in pair.items()}
        if len(plain) > 1 and set(plain.values()) == set(folded):
            return {text: folded[plain[text]] for text in sorted(texts, key=lambda text: folded[plain[text]])}
    return None


def _folded(text: str) -> str:
    return text.casefold().replace("ı", "i")  # which is I in capitals


def _truth(texts: Sequence[str]) -> bool:
    return all(text.casefold() in TRUTH for text in texts)


def _number(text: str) -> float | None:
    try:
        return float(text) if text.replace(".", "", 1).lstrip("+-").isdecimal() and text.isascii() else None
    except ValueError:
        return None
