"""What a surrogate is asked for by: a reference with what is said beside it, or a pipeline; the same at every door."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TypeVar

from sysid.errors import ConfigError
from sysid.ingest.cells.headers import parse_header
from sysid.names import slug
from sysid.references.described import Wish
from sysid.references.sources import KINDS, TABLES, source_of
from sysid.workbench.fits.config import find_pipeline
from sysid.workbench.runner.events import Watcher
from sysid.workbench.surrogates.make import Made, make_surrogate
from sysid.workbench.surrogates.plan import guesses_of, written
from sysid.workbench.surrogates.work import Perform
from sysid.yaml_files import read_yaml

T = TypeVar("T")
Ranges = Iterable[tuple[str, Sequence[float]]]
WORKERS = 2
"""Processes that run a reference where nobody says how many."""


def wish_of(
    ranges: Ranges, parameters: Ranges, outputs: Iterable[str], *, sample_time: float | None, duration: float | None
) -> Wish:
    """What is said beside a reference.

    Args:
        ranges: Of inputs: names, as ``valve`` or ``valve [V]``, with the least and the greatest value.
        parameters: The same of parameters that vary.
        outputs: Names of outputs, with or without a unit.
        sample_time: Seconds.
        duration: Seconds of an experiment.

    Returns:
        It, by name.

    Raises:
        ConfigError: If a range is none, or a name is said twice.

    Example:
        >>> found = wish_of([("u [V]", (0, 2))], [], ["y"], sample_time=0.5, duration=20.0)
        >>> found.ranges, found.units
        ({'u': (0.0, 2.0)}, {'u': {'unit': 'V'}})
    """
    inputs, varied = _spans(ranges, "--range"), _spans(parameters, "--parameter")
    given = _by_name(((one, None) for one in outputs), "--output")
    units = {name: unit for some in (given, inputs, varied) for name, (_, unit) in some.items()}
    return Wish(
        ranges={name: span for name, (span, _) in inputs.items()},
        parameters={name: span for name, (span, _) in varied.items()},
        outputs=tuple(given), units={name: unit for name, unit in units.items() if unit},
        sample_time=sample_time, duration=duration,
    )  # fmt: skip


def _spans(said: Ranges, flag: str) -> dict[str, tuple[tuple[float, float], dict[str, str]]]:
    found = {}
    for name, (span, unit) in _by_name(said, flag).items():
        try:
            low, high = (float(one) for one in span)
        except (TypeError, ValueError):
            low = high = float("nan")
        if not low < high or not isfinite(high - low):
            raise no_range(flag, f"{name}={span}")
        found[name] = (low, high), unit
    return found


def _by_name(said: Iterable[tuple[str, T]], flag: str) -> dict[str, tuple[T, dict[str, str]]]:
    found: dict[str, tuple[T, dict[str, str]]] = {}
    for text, value in said:
        name, unit = named(text)
        if name in found:
            raise ConfigError(
                f"{flag} {name} is said twice", where=flag, expected="each name once", got=text,
                remedy="leave one of the two out",
            )  # fmt: skip
        found[name] = value, unit
    return found


def pairs(options: Sequence[str], flag: str) -> list[tuple[str, tuple[float, float]]]:
    """Ranges as they are typed, ``NAME=LOW:HIGH`` or ``NAME [UNIT]=LOW:HIGH``.

    Args:
        options: As typed.
        flag: For errors.

    Returns:
        Names, as typed, and ranges.

    Raises:
        ConfigError: If one is not of that form.

    Example:
        >>> pairs(["u=0:10", "p [bar gauge]=0:5"], "--range")
        [('u', (0.0, 10.0)), ('p [bar gauge]', (0.0, 5.0))]
    """
    found = []
    for text in options:
        head, _, span = text.rpartition("=")
        try:
            low, high = (float(part) for part in span.split(":"))
        except ValueError:
            head = ""
        if not head:
            raise no_range(flag, text)
        found.append((head, (low, high)))
    return found


def no_range(flag: str, got: object) -> ConfigError:
    """What is raised of a range that is none."""
    return ConfigError(
        f"{flag} is not a range", where=flag, expected="NAME=LOW:HIGH, as valve=0:10", got=got,
        remedy="write the name, and two rising numbers",
    )  # fmt: skip


def named(text: str) -> tuple[str, dict[str, str]]:
    """A port as it is typed, ``NAME`` or ``NAME [UNIT]``, as in the header of a table.

    Args:
        text: As typed.

    Returns:
        Its name, and what is said of its unit.

    Example:
        >>> named("position [mm]"), named("x[3]")
        (('position', {'unit': 'mm'}), ('x[3]', {}))
    """
    if not text.endswith("]") or " [" not in text:
        return text, {}
    header = parse_header(text)
    told = {"unit": header.unit, "reference": None if header.reference is None else header.reference.value}
    return header.name, {name: value for name, value in told.items() if value}


def no_options(wish: Wish, where: str, what: str) -> None:
    """Refuse what is said beside a reference where there is none: it would be passed over.

    Args:
        wish: What was said.
        where: What was named in its place.
        what: Why these say nothing there.

    Raises:
        ConfigError: If something was.
    """
    said = {
        "--range": wish.ranges, "--parameter": wish.parameters, "--output": wish.outputs,
        "--sample-time": wish.sample_time, "--duration": wish.duration,
    }  # fmt: skip
    if given := [flag for flag, value in said.items() if value]:
        raise ConfigError(
            what, where=where, expected="such options beside a reference alone", got=", ".join(given),
            remedy="leave them out; a pipeline of kind experiment has them as fields",
        )  # fmt: skip


def surrogate_of(
    source: object,
    wish: Wish,
    out: Path | None,
    *,
    perform: Perform,
    minutes: float,
    proof: int | None,
    rounds: int | None,
    workers: int | None,
    seed: int,
    iterations: int | None = None,
    began: float | None = None,
    say: Callable[[str], None] = lambda _: None,
    watch: Watcher = lambda _: None,
) -> Made:
    """Make a surrogate of what is named, which is code, and is run.

    Args:
        source: A reference, as :func:`~sysid.references.sources.source_of` takes it, or a pipeline of kind
            ``experiment``.
        wish: What is said beside a reference.
        out: Folder of the results; ``runs/surrogate-<name>`` by default.
        perform: Carries a program out.
        minutes: Time for all.
        proof: New experiments.
        rounds: Rounds of added experiments, in place of those of the pipeline.
        workers: Processes; as the pipeline says, and two of a reference, by default.
        seed: Of everything random.
        iterations: In place of the search's time.
        began: When the time began, by ``time.monotonic``; now by default.
        say: Told what is run, what was taken from where, and what makes a surrogate wrong.
        watch: Told how the proof goes.

    Returns:
        The surrogate.

    Raises:
        UserError: If the reference or the pipeline cannot be used, or does not say enough.
    """
    began = time.monotonic() if began is None else began
    if not isinstance(source, str | os.PathLike):
        raise ConfigError(
            "a reference is named, not given", where="the reference", expected=KINDS, got=type(source).__name__,
            remedy="write it to a file and say file.py:function: other processes run it, which import it from there",
        )  # fmt: skip
    text = os.fspath(source)
    pipeline, notes = _pipeline_of(text), list[str]()
    reference = None if pipeline is not None else source_of(text)
    if reference is None:
        no_options(wish, text, "a pipeline says its ports and times itself")
    folder = out or Path("runs") / f"surrogate-{slug(Path(text).stem if reference is None else reference.name)}"
    say(f"{text} is code and is run with your rights.")
    if reference is not None:
        pipeline, notes = written(reference, wish, folder, minutes=minutes, workers=workers or WORKERS, seed=seed)
        say(f"Proposed: {pipeline}; change it and run this again to have it otherwise.")
    assert pipeline is not None  # noqa: S101 - found, or written now
    for note in notes:
        say(f"  {note}")
    made = make_surrogate(
        pipeline, folder, perform=perform, minutes=minutes, proof=proof, iterations=iterations, rounds=rounds,
        workers=workers, seed=seed, began=began, say=say, watch=watch,
    )  # fmt: skip
    # It holds there alone, and whoever reads the end alone has to know it.
    guesses = guesses_of(pipeline) if reference is not None else []
    return replace(made, proposed=tuple(notes), notes=[*made.notes, *guesses])


def _pipeline_of(source: str) -> Path | None:
    """The pipeline that a source names; nothing where that is a reference, or a file that says less than a pipeline."""
    file = Path(source)
    if file.suffix.lower() in TABLES and file.is_file():
        return file if "kind" in read_yaml(file) else None
    words = len(source.split()) > 1 or ":" in source or file.suffix.lower() in {".fmu", ".py"}
    return None if words or file.is_file() else find_pipeline(source)
