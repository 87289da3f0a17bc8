"""Kinds of stored results: how results.json of each is known, read, and made into a page and into scores.

One row a kind, in :data:`KINDS`. Whoever takes a run folder of any kind comes through here.
"""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pydantic.json_schema import models_json_schema

from sysid.reporting.assembly.document import assembly_document
from sysid.reporting.assembly.results import AssemblyResults
from sysid.reporting.document import build_document
from sysid.reporting.judging.document import judgement_document
from sysid.reporting.judging.results import JudgementResults
from sysid.reporting.judging.version_1 import ReadyResults, ready_document
from sysid.reporting.parts import Document
from sysid.reporting.published.comparison import with_published
from sysid.reporting.published.tables import PublishedTable, read_published
from sysid.reporting.records import RESULTS_FILE, RunResults, parse_record, read_document
from sysid.reporting.responses.document import response_document
from sysid.reporting.responses.results import ResponseResults
from sysid.reporting.results import Results, parse_results
from sysid.reporting.run_scores import assembly_scores, fit_scores, judgement_scores
from sysid.reporting.scores import Score


@dataclass(frozen=True, kw_only=True)
class ResultsKind:
    """One kind of stored results.

    Args:
        what: In a few words.
        known: Whether plain data are of this kind.
        record: What they are read as.
        document: Makes the page: of the run's folder, its results, and the workspace with the user's own tables.
        scores: Makes the scores of a scorecard, of the results and that workspace.
    """

    what: str
    known: Callable[[Dict[str, Any]], bool]
    record: type[RunResults]
    document: Callable[[Path, Any, Path | None], Document]
    scores: Callable[[Any, Path | None], list[Score]]


def _published(results: Results, workspace: Path | None) -> PublishedTable | None:
    return None if results.published is None else read_published(results.published, workspace=workspace)


def _fits_document(folder: Path, results: Results, workspace: Path | None) -> Document:
    published = _published(results, workspace)
    return build_document(folder, with_published(results, published), published)


def _fits_scores(results: Results, workspace: Path | None) -> list[Score]:
    return fit_scores(with_published(results, _published(results, workspace)))


def _is_ready(document: Dict[str, Any]) -> bool:
    """Whether it is version 1 of an assembly or a judgement, which carried ready-made tables."""
    return "judgement" in document and document.get("schema_version", 1) == 1


KINDS: Final = (
    ResultsKind(
        what="assemblies and judgements, version 1",
        known=_is_ready,
        record=ReadyResults,
        document=lambda _, results, __: ready_document(results),
        scores=lambda results, _: list(results.judgement.scores),
    ),
    ResultsKind(
        what="assemblies",
        known=lambda document: document.get("kind") == "assembly",
        record=AssemblyResults,
        document=assembly_document,
        scores=lambda results, _: assembly_scores(results),
    ),
    ResultsKind(
        what="judgements",
        known=lambda document: "judgement" in document,
        record=JudgementResults,
        document=lambda _, results, __: judgement_document(results),
        scores=lambda results, _: judgement_scores(results),
    ),
    ResultsKind(
        what="fits of measured frequency responses",
        known=lambda document: document.get("kind") == "response",
        record=ResponseResults,
        document=lambda folder, results, _: response_document(folder, results),
        scores=lambda _, __: [],
    ),
    ResultsKind(
        what="fits and sweeps",
        known=lambda _: True,
        record=Results,
        document=_fits_document,
        scores=_fits_scores,
    ),
)
"""The first row that knows the data has them."""


def read_run(folder: Path) -> RunResults:
    """The results of a run of any kind.

    Args:
        folder: The run's folder.

    Returns:
        Its results.

    Raises:
        ConfigError: If there are none, they are damaged, or they were written by a newer release.
    """
    path = Path(folder) / RESULTS_FILE
    document = read_document(path)
    kind = next(kind for kind in KINDS if kind.known(document))
    return (
        parse_results(document, where=path)
        if kind.record is Results
        else parse_record(kind.record, document, where=path)
    )


def results_json_schema() -> dict[str, Any]:
    """The JSON schema of results.json of every kind, in the version that is written.

    Returns:
        The schema, draft 2020-12.

    Example:
        >>> sorted(results_json_schema()["$defs"]["JudgementResults"]["required"])
        ['command', 'created', 'data', 'environment', 'judgement', 'pipeline', 'subjects']
    """
    records = [kind.record for kind in KINDS if kind.known is not _is_ready]
    references, definitions = models_json_schema([(record, "validation") for record in records])
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "results.json",
        "oneOf": [references[record, "validation"] for record in records],
        "$defs": definitions["$defs"],
    }


def run_document(folder: Path, results: RunResults, *, workspace: Path | None = None) -> Document:
    """The parts of a run's page.

    Args:
        folder: The run's folder.
        results: Its results.
        workspace: Where the user's own tables of published figures lie; ``None`` is the current folder.

    Returns:
        The parts; its ``results`` have the published figures set beside ours.

    Raises:
        ConfigError: If a stored file is missing or damaged, or the table of published figures is not known.
    """
    return _kind_of(results).document(Path(folder), results, workspace)


def run_scores(results: RunResults, *, workspace: Path | None = None) -> list[Score]:
    """The scores of what a run chose.

    Args:
        results: Its results.
        workspace: Where the user's own tables of published figures lie; ``None`` is the current folder.

    Returns:
        A score for each output, or subject; none where nothing was chosen.

    Raises:
        ConfigError: If the table of published figures is not known.
    """
    return _kind_of(results).scores(results, workspace)


def _kind_of(results: RunResults) -> ResultsKind:
    return next(kind for kind in KINDS if kind.record is type(results))
