"""``sysid advise``: what is in a record, what is wrong with it, and what to try."""

from __future__ import annotations

from pathlib import Path

from rich.padding import Padding
from rich.text import Text

from sysid.advice import Verdict
from sysid.api.fitting import load
from sysid.api.looking import Advice, SystemAdvice, advise, mapping_of
from sysid.names import slug
from sysid.reporting.advice.words import lines
from sysid.reporting.figures.advice_figure import advice_figure
from sysid.reporting.figures.style import styled
from sysid.reporting.figures.svg import svg
from sysid.reporting.frequency import FrequencyUnit
from sysid.workbench.commands.pictures import kept_picture
from sysid.workbench.runner.console import console

STYLES = {Verdict.LOOK.value: "bold yellow", Verdict.UNKNOWN.value: "dim", Verdict.FINE.value: "green"}


def advise_command(source: str, *, mapping: str | None, frequency: str) -> None:
    """Show what is in a data set, and draw it beside."""
    unit = FrequencyUnit.of(frequency)
    traces = load(source)
    found = advise(traces, mapping_of(traces, mapping, option="--mapping "))
    several = found.outputs.items() if isinstance(found, SystemAdvice) else [("", found)]
    for name, one in several:
        _show(one, f".{slug(name)}" if name else "", unit)


def _show(found: Advice, which: str, unit: FrequencyUnit) -> None:
    target = console()
    target.print(f"{found.data}: {found.mapping}, one sample every {found.sample_time:g} s", markup=False)
    before = ""
    for question, verdict, says, do in lines(found.record):
        if question != before:
            target.print(Text(question, style="bold"))
            before = question
        text = Text(f"[{verdict}] ", style=STYLES.get(verdict, "")) if verdict else Text()
        target.print(Padding(text + Text(says), (0, 0, 0, 2), expand=False))
        if do:
            target.print(Padding(Text(do, style="italic"), (0, 0, 0, 6), expand=False))
    target.print(f"picture: {_picture(found, which, unit)}", soft_wrap=True, markup=False)


def _picture(found: Advice, which: str, unit: FrequencyUnit) -> str:
    """Draw into the current folder, and say where, or why not."""
    figure = advice_figure(found.record, unit)
    if figure is None:
        return "none, as there is no response to draw"
    with styled():
        drawing = svg(figure, title=f"First look at {found.data}", description=str(found.mapping), name="advice")
    return kept_picture(Path(f"{slug(found.data)}{which}.advice.svg"), drawing)
