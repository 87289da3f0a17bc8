"""Models side by side over every case, as MATLAB's ``compare`` sets them: figures, a table, a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from sysid.api.given import TracesLike, traces_of
from sysid.api.several import Several
from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.extras import need
from sysid.models import Start, StartKind, StartLike
from sysid.traces import Role, TraceSet
from sysid.validation import Evaluation, evaluate_outputs
from sysid.validation.beyond import beyond
from sysid.validation.metrics import percent
from sysid.validation.repeated import repeated
from sysid.validation.still import still

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

ESTIMATED = Start(kind=StartKind.ESTIMATED)
"""How a free run begins unless told otherwise: its initial state is estimated from the first samples of each record."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Comparison:
    """Models side by side; printed, it is a table of fits as MATLAB's ``compare`` counts them.

    Args:
        evaluations: By label of the model: what it does on every case, in free run and one step ahead.
        outputs: By label: name and unit of the output that it is a model of.
        notes: What is to be known of the figures: records that go where none was fitted.
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


def compare(
    traces: TracesLike, *fits: FitResult | Several | Sequence[FitResult | Several], start: StartLike = ESTIMATED
) -> Comparison:
    """Run fitted models over every case: fed with nothing but inputs and their own past output.

    Args:
        traces: The cases; those for validation count.
        fits: What is compared, or lists of it; a fit of several outputs has a row for each.
        start: How each free run begins, and from which sample on it is scored, as for :func:`~sysid.fit`.

    Returns:
        The figures; printing them shows a table, ``plot()`` draws them.

    Raises:
        ConfigError: If something else is compared, or nothing.
    """
    evaluations: dict[str, Evaluation] = {}
    outputs: dict[str, tuple[str, str]] = {}
    notes: dict[str, None] = {}
    traces, start = traces_of(traces, word="compare"), Start.of(start)
    for fit in _fits(fits):
        members = [fit] if isinstance(fit, FitResult) else list(fit.fits.values())
        several = len(members) > 1 or len(members[0].model.mapping.outputs) > 1
        for one in members:
            notes |= dict.fromkeys(_beyond(one, traces))
            units = dict(zip(one.model.mapping.outputs, one.model.ends.output_units, strict=True))
            for output, found in evaluate_outputs(one.model, traces, start, posterior=one.posterior).items():
                label = f"{one.model.structure.label} -> {output}" if several else one.model.structure.label
                label = label if label not in evaluations else f"{label} ({len(evaluations) + 1})"
                evaluations[label], outputs[label] = found, (output, units[output])
    return Comparison(evaluations=evaluations, outputs=outputs, notes=tuple(notes))


def _fits(given: Sequence[Any]) -> list[FitResult | Several]:
    """One after the other, whether they were given one by one or in lists."""
    found = [one for part in given for one in (part if isinstance(part, list | tuple) else (part,))]
    strangers = dict.fromkeys(
        type(one).__name__ for one in found if not isinstance(one, FitResult) and not hasattr(one, "fits")
    )
    if strangers or not found:
        raise ConfigError(
            "sysid.compare takes fits",
            where="fits",
            expected="what sysid.fit gives, one or several",
            got=", ".join(strangers) or "none",
            remedy="write sysid.compare(traces, fit, other); of a model, the fit that it is of",
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
