"""The sections that show why a model may be believed: its residuals, its frequency response, and linear or not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sysid.bounded_text import read_json
from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.estimation.estimators import ESTIMATORS
from sysid.models import ProcessModel
from sysid.reporting.curves import read_curves
from sysid.reporting.figures.curves_figure import curves_figure
from sysid.reporting.figures.linear_figures import bode_figure, pole_zero_figure, step_figure
from sysid.reporting.figures.residual_figure import residual_figure
from sysid.reporting.fit_records import FitRecord
from sysid.reporting.frequency import FrequencyUnit
from sysid.reporting.linear.computing import bode_of, step_of
from sysid.reporting.linear_views import linear_views
from sysid.reporting.numbers import number
from sysid.reporting.parts import Part, Picture, Section, identifier, picture
from sysid.reporting.residuals import GroupRecord, read_residuals
from sysid.reporting.results import LinearityRecord, Results
from sysid.reporting.sections.modes_table import modes_table
from sysid.reporting.sections.parameter_table import parameter_tables
from sysid.reporting.tables import Cell, Table, figure_cell
from sysid.units import squared


def evidence_sections(folder: Path, results: Results) -> list[Section]:
    """The sections for which the run stored something.

    Args:
        folder: The run's folder.
        results: Its results.

    Returns:
        In the order they are read; none for a run that stored neither residuals nor models.

    Raises:
        ConfigError: If a stored file is damaged.
    """
    sections = [] if results.linearity is None else [_linear_enough(results.linearity)]
    residuals = {fit.name: read_residuals(folder / "fits" / fit.slug) for fit in results.fits}
    if any(residuals.values()):
        sections.append(_residuals(results, residuals))
    models = _models(results.fits)
    tables = [table for fit in models for table in _parameters(folder, fit)]
    if tables:
        sections.append(Section(anchor="parameters", title="Parameters", parts=tuple(tables)))
    shown = [part for fit in results.fits for part in _curves(folder, fit)]
    if shown:
        sections.append(Section(anchor="curves", title="Static curves", parts=tuple(shown)))
    unit = results.frequency
    parts = [part for fit in models if _linear(fit) for part in _responses(folder, fit, unit)]
    if parts:
        sections.append(Section(anchor="frequency-response", title="Frequency response", parts=tuple(parts)))
    return sections


def _models(fits: Sequence[FitRecord]) -> list[FitRecord]:
    """Fits with a model each: one model of several outputs stands once, under the name that all of them have."""
    found: dict[str, FitRecord] = {}
    for fit in fits:
        place = fit.model_slug or fit.slug
        whole = place != fit.slug and fit.system is not None
        found.setdefault(place, fit.model_copy(update={"name": fit.system, "slug": place}) if whole else fit)
    return list(found.values())


def _linear(fit: FitRecord) -> bool:
    row = ESTIMATORS.get(fit.structure.get("kind", ""))
    return row is not None and row.linear


def _linear_enough(linearity: LinearityRecord) -> Section:
    parts: list[Part] = [linearity.text]
    if linearity.rows:
        rows = tuple(
            (
                Cell(text=f"{row.output}, {row.amplitude}".lstrip(", "), header=True, below=", ".join(row.cases)),
                Cell(text=row.linear, below=_better(row.better_linear, row.better_linear_fit)),
                figure_cell(row.linear_fit),
                Cell(text=row.network, below=_better(row.better_network, row.better_network_fit)),
                figure_cell(row.network_fit),
            )
            for row in linearity.rows
        )
        table = Table(
            caption="Free-run fit of the chosen linear model and the chosen network by amplitude [%], unseen cases.",
            head=(("amplitude", "cases"), ("linear model", ""), ("fit", "%"), ("network", ""), ("fit", "%")),
            rows=rows,
            note="Amplitude: how far the output moves, relative to the case where it moves furthest. 100 % is exact.",
        )
        parts.append(table)
    return Section(anchor="linearity", title="Is linear enough?", parts=tuple(parts))


def _better(name: str, fit: float) -> str:
    """That another one would have been better here, which these cases may tell and not choose."""
    return f"{name} would be better here: {number(fit, digits=4)} %" if name else ""


def _residuals(results: Results, residuals: dict[str, dict[str, GroupRecord]]) -> Section:
    parts: list[Part] = [_residual_table(results, residuals)]
    kinds = {fit.structure.get("kind") for fit in results.fits}
    parts += [row.of_residuals for kind, row in ESTIMATORS.items() if kind in kinds and row.of_residuals]
    for fit in results.fits:
        groups = {name: group.analysis for name, group in residuals[fit.name].items() if group.analysis is not None}
        if not groups or not (results.chosen(fit) or _linear(fit)):
            continue
        said = " ".join(f"{name.capitalize()} cases: {' '.join(found.sentences)}" for name, found in groups.items())
        caption = f"{fit.name}: correlation of the one-step residuals, with 99 % bounds in grey. {said}"
        name = f"residuals-{identifier(fit.slug)}"
        parts.append(picture(residual_figure(groups), f"Residuals of {fit.name}", caption, name))
    return Section(anchor="residuals", title="Residuals", parts=tuple(parts))


def _residual_table(results: Results, residuals: dict[str, dict[str, GroupRecord]]) -> Table:
    rows, units = [], dict.fromkeys(squared(fit.unit) for fit in results.fits)
    for fit in results.fits:
        for name, group in residuals[fit.name].items():
            found = group.analysis
            head = (Cell(text=fit.name, header=True), Cell(text=name, below=", ".join(group.cases)))
            if found is None:
                rows.append(
                    (
                        *head,
                        *(Cell(text="not analysed", below=group.reason) if i == 0 else Cell(text="") for i in range(4)),
                    )
                )
                continue
            owed = ", ".join(entry.name for entry in found.inputs if not entry.passed)
            rows.append(
                (
                    *head,
                    figure_cell(found.variance, below=squared(fit.unit) if len(units) > 1 else ""),
                    figure_cell(found.ljung_box_p),
                    Cell(text="white" if found.white else "not white"),
                    Cell(text=f"not of {owed}" if owed else "independent"),
                )
            )
    return Table(
        caption="What is left one step ahead: white, and independent of past inputs? Tests at 99 %.",
        head=(
            ("fit", ""),
            ("cases", ""),
            ("variance", next(iter(units)) if len(units) == 1 else ""),
            ("Ljung-Box", "p"),
            ("residuals", "whiteness"),
            ("past inputs", "independence"),
        ),
        rows=tuple(rows),
        note="Of a reference without noise a model leaves structure, never noise: with enough samples no model passes, "
        "and the size of what is left counts.",
    )


def _responses(folder: Path, fit: FitRecord, unit: FrequencyUnit) -> list[Part]:
    stored = read_stored_fit(folder / "fits" / (fit.model_slug or fit.slug) / "fit.json")
    if stored is None or stored.model.pole_radius is None or not linear_views(stored.model, None):
        return []  # where no input moves it, there is no response to draw
    band = (
        "Grey: 95 % of what the covariance of the parameters allows."
        if stored.uncertainty
        else "Uncertainty not known."
    )
    name = identifier(fit.slug)
    return [
        picture(
            bode_figure(bode_of([(stored.model, stored.uncertainty)]), unit),
            f"Bode diagram of {fit.name}",
            f"{fit.name}, {fit.label}: frequency response up to the Nyquist frequency. {band}",
            f"bode-{name}",
        ),
        *step_and_poles(fit.name, stored, name),
    ]


def step_and_poles(title: str, stored: FitResult, name: str) -> list[Part]:
    """Step responses of a linear fit, and its poles and zeros, drawn and as a table.

    Args:
        title: What it is called.
        stored: The fit.
        name: Unique within the page; letters, digits and dashes.

    Returns:
        The parts; none of a model that no input moves.
    """
    model, uncertainty = stored.model, stored.uncertainty
    if not linear_views(model, None):  # no input moves it: there is no response to draw
        return []
    poles = modes_table(title, stored)
    band = "Grey: 95 % of what the covariance of the parameters allows." if uncertainty else "Uncertainty not known."
    return [
        picture(
            step_figure(step_of([(model, uncertainty)])),
            f"Step responses of {title}",
            f"{title}: change of the output after a step of one unit in each input. {band}",
            f"step-{name}",
        ),
        picture(
            pole_zero_figure(linear_views(model, uncertainty)),
            f"Poles and zeros of {title}",
            f"{title}: poles (crosses) and zeros (circles) by input. Grey: poles of models drawn from the "
            "distribution of the parameters. What lies far outside the unit circle is counted in the legend.",
            f"poles-{name}",
        ),
        *([] if poles is None else [poles]),
    ]


def _parameters(folder: Path, fit: FitRecord) -> list[Table]:
    # Only names that somebody gave, or that the field has, mean something.
    if "equations" not in fit.structure and fit.structure.get("kind") != ProcessModel.kind:
        return []
    stored = read_stored_fit(folder / "fits" / (fit.model_slug or fit.slug) / "fit.json")
    return [] if stored is None else parameter_tables(fit, stored)


def _curves(folder: Path, fit: FitRecord) -> list[Picture]:
    curves = read_curves(folder / "fits" / fit.slug)
    if not curves:
        return []
    caption = (
        f"{fit.name}, {fit.label}: its static curves over what the estimation records range over, and below how many "
        "samples lie where. Beyond the samples a curve is a guess."
    )
    return [picture(curves_figure(curves), f"Static curves of {fit.name}", caption, f"curves-{identifier(fit.slug)}")]


def read_stored_fit(path: Path) -> FitResult | None:
    """The stored fit; ``None`` if the run stored none."""
    try:
        return FitResult.from_dict(read_json(path))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        raise ConfigError(
            "the stored fit cannot be read",
            where=path,
            expected="a fit as the run wrote it",
            got=f"{type(error).__name__}: {error!s:.200}",
            remedy="run the pipeline again; it resumes from what is finished",
        ) from error
