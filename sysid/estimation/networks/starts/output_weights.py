r"""Outputs weighed by their noise: what maximum likelihood makes of outputs whose noise is not known.

With independent noise of unknown variance on each output, the likelihood is largest where
:math:`\prod_o \sum_t e_{t,o}^2` is least. Its minimum is that of a sum of squares in which each output is divided by
the variance that is left of it. That is found by turns, from what a linear model leaves on: fit, take the variances,
fit again. Weights have the geometric mean 1, so that losses and evidence of differently weighed fits can be compared;
the inequality of the means says that a weighed loss is never above the one it came from.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.provider import AbstractWeighing
from sysid.estimation.networks.starts.advancing import advanced
from sysid.estimation.networks.starts.multistart import Candidate, Multistart

ROUNDS = 3
"""Times that the variances are taken anew."""

SHARE = 0.4
"""Share of the iterations of a fit that a round may take."""

WIDEST = 1e4
"""Largest ratio of two weights: 100 times the noise. An output that the model meets exactly is not all that counts."""

ALIKE = 0.3
"""Largest change of a weight's logarithm that is not worth another round."""


Provider = TypeVar("Provider", bound=AbstractWeighing)


def weighed(provider: Provider, theta: NDArray[np.float64]) -> Provider:
    """The same residuals, each output's over the variance that some parameters leave of it.

    Args:
        provider: The residuals.
        theta: The parameters.

    Returns:
        The residuals; as they are where there is one output.
    """
    left = provider.variances(theta)
    if len(left) == 1:
        return provider
    logs = -np.log(np.maximum(left, max(float(left.max()), np.finfo(np.float64).tiny) / WIDEST))
    return provider.with_output_weights(tuple(np.exp(logs - logs.mean()).tolist()))


def reweighted(multistart: Multistart, provider: Provider, best: Candidate) -> list[tuple[Candidate, Provider]]:
    """The best candidate, trained on with outputs weighed by what is left of them.

    Args:
        multistart: What the candidates have in common.
        provider: Their residuals.
        best: The candidate.

    Returns:
        One candidate a round, with its residuals; none where outputs are known alike.
    """
    found: list[tuple[Candidate, Provider]] = []
    iterations = max(1, round(SHARE * multistart.training.max_iterations))
    for turn in range(ROUNDS):
        anew = weighed(provider, best.solution.theta)
        if anew.output_weights is None or multistart.stop.is_set():
            break
        now = provider.output_weights or (1.0,) * len(anew.output_weights)
        if np.abs(np.log(np.divide(anew.output_weights, now))).max() < ALIKE:
            break
        provider = anew
        name = f"start {best.number + 1}, outputs by their noise, {turn + 1}"
        best = advanced(multistart, provider, best, name=name, iterations=iterations)
        found.append((best, provider))
    return found
