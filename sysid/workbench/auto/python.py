"""The search from Python: :func:`sysid.auto`."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping as Dict
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid.api.fits import Fit
from sysid.api.given import TracesLike, traces_of
from sysid.api.looking import mapping_of
from sysid.api.notebook import html_of
from sysid.api.system_fit import SystemFit
from sysid.errors import ConfigError
from sysid.extras import need
from sysid.field_checks import check
from sysid.models import Mapping, Start, StartKind, StartLike
from sysid.models.channels.rest_levels import levels_at_rest
from sysid.names import slug
from sysid.reporting.sweep_record import FIGURES, SweepRecord
from sysid.traces import TraceSet
from sysid.workbench.auto.config import AutoConfig
from sysid.workbench.auto.found import FOUND, LINEAR
from sysid.workbench.auto.run import Searched, auto_of, run_auto
from sysid.workbench.fits.data import data_of
from sysid.workbench.fits.record import read_fit
from sysid.workbench.fits.table import told_of_fits
from sysid.workbench.runner.store import RunFolder

if TYPE_CHECKING:
    import pandas as pd

COMMAND = "sysid.auto(...)"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class AutoSearch:
    """What a search found.

    Args:
        fit: The chosen model, fitted to all estimation traces.
        linear: The best linear one; the same as ``fit`` where no network does better.
        why: Why this one, in words.
        notes: What speaks against a fit, what chose, and what in the record asks to be looked at.
        hurried: Of these, that there was no search, as the time was up before structures were compared; else empty.
        record: Every trial.
    """

    fit: Fit | SystemFit
    linear: Fit | SystemFit | None
    why: str
    notes: tuple[str, ...]
    hurried: str
    record: SweepRecord

    def to_frame(self) -> pd.DataFrame:
        """Everything that was tried, the least error first.

        Returns:
            Columns ``structure``, ``rmse`` (of the free run over what chose), ``parameters``, ``operations``,
            ``run_time_s``, ``seconds``, ``status`` and ``front``: whether nothing beats it in error and in size.
        """
        need("pandas", "a frame")
        import pandas as pd

        front = {trial.number for trial in self.record.front()}
        rows = [
            {
                "structure": trial.label,
                **{name: value for name, value in trial.values.items() if name != "structure"},
                "rmse": trial.selection_free_run_mse**0.5 if trial.in_full else float("nan"),
                "parameters": trial.parameters,
                "operations": trial.operations,
                "run_time_s": FIGURES["run_time"].of(trial, "selection"),
                "seconds": trial.seconds,
                "status": trial.status,
                "front": trial.number in front,
            }
            for trial in self.record.trials
        ]
        return pd.DataFrame(rows).sort_values("rmse", ignore_index=True)

    def __str__(self) -> str:
        return "\n".join([self.why, *(note for note in self.notes if note not in self.why)])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return html_of(self)


def auto(
    traces: TracesLike,
    mapping: str | Mapping | Dict[str, Any] | None = None,
    *,
    minutes: float | None = None,
    iterations: int | None = None,
    seed: int = 0,
    start: StartLike = Start(kind=StartKind.ESTIMATED),  # noqa: B008 - frozen
    rest_output: float | Dict[str, float] | None = None,
    workers: int = 1,
    folder: str | Path | None = None,
) -> AutoSearch:
    """Find a model: linear ones first, then nonlinear ones of growing size, as long as they gain and there is time.

    Selection traces choose; without any, parts of the estimation traces are held out in turn, and what is chosen is
    fitted once more to all of them. Validation and test traces are never looked at.

    Args:
        traces: The data set.
        mapping: Inputs and outputs; not needed for two channels.
        minutes: Wall time; 10 by default.
        iterations: In place of minutes, iterations of training: the result is then the same on every machine.
        seed: Seed of everything random.
        start: How each free run begins.
        rest_output: The output's value at rest, or by name of several.
        workers: Processes that train, one thread each.
        folder: Where trials, report and bundle are kept; a search that was stopped goes on there. None are by default.

    Returns:
        What was found: the fit, why, and everything that was tried.

    Raises:
        ConfigError: If no trace is for estimation, both budgets are given, or nothing that was tried can be used.
        ChannelError: If a channel of the mapping is missing.
    """
    traces = traces_of(traces, word="auto")
    chosen, start = mapping_of(traces, mapping), Start.of(start)
    rest = levels_at_rest(rest_output, chosen.outputs) or {}
    fields = {
        **{"kind": "auto", "name": slug(traces.name) or "auto", "data": traces.name, "mapping": chosen, "seed": seed},
        **{"start": start, "rest": rest, "minutes": minutes, "iterations": iterations, "workers": workers},
        **({"export": None} if folder is None else {}),
    }
    config = check(AutoConfig, fields, where="sysid.auto")
    data = data_of(traces, chosen)
    place = nullcontext(folder) if folder is not None else tempfile.TemporaryDirectory()
    with place as where:
        found = run_auto(auto_of(config, load=lambda: data, page=folder is not None), Path(where), command=COMMAND)
        fits = {name: _fit(name, found, start, Path(where), traces) for name in (FOUND, LINEAR)}
    best = fits[FOUND]
    if best is None:
        raise ConfigError("the chosen fit has gone from the folder", where=folder, remedy="run the search again")
    return AutoSearch(
        fit=best, linear=fits[LINEAR] or best, why=found.record.chosen_by,
        notes=(*told_of_fits(found.results, in_full=True), *found.told), hurried=found.hurried, record=found.record,
    )  # fmt: skip


def _fit(name: str, found: Searched, start: Start, folder: Path, traces: TraceSet) -> Fit | SystemFit | None:
    """A fit of the pipeline, with its data beside it; ``None`` where there is none of that name."""
    told = [one for one in found.results.fits if name in {one.name, one.system}]
    models = dict.fromkeys(one.model_slug or one.slug for one in told)
    fits = [Fit.of(read_fit(RunFolder(path=folder).fit(slug)), traces, start) for slug in models]
    return SystemFit.of({one.model.mapping.output: one for one in fits}) if len(fits) > 1 else next(iter(fits), None)
