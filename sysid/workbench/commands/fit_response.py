"""``sysid fit-response``: a transfer function from a measured frequency response; picture, table and bundle of it."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.table import Table

from sysid.api.response_fit import ResponseFit, response_fit
from sysid.api.response_orders import FEWEST, MOST, ResponseOrderSearch, search_orders_of
from sysid.api.response_problem import ResponseProblem
from sysid.atomic import write_bytes
from sysid.errors import ConfigError
from sysid.ingest.readers.text_source import bare_stem
from sysid.ingest.responses import read_response
from sysid.models import Domain, TransferFunction
from sysid.names import slug
from sysid.reporting.figures.style import styled
from sysid.reporting.figures.svg import svg
from sysid.reporting.frequency import FrequencyUnit
from sysid.reporting.numbers import number
from sysid.workbench.commands.pictures import kept_picture
from sysid.workbench.commands.reader_options import as_typed, files_from
from sysid.workbench.runner.console import console
from sysid.workbench.runner.naming import nearby


@dataclass(frozen=True, kw_only=True)
class ResponseWish:
    """What was typed.

    Args:
        source: The file.
        poles: How many, or ``least:largest``; empty for a search.
        zeros: How many; one less by default, and in a search as many as are needed.
        dead_time: In seconds; searched by default.
        sample_time: In seconds.
        discrete: Whether the model is a discrete one.
        weighting: What counts of the error.
        mapping: What input and output are called.
        columns: ``ROLE=NAME`` each.
        units: ``ROLE=UNIT`` each.
        frequency: Unit of the frequencies that are drawn.
        out: Folder of the bundle; none is written by default.
        reading: Options of the readers.
    """

    source: Path
    poles: str
    zeros: int | None
    dead_time: float | None
    sample_time: float | None
    discrete: bool
    weighting: str
    mapping: str
    columns: Sequence[str] = ()
    units: Sequence[str] = ()
    frequency: str = "Hz"
    out: Path | None = None
    reading: Dict[str, Any] = field(default_factory=dict)


def fit_response_command(wish: ResponseWish) -> None:
    """Fit a transfer function to a file of a frequency response; print it, write a table, a picture, and its bundle."""
    unit = FrequencyUnit.of(wish.frequency)
    with as_typed(whole=False):
        columns, units = _pairs(wish.columns, "--column"), _pairs(wish.units, "--unit")
        found = read_response(wish.source, columns=columns, units=units, files=files_from(wish.reading))
    problem = ResponseProblem.of(
        found, wish.mapping, sample_time=wish.sample_time, weighting=wish.weighting, units=None, training=None
    )
    target = console()
    target.print(str(found).splitlines()[0], soft_wrap=True, markup=False)
    fit = _fit(wish, problem)
    if fit.orders is not None:
        target.print(_table(fit.orders))
    target.print(fit.summary(), soft_wrap=True, markup=False)
    target.print(f"Poles\n{fit.poles()}", soft_wrap=True, markup=False)
    with styled():
        told = f"{found.name}, as measured and as fitted"
        drawing = svg(fit.plot(unit=unit.value), title="Frequency response", description=told, name="response")
    stem = slug(bare_stem(wish.source))
    table = Path(f"{stem}.fit-response.csv")
    write_bytes(table, fit.to_frame().to_csv(index=False).encode())
    picture = kept_picture(Path(f"{stem}.fit-response.svg"), drawing)
    target.print(f"written: {nearby(table)}, {picture}", soft_wrap=True, markup=False)
    if wish.out is not None:
        target.print(f"bundle: {nearby(fit.save(wish.out).folder)}", soft_wrap=True, markup=False)
        return
    target.print("Next: the same with --out FOLDER writes it as C, ONNX and model.json", soft_wrap=True, markup=False)


def _fit(wish: ResponseWish, problem: ResponseProblem) -> ResponseFit:
    """The fit of the orders that were typed, or of the best of their range."""
    domain, poles = Domain.DISCRETE if wish.discrete else Domain.CONTINUOUS, _poles(wish.poles)
    if len(poles) == 2:
        with console().status("fitting structures of rising order"):
            found = search_orders_of(problem, (poles[0], poles[1]), wish.zeros, domain=domain, delays=_delays(wish))
        return found.fit
    zeros = poles[0] - 1 if wish.zeros is None else wish.zeros
    structure = TransferFunction(
        poles=(poles[0],), zeros=(zeros,), delays=_delays(wish), domain=domain, intercept=False
    )
    return response_fit(problem, problem.fitted(structure))


def _poles(typed: str) -> tuple[int, ...]:
    """One number, or the least and the largest."""
    words = typed.split(":") if typed else [str(FEWEST), str(MOST)]
    if len(words) > 2 or not all(word.strip().isdecimal() and int(word) > 0 for word in words):
        raise ConfigError(
            "not a number of poles", where="option --poles", expected="for example 2, or 1:6 for the best of these",
            got=typed, remedy="write --poles 2, or leave it out",
        )  # fmt: skip
    return tuple(map(int, words))


def _table(found: ResponseOrderSearch) -> Table:
    """All that were tried, the best first."""
    table = Table(title="Orders by the errors at frequencies left out of the fits", title_justify="left")
    for head in ("poles", "zeros", "dead time [s]", "error where left out %", "fit %", "beyond the best"):
        table.add_column(head, justify="right")
    least = found.score(found.ranked[0])
    for one in found.ranked:
        table.add_row(
            str(one.poles), str(one.zeros), number(one.dead_time), f"{found.left_out_percent(one):.3g}",
            f"{one.fit.fit_percent:.2f}", f"{found.score(one) - least:.3g}",
        )  # fmt: skip
    return table


def _delays(wish: ResponseWish) -> tuple[int, ...] | None:
    """The dead time in samples, where it was given."""
    if wish.dead_time is None:
        return None
    if not wish.dead_time:
        return (0,)
    samples = wish.dead_time / wish.sample_time if wish.sample_time else float("nan")
    if not (samples > 0.0 and abs(samples - round(samples)) < 1e-6 * samples):
        raise ConfigError(
            "a dead time is a multiple of the sample time", where="option --dead-time",
            expected="--sample-time beside it, of which it is a multiple",
            got=f"--dead-time {wish.dead_time:g}, --sample-time {wish.sample_time or 'not given'}",
            remedy=f"write for example --dead-time {wish.dead_time:g} --sample-time {wish.dead_time / 20:g}",
        )  # fmt: skip
    return (round(samples),)


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
