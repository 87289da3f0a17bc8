"""Where results are shown; apart from those who are told of a run, so that looking into a file loads no estimation."""

from __future__ import annotations

from rich.console import Console

PIPED_WIDTH = 160
"""Columns where there is no terminal to ask: enough for a table of five cases on one line."""


def console() -> Console:
    """Where results are shown.

    Returns:
        A console on standard output.
    """
    plain = Console(highlight=False)
    return plain if plain.is_terminal else Console(highlight=False, width=PIPED_WIDTH)
