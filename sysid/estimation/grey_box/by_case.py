"""Parameters that differ by case in a fit: which cases there are, and what is told of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from sysid.errors import ConfigError
from sysid.estimation.parameters.named import named_of
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import FitResult
from sysid.models import Start
from sysid.models.grey_box.case_values import case_of, cases_among
from sysid.models.grey_box.grey_box_model import EquationModel
from sysid.traces import Trace

_ModelT = TypeVar("_ModelT", bound=EquationModel)


def with_cases(
    template: _ModelT, experiments: Sequence[Experiment], selection: Sequence[Trace], start: Start
) -> _ModelT:
    """A model before its fit with a value for each case.

    Args:
        template: The model, with one value of each parameter.
        experiments: The records that are fitted.
        selection: Records that choose between starts.
        start: How their free runs begin.

    Returns:
        The model; as it is where no parameter differs by case.

    Raises:
        ConfigError: If a case has no record that is fitted, or a selection record is of none that is, and its start
            shows no sample of it.
    """
    grey = template.grey
    if not grey.by_case:
        return template
    fitted = [one.history.case for one in experiments]
    grey.check_records(fitted, [trace.name for trace in selection], start)
    cases = cases_among(fitted, grey.grouped)
    more = [one.start for _ in cases[1:] for one in grey.by_case]
    return replace(template, cases=cases, theta=np.concatenate([template.theta, more]))


def for_case(fit: FitResult, name: str) -> FitResult:
    """A fit whose model is the plain one of one case, with what is known of its parameters.

    Args:
        fit: A fit with parameters that differ by case.
        name: Of the case, or of a record of it.

    Returns:
        The fit.

    Raises:
        ConfigError: If there are no parameters by case, or that one was not fitted.
    """
    model = fit.model
    if not isinstance(model, EquationModel):
        raise ConfigError(
            "no parameter differs by case", where=model.structure.label,
            expected="equations with a parameter that is per: case", got=name, remedy="leave the case out",
        )  # fmt: skip
    plain, known = model.for_case(name), model.case_values
    assert known is not None  # noqa: S101 - otherwise there is no model of a case
    case = known.cases[known.row(name) or 0]
    places = known.columns(name, model.n_of_form)
    posterior = None if fit.posterior is None else replace(fit.posterior, factor=fit.posterior.factor[places])
    named = named_of(model.grey, model.cases, model.lowered.n_weights)
    kept = [i for i, one in enumerate(named) if one.case in {"", case}]
    uncertainty = fit.uncertainty
    if uncertainty is not None:
        uncertainty = replace(
            uncertainty,
            names=tuple(uncertainty.names[i] for i in kept),
            values=uncertainty.values[kept],
            covariance=uncertainty.covariance[np.ix_(kept, kept)],
            profile=None if uncertainty.profile is None else uncertainty.profile[kept],
        )
    return replace(fit, model=plain, posterior=posterior, uncertainty=uncertainty)


def case_notes(model: EquationModel, traces: Sequence[Trace]) -> list[str]:
    """What is told of parameters by case.

    Args:
        model: The model.
        traces: The records that were fitted.

    Returns:
        Sentences; none where no parameter differs by case.
    """
    if not model.cases:
        return []
    names, grouped = ", ".join(one.name for one in model.grey.by_case), model.grey.grouped
    many = f"Each of {len(model.cases)} cases has its own {names}."
    alone = f"There is one case alone: its {names} might as well be shared."
    told = [
        f"{many if len(model.cases) > 1 else alone} A record of another case is run with what its first samples show, "
        "or not at all; exported files take it as an input."
    ]
    fitted = {trace.name for trace in traces}
    others = [one for _, records in grouped for one in records if one not in fitted]
    if others:
        told.append(
            "Not fitted, and run with the values of the case that names them: "
            + ", ".join(f"{one} ({case_of(one, grouped)})" for one in others)
            + "."
        )
    return told
