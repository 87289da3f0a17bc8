"""Finalists of a search as a table, as text and as a frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sysid.errors import ConfigError
from sysid.estimation.linear.order_search import Criterion
from sysid.extras import need
from sysid.reporting.numbers import pole
from sysid.validation.metrics import percent
from sysid.validation.order_finalists import Finalist

if TYPE_CHECKING:
    import pandas as pd

Score = Callable[[Finalist, Criterion], float]


def criterion_of(word: str) -> Criterion:
    """A criterion by its name.

    Args:
        word: ``AIC``, ``AICc``, ``BIC`` or ``loss``, in any case.

    Returns:
        The criterion.

    Raises:
        ConfigError: If there is none of this name.
    """
    known = {one.value.lower(): one for one in Criterion}
    if word.lower() not in known:
        raise ConfigError(
            "unknown criterion",
            where="criterion",
            expected=", ".join(one.value for one in Criterion),
            got=word,
            remedy="write one of these, or leave it out for the best free run",
        )
    return known[word.lower()]


def table_of(finalists: Sequence[Finalist], score: Score) -> pd.DataFrame:
    """Finalists as a frame.

    Args:
        finalists: In their order.
        score: A criterion of one.

    Returns:
        A row for each; see :meth:`sysid.api.order_search.OrderSearch.to_frame`.
    """
    need("pandas", "a frame")
    import pandas as pd

    criteria = (Criterion.AIC, Criterion.AICC, Criterion.BIC)
    rows = [
        {
            "structure": one.fit.model.structure.label,
            "parameters": one.fit.model.n_parameters,
            "one_step_mse": one.one_step_mse,
            **{criterion.value: score(one, criterion) for criterion in criteria},
            "fit": one.mean_fit,
            "largest_pole": one.pole_radius,
            "stable": bool(np.isfinite(one.mean_fit)) and not one.pole_radius >= 1.0,
        }
        for one in finalists
    ]
    return pd.DataFrame(rows)


def lines_of(finalists: Sequence[Finalist], score: Score) -> list[str]:
    """Finalists as lines of text, a head above them.

    Args:
        finalists: In their order.
        score: A criterion of one.

    Returns:
        The lines.
    """
    wide = max([23, *(len(one.fit.model.structure.label) for one in finalists)]) + 1
    head = f"{'structure':<{wide}}{'parameters':>11}{'one-step mse':>14}{'BIC':>12}{'free run, fit %':>17}"
    head += f"{'largest pole':>14}"
    return [
        head,
        *(
            f"{one.fit.model.structure.label:<{wide}}{one.fit.model.n_parameters:>11}{one.one_step_mse:>14.4g}"
            f"{score(one, Criterion.BIC):>12.1f}{percent(one.mean_fit):>17}"
            f"  {pole(one.pole_radius):>12}"
            for one in finalists
        ),
    ]
