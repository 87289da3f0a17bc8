"""What a pipeline works on: the traces that it names, with the roles that it needs, in the same terms."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sysid.content import content_folders
from sysid.errors import ConfigError
from sysid.models import Mapping
from sysid.traces import Role, Trace, TraceSet
from sysid.workbench.annotation import annotated_set, find_annotator, weighted
from sysid.workbench.fits.config import PipelineConfig
from sysid.workbench.kinds import data_of_pipeline
from sysid.workbench.runner.steps import Estimate

if TYPE_CHECKING:
    from sysid.ingest.datasets.dataset import Unmade


@dataclass(frozen=True, kw_only=True, eq=False)
class Data:
    """What a pipeline works on.

    Args:
        traces: The data set: every case that is scored.
        selection: Traces that choose between fits and nothing else.
        sequences: Traces over which a free run has to stay stable, where a data set of them is declared.
    """

    traces: TraceSet
    selection: tuple[Trace, ...]
    sequences: tuple[Trace, ...] = ()

    @property
    def estimation(self) -> tuple[Trace, ...]:
        """The traces that are fitted."""
        return self.traces.with_role(Role.ESTIMATION)


def data_of(traces: TraceSet, mapping: Mapping) -> Data:
    """A data set as a pipeline works on it, if it can.

    Args:
        traces: The data set.
        mapping: Inputs and outputs.

    Returns:
        The data.

    Raises:
        ConfigError: If no trace is for estimation.
        ChannelError: If a channel of the mapping is missing.
    """
    traces.traces[0].columns((*mapping.inputs, *mapping.outputs))
    _ = traces.estimation  # refused where there is none
    return Data(traces=traces, selection=traces.with_role(Role.SELECTION))


def load_data(config: PipelineConfig, *, beside: Path, progress: Callable[[str], None]) -> Data:
    """Load the traces of a pipeline and check that they can do what it asks.

    Args:
        config: The pipeline.
        beside: Folder of the pipeline's file: a path to a data set is relative to it.
        progress: Told what is being done.

    Returns:
        The data.

    Raises:
        ConfigError: If no trace is for estimation, or a trace that chooses is also scored.
        ChannelError: If a channel of the mapping is missing.
    """
    names = (*config.mapping.inputs, *config.mapping.outputs)
    known = data_of(_annotated(_load(config.data, beside, progress), config), config.mapping)
    traces, selection = known.traces, known.selection
    if config.selection is not None:
        chosen = _annotated(_load(config.selection, beside, progress), config)
        selection = (*selection, *_selection_traces(chosen, traces, names))
    sequences: tuple[Trace, ...] = ()
    if config.stability.sequences is not None:
        declared = _load(config.stability.sequences, beside, progress)
        declared.traces[0].columns(names)
        sequences = tuple(declared)
    return Data(traces=traces, selection=selection, sequences=sequences)


def unmade_data(names: Iterable[str | None], *, beside: Path) -> Estimate | None:
    """How long it takes to make the traces that data sets lack.

    Args:
        names: Data sets, by name or by folder beside the pipeline's file; ``None`` is none.
        beside: Folder of the pipeline's file.

    Returns:
        The time, as far as it is known; ``None`` if all that they have is there to be loaded.

    Raises:
        ConfigError: If there is no such data set.
    """
    from sysid.ingest.datasets.dataset import unmade
    from sysid.ingest.reading import is_file_of_traces

    found = []
    for name in dict.fromkeys(name for name in names if name is not None):
        place, search = _place(name, beside)
        source = data_of_pipeline(Path(place))
        if source is not None:
            found.append(source.unmade())
        elif not is_file_of_traces(place):
            found.append(unmade(place, search=search))
    return estimate_of([one for one in found if one is not None])


def estimate_of(lacking: Sequence[Unmade]) -> Estimate | None:
    """How long it takes to make what data lack.

    Args:
        lacking: What each lacks.

    Returns:
        The time, as far as it is known; ``None`` if nothing is lacking.
    """
    if not lacking:
        return None
    made = (
        f"{sum(one.cases for one in lacking)} traces to be made by {', '.join({one.generator: 0 for one in lacking})}"
    )
    known = [one.seconds for one in lacking if one.seconds is not None]
    if len(known) < len(lacking):
        return Estimate(seconds=None, basis=f"{made}; not known before it has made one here")
    return Estimate(seconds=sum(known), basis=f"{made}, as long as those that it has made here")


def _place(name: str, beside: Path) -> tuple[Path | str, Sequence[Path]]:
    """What to load, and where a name is looked for."""
    local = beside / name
    # A workspace is three folders side by side: its data sets are found from wherever it is run.
    return (local if local.exists() else name), (beside.parent / "datasets", *content_folders("datasets"))


def _annotated(traces: TraceSet, config: PipelineConfig) -> TraceSet:
    """The traces with states and weights, where the pipeline asks for them."""
    if config.annotate is None:
        return traces
    annotator = find_annotator(config.annotate.by, where="annotate, by")
    known = annotated_set(traces, annotator)
    return dataclasses.replace(
        known, traces=tuple(weighted(trace, annotator, config.annotate.weights) for trace in known)
    )


def load_named(name: str, beside: Path, *, progress: Callable[[str, int, int], None]) -> TraceSet:
    """Load a data set as a pipeline names it.

    Args:
        name: Its name, its folder beside the pipeline's file, a file with traces, whose one trace is for estimation, or
            a pipeline of kind ``experiment``, which is run.
        beside: Folder of the pipeline's file.
        progress: Called as ``progress(case, index, count)`` before each case.

    Returns:
        Its traces.
    """
    from sysid.api.fitting import load
    from sysid.ingest import load_dataset
    from sysid.ingest.reading import is_file_of_traces

    place, search = _place(name, beside)
    if (source := data_of_pipeline(Path(place))) is not None:
        return source.load(lambda case, done, count: progress(case, done - 1, count))
    if is_file_of_traces(place):
        return load(place)
    return load_dataset(place, search=search, progress=progress)


def _load(name: str, beside: Path, progress: Callable[[str], None]) -> TraceSet:
    def report(case: str, index: int, count: int) -> None:
        progress(f"{name}: {case} ({index + 1} of {count})")

    return load_named(name, beside, progress=report)


def _selection_traces(chosen: TraceSet, traces: TraceSet, names: Sequence[str]) -> tuple[Trace, ...]:
    """The traces that may choose: of that role, in the same terms, and not among those that are scored."""
    found = chosen.with_role(Role.SELECTION)
    if not found:
        raise ConfigError(
            "no trace is for selection",
            where=f"data set {chosen.name}",
            expected="a case with role: selection",
            got=", ".join(f"{name}: {role.value}" for name, role in chosen.roles.items()),
            remedy="give a case that role in the data set's dataset.yaml, or leave selection out",
        )
    scored = {trace.digest: trace.name for trace in traces if traces.roles[trace.name] is not Role.SELECTION}
    for trace in found:
        trace.columns(names)
        if trace.digest in scored:
            raise ConfigError(
                f"the selection trace {trace.name} is the case {scored[trace.digest]}",
                where=f"data set {chosen.name}",
                expected="traces that are neither fitted nor scored",
                remedy="a score counts only if nothing was chosen on it: use another trace",
            )
        ours, theirs = ([(t.channel(n).unit, t.channel(n).reference) for n in names] for t in (traces.traces[0], trace))
        if ours != theirs or not math.isclose(trace.sample_time, traces.sample_time, rel_tol=1e-9):
            raise ConfigError(
                f"the selection trace {trace.name} is not in the terms of the data",
                where=f"data set {chosen.name}",
                expected=f"{_terms(traces.traces[0], names)}",
                got=f"{_terms(trace, names)}",
                remedy="convert or resample it at ingest",
            )
    return found


def _terms(trace: Trace, names: Sequence[str]) -> str:
    return f"{', '.join(trace.channel(name).label for name in names)} every {trace.sample_time:g} s"
