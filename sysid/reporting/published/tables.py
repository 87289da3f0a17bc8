"""Published figures, set beside ours: a reference table is content, named by the pipeline.

A table is two files in a folder ``reports/published``: ``<name>.yaml`` says where the figures come from,
``<name>.csv`` holds them one a row, as printed. A row marked as yardstick is the figure that others are
measured against for its mapping; figures of a free run and of one step ahead are never mixed.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from sysid.content import content_folders
from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.yaml_files import read_yaml

_COLUMNS = (
    "source", "mapping", "structure", "variant", "loop", "run", "case", "signal", "quantity", "value", "unit",
    "yardstick", "note",
)  # fmt: skip


class _About(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str
    author: str
    year: int
    kind: str
    part: str
    cases: str
    computer: str
    comparability: str
    figures: str


@dataclass(frozen=True, kw_only=True)
class PublishedFigure:
    """One published figure.

    Args:
        source: Where it is printed, such as ``Table 5.1``.
        mapping: Which channels go in and which comes out.
        structure: Label of the model's structure; empty where it was not given.
        variant: What the publication calls the model.
        loop: ``open`` or ``closed``: what the model was trained for; empty where it does not apply.
        run: ``one_step`` or ``free_run``: how the figure was obtained; empty where it does not apply.
        case: Name of the case; ``mean`` for a printed average; empty where it does not apply.
        signal: Which output, where a model has several.
        quantity: What it is: ``mse``, ``run_time``, ``train_time``, ...
        digits: The number as printed, after scaling to ``unit``.
        unit: Its unit.
        yardstick: Whether others are measured against it.
        note: How it was read, and doubts about it.
    """

    source: str
    mapping: str
    structure: str
    variant: str
    loop: str
    run: str
    case: str
    signal: str
    quantity: str
    digits: str
    unit: str
    yardstick: bool
    note: str

    @property
    def value(self) -> float:
        """The number."""
        return float(self.digits)

    @property
    def label(self) -> str:
        """Which model the figure belongs to, in a few words."""
        return ", ".join(part for part in (self.structure, self.variant) if part)


@dataclass(frozen=True, kw_only=True)
class PublishedTable:
    """The figures of one publication, and where they come from.

    Args:
        name: Name of the table, as a pipeline writes it.
        reference: Author, title, kind and year in one line.
        part: Which part of the publication.
        computer: On what the run times were measured.
        comparability: What a comparison with these figures can and cannot say.
        figures: The figures in the order of the file.
    """

    name: str
    reference: str
    part: str
    computer: str
    comparability: str
    figures: tuple[PublishedFigure, ...]

    def find(
        self,
        *,
        mapping: str,
        quantity: str,
        run: str,
        case: str = "",
        unit: str | None = None,
        signal: str = "",
        loop: str | None = None,
        structure: str | None = None,
        variant: str | None = None,
    ) -> PublishedFigure | None:
        """The published figure for one case: the yardstick unless a model is asked for.

        Args:
            mapping: As in ``BP+AR -> BC``; blanks do not matter.
            quantity: What is looked for, such as ``mse``.
            run: ``one_step`` or ``free_run``.
            case: Name of the case.
            unit: Unit that ours is in; a figure in another unit is not comparable and not found.
            signal: Which output, where a model has several.
            loop: ``open`` or ``closed``; any if not given.
            structure: Only a model of this structure; with it or a variant, yardsticks have no precedence.
            variant: Only this variant.

        Returns:
            The first match in the order of the file; ``None`` if nothing of the kind was published.
        """
        wanted: dict[str, str | None] = {
            "quantity": quantity, "run": run, "case": case, "unit": unit, "signal": signal,
            "loop": loop, "structure": structure, "variant": variant,
        }  # fmt: skip
        any_model = structure is None and variant is None
        for figure in self.figures:
            named = all(value is None or getattr(figure, field) == value for field, value in wanted.items())
            if named and _bare(figure.mapping) == _bare(mapping) and (figure.yardstick or not any_model):
                return figure
        return None

    def by_variant(
        self, *, mapping: str, quantity: str, run: str, signal: str, unit: str
    ) -> dict[str, dict[str, PublishedFigure]]:
        """Every published model of a mapping.

        Args:
            mapping: As the table has it; blanks do not matter.
            quantity: What is looked for, such as ``mse``.
            run: ``one_step`` or ``free_run``.
            signal: Which output, where a model has several.
            unit: Unit of the figures.

        Returns:
            By where a model is printed and what it is called there (``Table 7.5: assy_1``), its figures by case.
        """
        found: dict[str, dict[str, PublishedFigure]] = {}
        for one in self.figures:
            same = (one.quantity, one.run, one.signal, one.unit) == (quantity, run, signal, unit)
            if same and _bare(one.mapping) == _bare(mapping):
                found.setdefault(f"{one.source}: {one.label}", {}).setdefault(one.case, one)
        return found


def published_names(*, workspace: Path | None = None) -> tuple[str, ...]:
    """Names of the reference tables that can be cited.

    Args:
        workspace: The user's workspace; ``None`` is the current folder.

    Returns:
        The names, sorted.

    Example:
        >>> "lopes-2021" in published_names()
        True
    """
    return tuple(sorted({path.stem for folder in _folders(workspace) for path in folder.glob("*.yaml")}))


def read_published(name: str, *, workspace: Path | None = None) -> PublishedTable:
    """Read a reference table.

    Args:
        name: Its name, as a pipeline writes it.
        workspace: The user's workspace; ``None`` is the current folder.

    Returns:
        The table.

    Raises:
        ConfigError: If there is no such table, or one of its two files is damaged.

    Example:
        >>> table = read_published("lopes-2021")
        >>> table.find(mapping="BP+AR->BC", quantity="mse", run="free_run", case="EST01").digits
        '0.004149'
    """
    for folder in _folders(workspace):
        path = folder / f"{name}.yaml"
        if path.is_file():
            about = check(_About, read_yaml(path), where=path)
            return PublishedTable(
                name=name,
                reference=f"{about.author}, {about.title}. {about.kind}, {about.year}",
                part=about.part,
                computer=about.computer,
                comparability=about.comparability,
                figures=_read_figures(path.with_name(about.figures)),
            )
    names = published_names(workspace=workspace)
    otherwise, none = "correct the name in the pipeline, or leave the line out", "a file reports/published/<name>.yaml"
    what = f"no table of published figures is called {name}"
    raise ConfigError.unknown(what, name, names, otherwise, where="report: published", none=none)


def _folders(workspace: Path | None) -> tuple[Path, ...]:
    kept = (folder / "published" for folder in content_folders("reports", workspace=workspace))
    return tuple(folder for folder in kept if folder.is_dir())


def _read_figures(path: Path) -> tuple[PublishedFigure, ...]:
    try:
        with path.open(encoding="utf-8", newline="") as lines:
            reader = csv.DictReader(lines, strict=True)
            if tuple(reader.fieldnames or ()) != _COLUMNS:
                raise _damaged(f"{path}, line 1", f"the columns {', '.join(_COLUMNS)}", reader.fieldnames)
            return tuple(_figure(row, f"{path}, line {reader.line_num}") for row in reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise _damaged(path, "a CSV file in UTF-8", error) from error


def _figure(row: Dict[str, str], where: str) -> PublishedFigure:
    if None in row or None in row.values():
        raise _damaged(where, f"{len(_COLUMNS)} fields", "another number of fields")
    try:
        float(row["value"])
    except ValueError as error:
        raise _damaged(where, "a number under value", row["value"]) from error
    fields = {name: row[name] for name in _COLUMNS if name not in {"value", "yardstick"}}
    return PublishedFigure(**fields, digits=row["value"], yardstick=row["yardstick"] == "yes")


def _damaged(where: object, expected: object, got: object) -> ConfigError:
    return ConfigError(
        "the table of published figures is damaged",
        where=where,
        expected=expected,
        got=got,
        remedy="correct the file; reports/README.md says what its columns mean",
    )


def _bare(mapping: str) -> str:
    return "".join(mapping.split())
