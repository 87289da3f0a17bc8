"""What a command of ``sysid rail`` writes: a table, and a picture of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def write_table_and_picture(
    folder: Path,
    name: str,
    columns: dict[str, NDArray[np.float64]],
    *,
    x: NDArray[np.float64],
    label: str,
    rows: Sequence[tuple[str, NDArray[np.float64]]] = (),
    spans: Sequence[tuple[float, float, str]] = (),
) -> None:
    """Write ``NAME.csv`` and ``NAME.svg``.

    Args:
        folder: Where to; made if it is not there.
        name: Of both files.
        columns: Of the table, by name.
        x: What the picture is drawn over.
        label: What that is.
        rows: Its panels, each with what it shows; every column but ``time_s`` by default.
        spans: What is marked in all panels: from, to, and its name.
    """
    import numpy as np

    from sysid.atomic import replacing

    folder.mkdir(parents=True, exist_ok=True)
    with replacing(folder / f"{name}.csv") as draft:
        table = np.column_stack(list(columns.values()))
        np.savetxt(draft, table, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")
    typer.echo(f"written: {folder / f'{name}.csv'}")
    shown = rows or [(one.replace("_", " "), values) for one, values in columns.items() if one != "time_s"]
    _picture(folder / f"{name}.svg", x, label, shown, spans)


def _picture(
    file: Path,
    x: NDArray[np.float64],
    label: str,
    rows: Sequence[tuple[str, NDArray[np.float64]]],
    spans: Sequence[tuple[float, float, str]],
) -> None:
    """One panel a row, what is marked shaded in all of them."""
    from matplotlib.figure import Figure

    from sysid.atomic import replacing

    figure = Figure(figsize=(8.0, 1.8 * len(rows)), layout="constrained")
    panels = figure.subplots(len(rows), 1, sharex=True)
    for panel, (title, values) in zip(panels, rows, strict=True):
        panel.plot(x, values, linewidth=1.2, color="#1f5a96")
        panel.set_ylabel(title, fontsize=8)
        panel.grid(visible=True, alpha=0.3)
        for first, last, _ in spans:
            panel.axvspan(first, last, color="#d9822b", alpha=0.2)
    for first, last, said in spans:
        panels[0].annotate(said, (0.5 * (first + last), panels[0].get_ylim()[1]), ha="center", va="bottom", fontsize=7)
    panels[-1].set_xlabel(label)
    with replacing(file) as draft:
        figure.savefig(draft, format="svg", metadata={"Date": None})
    typer.echo(f"written: {file}")
