"""Annotators: what says in which state each sample of a trace is."""

from __future__ import annotations

from typing import Protocol

from sysid.traces import Trace


class Annotator(Protocol):
    """What an annotator answers: it adds a channel of whole numbers, each of which is a state with a name."""

    @property
    def channel(self) -> str:
        """Name of the channel that it adds."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the states, by their number."""

    def __call__(self, trace: Trace) -> Trace:
        """The trace with the channel added."""
