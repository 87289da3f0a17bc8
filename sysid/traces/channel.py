"""A channel: a named quantity with a unit; and what a name may hold."""

from __future__ import annotations

from dataclasses import dataclass

from sysid.errors import TraceError
from sysid.units import Reference


def check_text(text: str, what: str) -> None:
    """Refuse text that is not made of whole characters: a lone surrogate, as from names of files that are no text.

    Args:
        text: Anything that somebody named.
        what: What it is, for the error.

    Raises:
        TraceError: If it cannot be written as UTF-8.
    """
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        whole = text.encode("utf-8", "replace").decode()
        raise TraceError(
            f"{what} holds half a character, which no file can hold", where=ascii(text),
            expected="text that can be written as UTF-8", got=ascii(text),
            remedy=f"name it in whole characters, for example {whole!r}",
        ) from None  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Channel:
    """A named quantity.

    Args:
        name: Short name, unique in its trace (``"BP"``).
        unit: A unit known to pint (``"psi"``); ``"1"`` for a pure number.
        reference: For pressures, what they are measured from.
        description: What it is, for people.

    Raises:
        TraceError: If a text holds half a character, which no file can be written with.
    """

    name: str
    unit: str
    reference: Reference = Reference.NONE
    description: str = ""

    def __post_init__(self) -> None:
        for what, text in (("name", self.name), ("unit", self.unit), ("description", self.description)):
            check_text(text, f"the {what} of a channel")

    @property
    def label(self) -> str:
        """Name and unit as they stand on an axis, for example ``BP [psi gauge]``."""
        suffix = "" if self.reference is Reference.NONE else f" {self.reference.value}"
        return f"{self.name} [{self.unit}{suffix}]"
