"""Models side by side over every case, as MATLAB's ``compare`` sets them: figures, a table, a picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from sysid.api.given import ESTIMATED, TracesLike, traces_of
from sysid.api.several import Several
from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.estimation.remarks.equilibrium import begun_otherwise
from sysid.export.bundle import Bundle
from sysid.export.own_figures import side_by_side
from sysid.extras import need
from sysid.models import AbstractModel, Cascade, Start, StartLike
from sysid.traces import Role, TraceSet
from sysid.validation import Evaluation, evaluate_cascade, evaluate_outputs
from sysid.validation.beyond import beyond
from sysid.validation.first_state import first_states
from sysid.validation.metrics import percent
from sysid.validation.repeated import repeated
from sysid.validation.still import still

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Compared = FitResult | Several | Bundle
"""What is compared."""

"""How a free run begins unless told otherwise: its initial state is estimated from the first samples of each record."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Comparison:
    """Models side by side; printed, it is a table of fits as MATLAB's ``compare`` counts them.

    Args:
        evaluations: By label of the model: what it does on every case, in free run and one step ahead.
        outputs: By label: name and unit of the output that it is a model of.
        notes: What is to be known of the figures: fits that are not usable, records that go where none was fitted.
    """

    evaluations: dict[str, Evaluation]
    outputs: dict[str, tuple[str, str]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        cases = list(next(iter(self.evaluations.values())).cases) if self.evaluations else []
        head = ["free run, fit in percent", *cases]
        rows = [
            [label, *(percent(found.cases[case].free_run.nrmse_fit) for case in cases)]
            for label, found in self.evaluations.items()
        ]
        widths = [max(len(row[column]) for row in [head, *rows]) for column in range(len(head))]
        lines = [
            f"{row[0]:<{widths[0]}}"
            + "".join(f"   {cell:>{width}}" for cell, width in zip(row[1:], widths[1:], strict=True))
            for row in [head, *rows]
        ]
        return "\n".join([*lines, *self.notes])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"

    def to_frame(self) -> pd.DataFrame:
        """The figures as a table: a row for each model and case.

        Returns:
            Columns ``model``, ``output``, ``case``, ``role``, ``fit`` (percent), ``mse``, ``rmse``, ``max_abs_error``,
            ``r``, ``one_step_mse`` and ``unit``; all but the one-step figure are of the free run.
        """
        need("pandas", "a frame")
        import pandas as pd

        rows = [
            {
                "model": label,
                "output": self.outputs.get(label, ("", ""))[0],
                "case": case,
                "role": found.role.value,
                "fit": found.free_run.nrmse_fit,
                "mse": found.free_run.mse,
                "rmse": float(np.sqrt(found.free_run.mse)),
                "max_abs_error": found.free_run.max_abs_error,
                "r": found.free_run.r,
                "one_step_mse": found.one_step.mse,
                "unit": found.free_run.unit,
            }
            for label, evaluation in self.evaluations.items()
            for case, found in evaluation.cases.items()
        ]
        return pd.DataFrame(rows)

    def plot(self) -> Figure:
        """All models over the measured output, one panel for each output and case.

        Returns:
            A figure of matplotlib's, to restyle, show or save.
        """
        from sysid.reporting.figures.comparison_figure import Overlay, comparison_figure

        panels: dict[tuple[str, str], Overlay] = {}
        for label, evaluation in self.evaluations.items():
            output, unit = self.outputs.get(label, ("output", ""))
            for case, found in evaluation.cases.items():
                mine = Overlay(case=case, output=output, unit=unit, time=found.time, target=found.target)
                panel = panels.setdefault((output, case), mine)
                if len(panel.time) < len(mine.time):
                    # A model that needs fewer samples to begin with shows more of the measurement.
                    panel = panels[output, case] = replace(panel, time=mine.time, target=mine.target)
                panel.runs[label], panel.fits[label] = found.simulated, found.free_run.nrmse_fit
        return comparison_figure(list(panels.values()))


def compare(traces: TracesLike, *fits: Compared | Sequence[Compared], start: StartLike = ESTIMATED) -> Comparison:
    """Run fitted models over every case: fed with nothing but inputs and their own past output.

    Args:
        traces: The cases; those for validation count.
        fits: What is compared, or lists of it: fits, and bundles, as :func:`~sysid.read_bundle` reads them. What has
            several outputs has a row for each.
        start: How each free run begins, and from which sample on it is scored, as for :func:`~sysid.fit`; a bundle of
            models that read each other begins at rest.

    Returns:
        The figures; printing them shows a table, ``plot()`` draws them.

    Raises:
        ConfigError: If something else is compared, or nothing.
    """
    evaluations: dict[str, Evaluation] = {}
    outputs: dict[str, tuple[str, str]] = {}
    notes: dict[str, None] = {}
    models: list[AbstractModel] = []
    traces, start = traces_of(traces, word="compare"), Start.of(start)
    for one in _fits(fits):
        for judged in _judged(one, traces, start):
            label = judged.label if judged.label not in evaluations else f"{judged.label} ({len(evaluations) + 1})"
            evaluations[label], outputs[label] = judged.evaluation, (judged.output, judged.unit)
        for fit in [one] if isinstance(one, FitResult) else [*getattr(one, "fits", {}).values()]:
            models.append(fit.model)
            unsound = [] if fit.status.usable else [f"{fit.model.label}: {fit.status.value}"]
            notes |= dict.fromkeys((*unsound, *_beyond(fit, traces), *first_states(fit.model, traces, start)))
    notes |= dict.fromkeys(begun_otherwise(models, tuple(traces), start))
    return Comparison(evaluations=evaluations, outputs=outputs, notes=tuple(notes))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Judged:
    """A row of the table: one output of what is compared."""

    label: str
    output: str
    unit: str
    evaluation: Evaluation


def _judged(one: Compared, traces: TraceSet, start: Start) -> Iterator[_Judged]:
    """What is compared, output by output."""
    posterior = one.posterior if isinstance(one, FitResult) else None
    model = one.model
    if isinstance(model, Cascade) and not side_by_side(model):
        yield from _judged_whole(model, traces, [str(entry["name"]) for entry in getattr(one, "outputs", ())])
        return
    members = list(one.fits.values()) if not isinstance(one, FitResult) and hasattr(one, "fits") else model.models
    several = len(model.outputs) > 1
    for part in members:
        alone, uncertain = (part.model, part.posterior) if isinstance(part, FitResult) else (part, posterior)
        units = dict(zip(alone.mapping.outputs, alone.ends.output_units, strict=True))
        for output, found in evaluate_outputs(alone, traces, start, posterior=uncertain).items():
            label = f"{alone.label} -> {output}" if several else alone.label
            yield _Judged(label=label, output=output, unit=units[output], evaluation=found)


def _judged_whole(model: Cascade, traces: TraceSet, outputs: list[str]) -> Iterator[_Judged]:
    """Models that read each other: the free run of the whole, from rest."""
    measured = [channel.name for channel in traces.channels]
    there = [name for name in outputs or model.outputs if name in measured] or outputs
    for output, found in evaluate_cascade(model, traces, outputs=there).outputs.items():
        yield _Judged(label=f"assembly -> {output}", output=output, unit=model.units[output], evaluation=found)


def _fits(given: Sequence[Any]) -> list[Compared]:
    """One after the other, whether they were given one by one or in lists."""
    found = [one for part in given for one in (part if isinstance(part, list | tuple) else (part,))]
    strangers = dict.fromkeys(
        type(one).__name__ for one in found if not isinstance(one, FitResult | Bundle) and not hasattr(one, "fits")
    )
    if strangers or not found:
        raise ConfigError(
            "sysid.compare takes fits and bundles",
            where="fits",
            expected="what sysid.fit or sysid.read_bundle gives, one or several",
            got=", ".join(strangers) or "none",
            remedy="write sysid.compare(traces, fit, other); of a model, the fit that it is of; of a folder, "
            "sysid.read_bundle(folder)",
        )
    return found


def _beyond(fit: FitResult, traces: TraceSet) -> tuple[str, ...]:
    """What is said of cases beyond the records that a fit was made of, where it knows them, and of those among them."""
    made_of: TraceSet = getattr(fit, "traces", traces)
    fitted = made_of.with_role(Role.ESTIMATION)
    scored = [trace for trace in traces if not any(np.array_equal(trace.values, one.values) for one in fitted)]
    # A record that was fitted may stand beside the others, as long as it is called one.
    strangers = [one for one in traces if traces.roles[one.name] is not Role.ESTIMATION or one in scored]
    channels = (*fit.model.mapping.inputs, *fit.model.mapping.outputs)
    said = *beyond(fit.model, fitted, scored), *repeated(channels, fitted, strangers)
    return *said, *still(fit.model.mapping, fitted, scored)
