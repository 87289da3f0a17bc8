"""Every error the workbench raises on purpose, each saying what, where, expected, got and remedy.

Two families matter to a caller: a :class:`UserError` can be cured by changing the input (the command
line leaves with exit code 2), any other :class:`SysidError` is ours (exit code 1).
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Self


def shortened(value: object, limit: int = 80) -> str:
    """A value that came from outside, as an error shows it: never more than a line, whatever it is.

    Args:
        value: Anything.
        limit: Characters.

    Returns:
        Its ``repr``, cut where it is longer; the type of what has none that can be written.

    Example:
        >>> shortened("a" * 200, limit=12), shortened(10**5000)
        ("'aaaaaaaa...", 'a int that is too large to show')
    """
    try:
        text = repr(value)
    except (ValueError, RecursionError, MemoryError):  # 5,000 digits, a thousand brackets
        return f"a {type(value).__name__} that is too large to show"
    return text if len(text) <= limit else text[: limit - 3] + "..."


LEAST = 0.6
"""How alike two words are that may be meant for each other, of 1 (the usual cutoff of :mod:`difflib`)."""


def near_words(given: object, known: Iterable[str], also: Mapping[str, Sequence[str]] | None = None) -> tuple[str, ...]:
    """The known words that were probably meant; capitals, blanks and dashes make no difference.

    Args:
        given: What was written.
        known: The words that there are.
        also: What some of them are called elsewhere, in small letters without blanks and dashes.

    Returns:
        Those that are nearest, all where several are as near; else those that hold what was written, three at most.

    Example:
        >>> near_words("Fmi-3", ["onnx", "fmi2", "fmi3"]), near_words("fmi", ["onnx", "fmi2", "fmi3"])
        (('fmi3',), ('fmi2', 'fmi3'))
        >>> near_words("fmu", ["onnx", "fmi2", "fmi3"], {"fmu": ("fmi3", "fmi2")})
        ('fmi3', 'fmi2')
    """
    word, meant = _folded(given), dict[str, list[str]]()
    for one in known:
        meant.setdefault(_folded(one), []).append(one)
    for other, ones in (also or {}).items():
        meant.setdefault(other, []).extend(ones)
    if word in meant:
        return tuple(meant[word])
    ratios = {one: difflib.SequenceMatcher(None, one, word).ratio() for one in meant}
    best = max(ratios.values(), default=0.0)
    if best >= LEAST:
        return tuple(dict.fromkeys(one for key, ratio in ratios.items() if ratio == best for one in meant[key]))
    holding = [one for key, ones in meant.items() if len(word) > 1 and word in key for one in ones]
    return tuple(dict.fromkeys(holding)) if len(holding) <= 3 else ()


def did_you_mean(
    given: object, known: Iterable[str], otherwise: str, *, also: Mapping[str, Sequence[str]] | None = None
) -> str:
    """What to do about a word that is not known.

    Args:
        given: What was written.
        known: The words that there are.
        otherwise: What to do where none of them is near.
        also: What some of them are called elsewhere; see :func:`near_words`.

    Returns:
        The remedy of an error.

    Example:
        >>> did_you_mean("neuron", ["neurons", "input_delays"], "remove it")
        'did you mean neurons?'
    """
    near = near_words(given, known, also)
    return f"did you mean {' or '.join(near)}?" if near else otherwise


def _folded(word: object) -> str:
    return "".join(letter for letter in str(word).casefold() if letter not in " -_'\"")


class SysidError(Exception):
    """Root of all errors raised on purpose.

    Args:
        what: One sentence: what went wrong.
        where: File, line, channel or sample it went wrong at.
        expected: What would have been accepted.
        got: What came instead.
        remedy: What the reader can do now.

    Example:
        >>> print(SysidError("the record is empty", where="a.csv", remedy="record some samples"))
        the record is empty
          where:    a.csv
          remedy:   record some samples
    """

    exit_code = 1

    def __init__(
        self,
        what: str,
        *,
        where: object = None,
        expected: object = None,
        got: object = None,
        remedy: str | None = None,
    ) -> None:
        self.what = what
        self.where = where
        self.expected = expected
        self.got = got
        self.remedy = remedy
        details = {"where": where, "expected": expected, "got": got, "remedy": remedy}
        lines = [f"  {key + ':':<9} {value}" for key, value in details.items() if value is not None]
        super().__init__("\n".join([what, *lines]))

    @classmethod
    def unknown(
        cls,
        what: str,
        given: str,
        known: Iterable[str],
        otherwise: str,
        *,
        where: object = None,
        none: str = "",
        also: Mapping[str, Sequence[str]] | None = None,
    ) -> Self:
        """Of a word that is none of those that are known.

        Args:
            what: One sentence: what went wrong.
            given: The word.
            known: Those that there are.
            otherwise: What to do where none of them was probably meant.
            where: Where it stands.
            none: What would be accepted where nothing is known.
            also: What other words mean, as of other tools.

        Returns:
            The error, which tells what is known, and which of it was probably meant.

        Example:
            >>> print(SysidError.unknown("there is no such format", "onx", ["onnx", "c"], "correct the name"))
            there is no such format
              expected: one of onnx, c
              got:      onx
              remedy:   did you mean onnx?
        """
        names = list(known)
        expected = f"one of {', '.join(names)}" if names or not none else none
        remedy = did_you_mean(given, names, otherwise, also=also)
        return cls(what, where=where, expected=expected, got=given, remedy=remedy)


class UserError(SysidError):
    """The input can be changed so that this does not happen again."""

    exit_code = 2


class ConfigError(UserError):
    """A pipeline, data-set or option value that cannot be used as written."""


class TraceError(UserError):
    """A trace that breaks what a trace promises: uniform time, finite values, named channels."""


class UnitError(UserError):
    """A unit that is not known, or that does not measure the quantity it stands on."""


class ReaderError(UserError):
    """A file that cannot be read as the kind of file it claims to be."""


class StabilityError(UserError):
    """A time step or a coefficient table for which a simulation cannot be trusted."""


class ChannelError(UserError):
    """A channel that is asked for and not there.

    Args:
        missing: Names asked for and absent.
        available: Names that are there.
        where: The trace or file looked in.

    Example:
        >>> print(ChannelError(["BPP"], ["BP", "AR"], where="EST01"))
        missing channel BPP
          where:    EST01
          expected: one of BP, AR
          got:      BPP
          remedy:   did you mean BP?
    """

    def __init__(self, missing: Sequence[object], available: Sequence[str], *, where: object = None) -> None:
        names = tuple(map(str, missing))  # what is looked up may be anything: a number, a slice
        self.missing = names
        self.available = tuple(available)
        guesses = [near[0] for name in names if (near := near_words(name, available))]
        bring = f"name one of those that are there, or bring a channel {', '.join(names)}"
        remedy = f"did you mean {', '.join(guesses)}?" if guesses else bring
        listed = [part.strip() for name in names for part in re.split("[,+]", name)]
        if len(listed) > len(names) and set(listed) <= set(available):
            remedy = f"write {'+'.join(listed)} in a mapping, {listed} where a list of channels is asked for"
        super().__init__(
            f"missing channel {', '.join(names)}",
            where=where,
            expected=f"one of {', '.join(available)}",
            got=", ".join(names),
            remedy=remedy,
        )


class MissingExtraError(UserError):
    """An optional dependency that is not installed.

    Args:
        package: The package that could not be imported.
        extra: The name of our extra that brings it.
        purpose: What it is needed for.
    """

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        super().__init__(
            f"{purpose} needs the package {package}, which is not installed",
            expected=package,
            got="no such package in this environment",
            remedy=f'pip install "sysid-workbench[{extra}]"',
        )


class BundleError(UserError):
    """A bundle on disk that is damaged, incomplete or newer than this version can read."""


class FitDivergedError(SysidError):
    """A fit that ended without any usable model.

    Args:
        what: What happened.
        last_state: The last parameters that were finite, so that nothing is lost.
        remedy: What to try next.
    """

    def __init__(self, what: str, *, last_state: object = None, remedy: str | None = None) -> None:
        self.last_state = last_state
        super().__init__(what, remedy=remedy)


class ParityError(SysidError):
    """An exported file whose output differs from its model by more than the tolerance.

    Args:
        file: The file that was checked.
        case: The case with the largest difference.
        difference: The largest absolute difference, in the output's unit.
        tolerance: What was allowed, in the same unit.
        unit: The output's unit.
        coarse: Whether the file computes in float32, whose rounding a model may make too much of.
        grown: How many times larger the model makes a difference; 0 where that is not the reason.
        searched: Whether the file itself searched for the state in which it begins.

    ``summary`` says it in one sentence.
    """

    def __init__(
        self,
        file: str,
        case: str,
        difference: float,
        tolerance: float,
        unit: str,
        *,
        coarse: bool = False,
        grown: float = 0.0,
        searched: bool = False,
    ) -> None:
        self.difference = difference
        self.tolerance = tolerance
        found = f"{difference:g} {unit} in case {case}, where {tolerance:g} are allowed"
        self.summary = f"{file} does not reproduce its model ({found})"
        super().__init__(
            f"{file} does not reproduce its model",
            where=f"case {case}",
            expected=f"a largest difference of at most {tolerance:g} {unit}",
            got=f"{difference:g} {unit}",
            remedy="nothing was published: the file finds another state at rest than the model. Say where states of "
            "its equations are at rest (initial), so that none is searched for"
            if searched
            else f"nothing was published: this model makes {grown:.2g} times as much of a difference in the last "
            "digit, which no two programs round alike. Fit fewer states, train it longer or on more data, fit the free "
            "run (noise: false), or leave out an output that is made of others"
            if grown
            else "nothing was published: a model may make more of rounding to float32 than is allowed. Leave this "
            "format out (those in float64 are exact), allow more (tolerance), or fit a model that forgets faster"
            if coarse
            else "the file was not published; please report this with the bundle's model.json",
        )
