"""What a running pipeline says: screens, logs and trackers listen, and the steps know none of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid.estimation import FitResult
from sysid.reporting.responses.results import ResponseResults
from sysid.reporting.sweep_record import SweepRecord
from sysid.traces import TraceSet
from sysid.validation import Evaluation

if TYPE_CHECKING:
    from sysid.workbench.fits.config import FitConfig, PipelineConfig


@dataclass(frozen=True, kw_only=True, eq=False)
class Event:
    """Anything that happens in a run."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RunStarted(Event):
    """A run begins, its data not yet loaded.

    Args:
        pipeline: Name of the pipeline.
        folder: Its run folder.
        run_id: Name of this run, different for each.
        command: The command that makes it again.
    """

    pipeline: str
    folder: Path
    run_id: str
    command: str


@dataclass(frozen=True, kw_only=True, eq=False)
class DataLoaded(Event):
    """The traces are there.

    Args:
        traces: The data set.
        selection: Names of the traces that choose between fits.
    """

    traces: TraceSet
    selection: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class StepStarted(Event):
    """A step begins.

    Args:
        step: What is being done, for people.
    """

    step: str


@dataclass(frozen=True, kw_only=True, eq=False)
class StepProgress(Event):
    """A step goes on.

    Args:
        step: What is being done.
        fraction: Share that is done, 0 to 1; ``None`` where it is not known.
        detail: How it stands, in words.
    """

    step: str
    fraction: float | None
    detail: str


@dataclass(frozen=True, kw_only=True, eq=False)
class StepDone(Event):
    """A step is done and its result on disk.

    Args:
        step: What was done.
        stored: Whether an earlier run's result was taken.
        detail: How it came out, in words.
    """

    step: str
    stored: bool
    detail: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class FitReady(Event):
    """A fit and its figures are on disk.

    Args:
        config: The fit as the pipeline asks for it; of several outputs, under a name of this one's own.
        pipeline: The pipeline, as of this output alone.
        key: Digest of everything the fit and its figures depend on.
        fit: The fit.
        evaluation: Its figures on every case, signals included.
        selection_mse: Mean free-run mse on the selection traces; NaN without any.
        stored: Whether both come from an earlier run.
        folder: Where its figures lie.
        system: Name of the fit of several outputs that it is one output of; ``None`` for a fit of one output.
        model_slug: Name of the folder under ``fits`` where its model lies.
    """

    config: FitConfig
    pipeline: PipelineConfig
    key: str
    fit: FitResult
    evaluation: Evaluation
    selection_mse: float
    stored: bool
    folder: Path
    system: str | None = None
    model_slug: str = ""

    @property
    def output(self) -> str:
        """The output."""
        return self.pipeline.mapping.output

    @property
    def unit(self) -> str:
        """The output's unit."""
        ends = self.fit.model.ends
        return ends.output_units[ends.outputs.index(self.output)]


@dataclass(frozen=True, kw_only=True, eq=False)
class BundleReady(Event):
    """The exported files are written and checked against their model.

    Args:
        of: The fit that they hold.
        folder: The bundle.
        exports: Per file its ``format``, ``file``, ``largest_difference`` and ``tolerance``.
        stored: Whether an earlier run wrote it.
        mapping: What the files map, where that is more than the fit's own output.
        told: Whether it has been told of already, for another output of the same files.
    """

    of: FitReady
    folder: Path
    exports: tuple[Mapping[str, Any], ...]
    stored: bool
    mapping: str = ""
    told: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class ReportReady(Event):
    """The report is written.

    Args:
        page: The HTML file.
        results: The machine-readable results.
        of: The fit that the report puts first.
    """

    page: Path
    results: Path
    of: FitReady


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgementReady(Event):
    """A judge has said what the error of some models does, and it is on disk.

    Args:
        pipeline: Name of the pipeline.
        subject: Name of what was judged.
        digest: Of what was said of it.
        metrics: Numbers to track with it, by name.
        fit_keys: Keys of the fits that it is made of, as far as they are known.
        tracked_as: Runs of the tracking store that it is made of, as far as they are known.
        page: The HTML file.
        document: The judgement as JSON.
        command: The command that makes it again.
        chosen: Whether it is the one of several that the pipeline keeps.
    """

    pipeline: str
    subject: str
    digest: str
    metrics: Mapping[str, float]
    fit_keys: tuple[str, ...]
    tracked_as: tuple[str, ...]
    page: Path
    document: Path
    command: str
    chosen: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class ResponseReady(Event):
    """A fit to a measured frequency response, its files and its page are on disk.

    Args:
        results: The contents of ``results.json``.
        key: Digest of everything that the fit depends on.
        stored: Whether it comes from an earlier run.
        page: The HTML file.
        document: The results as JSON.
        bundle: The exported files, where there are some.
    """

    results: ResponseResults
    key: str
    stored: bool
    page: Path
    document: Path
    bundle: Path | None


@dataclass(frozen=True, kw_only=True, eq=False)
class SweepReady(Event):
    """Every trial of a sweep is on disk, and its winner has gone through the steps.

    Args:
        record: The trials.
        folder: The run folder.
        command: The command that makes it again.
        data: Name of the data set.
        seed: Seed of the sweep.
    """

    record: SweepRecord
    folder: Path
    command: str
    data: str
    seed: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Warned(Event):
    """Something did not work and the run goes on without it.

    Args:
        text: What, and what it means.
    """

    text: str


@dataclass(frozen=True, kw_only=True, eq=False)
class RunDone(Event):
    """Everything is done.

    Args:
        results: What the run gives: mostly the contents of ``results.json``.
    """

    results: Any


Watcher = Callable[[Event], None]
"""Listens to a run. What it raises ends the run, so it raises nothing but its own faults."""
