"""What an error asks for, as it is written in Python: remedies are in YAML, in which most records are described."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sysid.errors import UserError
from sysid.ingest.readers.text_source import bare_stem
from sysid.ingest.tables.options import FileOptions

PAIRS = re.compile(r"\{\w+: [\w.]+(?:, \w+: [\w.]+)*\}")
PAIR = re.compile(r"(\w+): ([\w.]+)")
OPTION = re.compile(r"\b(repairs|grid): (?=\{)")


def in_python(text: str) -> str:
    """A remedy with its YAML written as Python.

    Args:
        text: The remedy.

    Returns:
        The same, where options are arguments, and what is in them is a dict.

    Example:
        >>> in_python("ask for repairs: {gaps: hold} or {gaps: mask}")
        'ask for repairs={"gaps": "hold"} or {"gaps": "mask"}'
    """
    return PAIRS.sub(lambda found: PAIR.sub(r'"\1": "\2"', found[0]), OPTION.sub(r"\1=", text))


@contextmanager
def remedies_in_python() -> Iterator[None]:
    """Errors from within say what to write in a call of :func:`sysid.data`."""
    try:
        yield
    except UserError as error:
        if error.remedy is None or in_python(error.remedy) == error.remedy:
            raise
        raise _with(error, in_python(error.remedy)) from None


@contextmanager
def remedies_of_a_file(path: Path) -> Iterator[None]:
    """Errors of a file that is loaded as it is say how it gets a description, in which options can be written."""
    try:
        yield
    except UserError as error:
        described = (
            f"describe the file once ({proposal_of(path)}), which proposes these options, and load({bare_stem(path)!r})"
        )
        raise _with(error, f"{error.remedy}. A file alone takes no options: {described}") from None


def typed_options(error: UserError, path: Path) -> UserError:
    """The error of a file for which no description can be proposed as it is: where its remedy is typed.

    Args:
        error: It, with a remedy that may name an option.
        path: The file.

    Returns:
        The same error; where the remedy names an option, with the command that takes it.
    """
    if not any(re.search(rf"\b{name}\b[: ]", error.remedy or "") for name in FileOptions.model_fields):
        return error
    return _with(error, f"{error.remedy}. Options are typed behind {proposal_of(path)}; --help lists them")


def with_guess(error: UserError, told: str) -> UserError:
    """The error of a file whose clock was guessed, with that guess.

    Args:
        error: It.
        told: What was guessed of time; empty where nothing was.

    Returns:
        The same error; where something was guessed, the remedy names it.
    """
    return _with(error, f"{error.remedy}. Of time it was guessed: {told}") if told else error


@contextmanager
def remedies_of_a_run() -> Iterator[None]:
    """Errors of a table that a model is to run over say where its options can be written."""
    try:
        yield
    except UserError as error:
        told = "A run takes no options, but a trace that has them: sysid.data(table, ...).traces[0]"
        raise _with(error, f"{in_python(error.remedy or '')}. {told}") from None


def proposal_of(path: Path) -> str:
    """The command that describes a file as a data set.

    Args:
        path: The file.

    Returns:
        It, for a shell.
    """
    place = Path("datasets", bare_stem(path), "dataset.yaml")
    return shlex.join(("sysid", "ingest", str(path), "--propose", str(place)))


def _with(error: UserError, remedy: str) -> UserError:
    """The same error with another remedy."""
    other = type(error).__new__(type(error))
    other.__dict__.update(error.__dict__)
    UserError.__init__(other, error.what, where=error.where, expected=error.expected, got=error.got, remedy=remedy)
    return other
