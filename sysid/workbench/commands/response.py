"""``sysid response``: what a linear fit of a run, or a bundle, answers to a step and to sines, and its poles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.api.responses import bode, poles, step
from sysid.atomic import write_bytes
from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.export.bundle import Bundle
from sysid.export.reading import read_bundle
from sysid.names import slug
from sysid.reporting.figures.style import styled
from sysid.reporting.figures.svg import as_file, svg
from sysid.reporting.frequency import FrequencyUnit
from sysid.reporting.kinds import read_run
from sysid.reporting.linear.responses import Bode, StepResponse
from sysid.reporting.responses.results import ResponseResults
from sysid.reporting.results import read_results
from sysid.workbench.fits.record import read_fit
from sysid.workbench.runner.console import console
from sysid.workbench.runner.naming import meant, nearby
from sysid.workbench.runner.store import RunFolder

RESULTS = "results.json"
POINTS = 200
"""Between two ends, where no number is said."""


def response_command(
    model: Path,
    *,
    fit: str | None,
    seconds: float | None,
    out: Path | None,
    frequency: str,
    frequencies: str | None = None,
) -> None:
    """Print poles, gains and times, and write tables and pictures."""
    unit, model = FrequencyUnit.of(frequency), meant(model)
    at = None if frequencies is None else parse_frequencies(frequencies, unit)
    run = (model / RESULTS).is_file()
    asked, title = (_fits(model, fit), fit or model.name) if run else (_bundle(model, fit), model.stem)
    # What has no response at all is told before anything is written.
    shown: dict[str, StepResponse | Bode] = {"step": step(asked, seconds=seconds), "bode": bode(asked, frequency=at)}
    target = console()
    target.print(f"Poles\n{poles(asked)}", soft_wrap=True)
    folder = out or Path()
    folder.mkdir(parents=True, exist_ok=True)
    for kind, found in shown.items():
        target.print(f"{kind.capitalize()}\n{found}", soft_wrap=True)
        with styled():
            figure = found.plot(unit=unit) if isinstance(found, Bode) else found.plot()
            drawing = svg(figure, title=kind.capitalize(), description=f"{kind} of {title}", name=kind)
        table, picture = (folder / f"{slug(title)}.{kind}.{ending}" for ending in ("csv", "svg"))
        write_bytes(picture, as_file(drawing))
        write_bytes(table, found.to_frame().to_csv(index=False).encode())
        target.print(f"written: {nearby(table)}, {nearby(picture)}", soft_wrap=True)


def parse_frequencies(words: str, unit: FrequencyUnit) -> NDArray[np.float64]:
    """Frequencies as they are typed.

    Args:
        words: Numbers with commas, or ``low:high`` or ``low:high:points``, spaced evenly by ratio.
        unit: In which they are.

    Returns:
        Shape ``(n,)``, in rad/s.

    Raises:
        ConfigError: If they cannot be read.

    Example:
        >>> parse_frequencies("0.5,1", FrequencyUnit.RADIANS).tolist()
        [0.5, 1.0]
        >>> parse_frequencies("1:100:3", FrequencyUnit.RADIANS).tolist()
        [1.0, 10.0, 100.0]
    """
    try:
        if ":" in words:
            low, high, *more = words.split(":")
            (points,) = [int(one) for one in more] or [POINTS]
            at = np.geomspace(float(low), float(high), points)
        else:
            at = np.array([float(one) for one in words.split(",")])
        if not (np.isfinite(at).all() and (at >= 0.0).all() and len(at)):
            raise ValueError
    except (TypeError, ValueError):
        raise ConfigError(
            "these are no frequencies", where="option --frequencies", expected="numbers from 0 on, or low:high:points",
            got=words, remedy=f"write for example --frequencies 0.1,1,10 or --frequencies 0.01:10:50, in {unit.value}",
        ) from None  # fmt: skip
    return unit.radians(at)


def _fits(folder: Path, name: str | None) -> list[FitResult]:
    """The models of a fit of a run, the best by default."""
    run = read_run(folder)
    if isinstance(run, ResponseResults):  # each of its fits is a pair of input and output
        pairs = {fit.mapping: fit.slug for fit in run.fits}
        asked = pairs if name is None else {name: pairs.get(name)}
        if None in asked.values():
            raise ConfigError.unknown(
                f"there is no fit named {name}", str(name), pairs, "leave --fit out", where=folder
            )
        return [read_fit(RunFolder(path=folder).fit(str(place))) for place in asked.values()]
    results = read_results(folder)
    if name is None and results.best is None:
        raise ConfigError("no fit was chosen", where=folder, remedy="name one with --fit")
    best = results.best_fit
    wanted = name or (best.system or best.name if best is not None else "")
    known = dict.fromkeys(one for fit in results.fits for one in (fit.system, fit.name) if one)
    if wanted not in known:
        otherwise = "name one of them with --fit"
        raise ConfigError.unknown(f"there is no fit named {wanted}", wanted, known, otherwise, where=folder)
    slugs = dict.fromkeys(one.model_slug or one.slug for one in results.fits if wanted in {one.system, one.name})
    return [read_fit(RunFolder(path=folder).fit(place)) for place in slugs]


def _bundle(path: Path, fit: str | None) -> Bundle:
    if fit is not None:
        raise ConfigError(
            "a bundle has one model",
            where=path,
            expected="the folder of a run, with --fit",
            got=f"--fit {fit}",
            remedy="leave --fit out, or give the run's folder, such as runs/NAME",
        )
    return read_bundle(path)
