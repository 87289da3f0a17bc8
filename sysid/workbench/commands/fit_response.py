"""``sysid fit-response``: a transfer function of a file of a frequency response, with everybody who listens to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.ingest.readers.text_source import bare_stem
from sysid.names import slug
from sysid.workbench.commands.reader_options import as_typed
from sysid.workbench.kinds import RunRequest
from sysid.workbench.listeners import perform
from sysid.workbench.responses.config import ResponseConfig
from sysid.workbench.responses.run import program_of, response_of
from sysid.workbench.responses.steps import load_response


def fit_response_command(
    source: Path,
    *,
    given: Mapping[str, Any],
    columns: Sequence[str],
    units: Sequence[str],
    reading: Mapping[str, Any],
    typed: Sequence[str],
    fresh: bool,
    out: Path | None,
    tracking: bool,
) -> int:
    """Fit a transfer function to a file and show how it came out.

    Args:
        source: The file.
        given: Fields of the pipeline; what was not typed is ``None``.
        columns: ``ROLE=NAME`` each.
        units: ``ROLE=UNIT`` each.
        reading: Options of the readers.
        typed: Every word behind the command, for that which makes the run again.
        fresh: Do everything again.
        out: The run folder.
        tracking: Whether the run is tracked.

    Returns:
        Exit code.

    Raises:
        UserError: If the file or an option cannot be used.
    """
    fields = {name: value for name, value in given.items() if value is not None}
    fields |= {"columns": _pairs(columns, "--column"), "units": _pairs(units, "--unit")}
    fields |= {"files": dict(reading)} if reading else {}
    name = f"response-{slug(bare_stem(source))}"
    config = check(
        ResponseConfig, {"kind": "response", "name": name, "data": str(source), **fields}, where="sysid fit-response"
    )
    with as_typed(whole=False):
        measured = load_response(config, Path.cwd())
    request = RunRequest(
        path=source, typed=str(source), options=_again(typed, source, out), fresh=fresh, out=out, tracking=tracking
    )  # fmt: skip
    return perform(program_of(response_of(config, load=lambda: measured), verb="fit-response"), request)


def _again(typed: Sequence[str], source: Path, out: Path | None) -> tuple[str, ...]:
    """What was typed, without the file, and without what says where results go and whether they are made anew."""
    left, words = list[str](), list(typed)
    while words:
        word = words.pop(0)
        if word == "--out":
            words.pop(0)
        elif word not in {"--fresh", "--no-tracking", f"--out={out}"}:
            left.append(word)
    left.remove(str(source))
    return tuple(left)


def _pairs(words: Sequence[str], option: str) -> dict[str, str]:
    parts = [word.partition("=") for word in words]
    wrong = next((word for word, (role, _, value) in zip(words, parts, strict=True) if not (role and value)), None)
    if wrong is not None:
        example = "gain=A" if option == "--column" else "gain=dB"
        raise ConfigError(
            f"{option} needs a pair", where=f"option {option}", expected=f"for example {example}", got=wrong,
            remedy=f"write {option} {example}",
        )  # fmt: skip
    return {role.strip(): value.strip() for role, _, value in parts}
