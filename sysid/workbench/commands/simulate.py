"""``sysid simulate``: a bundle over a file of inputs, or over a command of a few rows."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sysid.atomic import replacing
from sysid.errors import ConfigError
from sysid.export.bundle import Bundle
from sysid.export.flags import Flag
from sysid.export.inputs import InputOptions, read_inputs
from sysid.export.reading import read_bundle
from sysid.export.simulation import Simulation, simulate_bundle
from sysid.ingest import write_trace
from sysid.ingest.reading import DESCRIPTIONS, is_file_of_traces
from sysid.models import Start
from sysid.names import distinct
from sysid.traces import Trace
from sysid.units import in_unit, squared
from sysid.validation.metrics import percent
from sysid.workbench.commands.reader_options import as_typed, reading_options
from sysid.workbench.runner.console import console
from sysid.workbench.runner.naming import meant

PICTURES = (".png", ".svg", ".pdf")
"""What a picture may end in."""


@dataclass(frozen=True, kw_only=True)
class Wish:
    """What was typed.

    Args:
        bundle: The bundle's folder or zip, or the folder of the run that exported it.
        out: The file to write, ``.csv`` or ``.parquet``; by default ``NAME.simulated.csv`` beside what is simulated.
        inputs: A file with the input channels, whose units are converted to the bundle's; or a data set's name.
        initial: The output's value before the first sample, or values by name; ``None`` is its declared level.
        start: How the run begins, as in a pipeline; ``None`` leaves it to the bundle and the file.
        constants: ``NAME=NUMBER`` of inputs that are held.
        command: A command table in place of ``inputs``.
        time_unit: Unit of the command's times, where it does not say.
        unit: Unit of the command's values, likewise.
        plot: A picture to draw; by default beside ``out`` for a command, and none for inputs.
        reading: The options of the readers, and ``repairs`` and ``grid``, as plain data.
    """

    bundle: Path
    out: Path | None = None
    inputs: Path | None = None
    initial: float | Mapping[str, float] | None = None
    start: str | None = None
    constants: Sequence[str] = ()
    command: Path | None = None
    time_unit: str | None = None
    unit: str | None = None
    plot: Path | None = None
    reading: Mapping[str, Any] = field(default_factory=dict)

    @property
    def written(self) -> Path:
        """The file to write: as was said, or beside the file that is simulated; of a data set where one is."""
        if self.out is not None:
            return self.out
        source = Path(str(self.inputs if self.command is None else self.command))
        if self.command is None and not is_file_of_traces(source):
            named = source.parent if source.suffix in DESCRIPTIONS and source.parent.name else source
            return Path(f"{named.name}.simulated.csv")
        return source.with_name(f"{source.stem}.simulated.csv")


def simulate_command(wish: Wish) -> None:
    """Simulate and write time, inputs and outputs.

    Args:
        wish: What was typed.

    Raises:
        BundleError: If the bundle is damaged or incomplete.
        UserError: If the inputs cannot be read, or the output not written.
    """
    _check(wish)
    read, plot, start = read_bundle(meant(wish.bundle)), wish.plot, parse_start(wish.start)
    constants, out = parse_constants(wish.constants), wish.written
    if wish.command is not None:
        words = {"time_unit": wish.time_unit, "unit": wish.unit}
        given: list[tuple[Path, Any]] = [(out, wish.command)]
        plot = plot or out.with_suffix(".png")
    else:
        words, given = {}, _records(wish, read, constants)
    for place, record in given:
        simulation = simulate_bundle(read, record, **words, initial=wish.initial, start=start, constants=constants)
        write_trace(replace(simulation.trace, name=place.stem), place)
        _tell(simulation, place)
        if plot is not None:
            picture = plot if len(given) == 1 else _of_cases(plot, [one.name for _, one in given])[record.name]
            _draw(simulation, picture, title=read.metadata["mapping"])
            console().print(f"drawn in {picture}", soft_wrap=True)


def _records(wish: Wish, read: Bundle, constants: dict[str, float]) -> list[tuple[Path, Trace]]:
    """The records to simulate, and the file to write of each: that of a file, or those of a data set."""
    source, out = Path(str(wish.inputs)), wish.written
    if not is_file_of_traces(source):
        return _of_dataset(wish, source)
    with as_typed():
        options = InputOptions(constants=constants, **reading_options(wish.reading))
        inputs = read_inputs(read, source, options)
    for done in inputs.provenance[1:]:  # the first is the file itself
        console().print(done, soft_wrap=True, markup=False)
    return [(out, inputs)]


def _of_cases(path: Path, cases: Sequence[str]) -> dict[str, Path]:
    """The file of each of several cases, none of which is another's, in folders that do not tell capitals either."""

    def fitted(case: str) -> str:
        return re.sub(r"[^\w+-]+", "-", case).casefold()

    names, plain = distinct(cases, fitted, "-"), {case: re.sub(r"[^\w+-]+", "-", case) for case in cases}
    shown = {case: plain[case] + name[len(fitted(case)) :] for case, name in names.items()}
    return {case: path.with_name(f"{path.stem}.{name}{path.suffix}") for case, name in shown.items()}


def _of_dataset(wish: Wish, source: Path) -> list[tuple[Path, Trace]]:
    """The records of a data set, which says itself how they are read."""
    from sysid.ingest import find_dataset, load_dataset  # here: a file of samples needs none of it

    try:
        found = find_dataset(source)
    except ConfigError as error:
        raise ConfigError(
            error.what,
            where=error.where,
            expected=f"a file of samples, or a data set: {error.expected}",
            got=error.got,
            remedy=f"{error.remedy}; a file of samples is named with its ending, as inputs.csv",
        ) from None
    traces = load_dataset(found)
    if wish.reading:
        raise ConfigError(
            "these options are for a file of samples",
            where="sysid simulate",
            expected="a data set alone: its description says how it is read",
            got=", ".join(wish.reading),
            remedy="leave them out, or name the file itself",
        )
    out = wish.written
    if len(traces) == 1:
        return [(out, traces.traces[0])]
    places = _of_cases(out, [trace.name for trace in traces])
    return [(places[trace.name], trace) for trace in traces]


def parse_constants(words: Sequence[str]) -> dict[str, float]:
    """Inputs that are a number, as they are typed.

    Args:
        words: ``NAME=NUMBER`` each; a name may hold further ``=``.

    Returns:
        The numbers by name.

    Raises:
        ConfigError: If one cannot be read, or is there twice.

    Example:
        >>> parse_constants(["u2=3", "a=b=-1e-3"])
        {'u2': 3.0, 'a=b': -0.001}
    """
    found: dict[str, float] = {}
    for word in words:
        name, equals, number = word.rpartition("=")
        try:
            value = float(number)
        except ValueError:
            value = None
        if not equals or value is None or name in found:
            raise ConfigError(
                "an input cannot be held at this", where="option --constant", expected="NAME=NUMBER, each name once",
                got=word, remedy="write the input's name, = and a number in its unit, as in --constant valve=3",
            )  # fmt: skip
        found[name] = value
    return found


def parse_initial(words: Sequence[str]) -> float | dict[str, float] | None:
    """Where a run's outputs have stood, as it is typed.

    Args:
        words: A number, or ``NAME=NUMBER`` for each output.

    Returns:
        The number, or numbers by name; ``None`` where nothing is said.

    Raises:
        ConfigError: If one cannot be read, or is there twice.

    Example:
        >>> parse_initial(["3.4"]), parse_initial(["y1=3.4", "y2=-1"])
        (3.4, {'y1': 3.4, 'y2': -1.0})
    """
    if len(words) == 1 and "=" not in words[0]:
        try:
            return float(words[0])
        except ValueError:
            raise _no_level(words[0]) from None
    try:
        return parse_constants(words) or None
    except ConfigError as error:
        raise _no_level(str(error.got)) from None


def _no_level(got: str) -> ConfigError:
    return ConfigError(
        "the output cannot begin there", where="option --initial",
        expected="a finite number, in the output's unit, or NAME=NUMBER for each of several outputs", got=got,
        remedy="give the output's value before the first sample, as in --initial 3.4, or leave --initial out",
    )  # fmt: skip


def parse_start(word: str | None) -> Start | None:
    """How a run begins, as it is typed.

    Args:
        word: ``estimated``, ``rest``, ``first-sample`` or ``measured=50``; ``estimated=20`` says on how many samples.

    Returns:
        The start; ``None`` where nothing is said.

    Raises:
        ConfigError: If it cannot be read.

    Example:
        >>> parse_start("measured=50").n_measured
        50
    """
    if word is None:
        return None
    try:
        return Start.of(word)
    except ConfigError:
        raise ConfigError(
            "a run cannot begin so", where="option --start",
            expected="estimated, rest, first-sample or measured=N", got=word,
            remedy="choose one of them, as in --start measured=50",
        ) from None  # fmt: skip


def _check(wish: Wish) -> None:
    inputs, command, initial = wish.inputs, wish.command, wish.initial
    if (inputs is None) == (command is None):
        raise ConfigError(
            "nothing says what to simulate" if inputs is None else "two files say what to simulate",
            where="sysid simulate",
            expected="a file of inputs at every sample, or --command with a table of a few rows",
            got="neither" if inputs is None else f"{inputs} and --command {command}",
            remedy="give one of them",
        )
    if command is not None and wish.reading:
        raise ConfigError(
            "these options are for a file of samples",
            where="sysid simulate --command",
            expected="--time-unit, --unit, --constant and --initial",
            got=", ".join(wish.reading),
            remedy="leave them out: a command table says its units, or --time-unit and --unit do",
        )
    levels = [] if initial is None else [*initial.values()] if isinstance(initial, Mapping) else [initial]
    if not np.isfinite(levels).all():
        raise _no_level(f"--initial {initial}")
    check_picture(wish.plot)


def check_picture(plot: Path | None) -> None:
    """Refuse a picture of a kind that cannot be drawn.

    Args:
        plot: The picture; ``None`` for none.

    Raises:
        ConfigError: If its ending is of another kind.
    """
    if plot is not None and plot.suffix.lower() not in PICTURES:
        raise ConfigError(
            "no picture of this kind can be drawn",
            where="option --plot",
            expected=f"a name that ends in {', '.join(PICTURES)}",
            got=f"--plot {plot}",
            remedy="change the ending",
        )


def _tell(simulation: Simulation, out: Path) -> None:
    names = ", ".join(simulation.outputs)
    console().print(f"{len(simulation.trace)} samples of {names} written to {out}", soft_wrap=True)
    console().print(simulation.begins, soft_wrap=True, markup=False)
    for name, found in simulation.scored.items():
        first = simulation.firsts.get(name, 0)
        of = f"on the {len(simulation.trace) - first} samples after" if first else "on all samples"
        error = in_unit(f"{found.mse:.4g}", squared(found.unit))
        text = f"fit {percent(found.nrmse_fit)} %, mean squared error {error}"
        console().print(f"against the measured {name}: {text}, {of}", soft_wrap=True, markup=False)
    for sentence in simulation.sentences:
        console().print(sentence, soft_wrap=True)


def _draw(simulation: Simulation, plot: Path, *, title: str) -> None:
    from sysid.reporting.figures.simulation_figure import simulation_figure
    from sysid.reporting.figures.style import styled

    outside = (simulation.flags & int(Flag.OUTSIDE_RANGE)) > 0
    figure = simulation_figure(simulation.trace, simulation.inputs, outside=outside, title=title)
    try:
        with replacing(plot) as draft, styled():
            figure.savefig(draft, format=plot.suffix.lower().removeprefix("."), dpi=150)
    except OSError as error:
        raise ConfigError("the picture cannot be written", where=plot, got=str(error)) from error
