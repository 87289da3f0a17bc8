"""Is linear enough? The chosen linear free run against the chosen network, by the amplitude of the case.

A linear model answers twice the input with twice the output. A system that does not can still be fitted at one
amplitude, so that a mean over cases hides what matters: the verdict is given amplitude by amplitude.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sysid.traces import Role
from sysid.validation.evaluation import Evaluation
from sysid.validation.metrics import is_constant, mean_fit

SMALL, LARGE = 1.0 / 3.0, 0.85
"""Amplitudes, as parts of the largest, up to which a case is small, and from which it is full."""
ENOUGH = 95.0
"""NRMSE fit in percent from which a linear free run is called good at an amplitude."""
FACTOR = 2.0
"""How many times smaller the network's error must be for the linear model to be called worse at an amplitude."""


class Amplitude(enum.Enum):
    """How far the output of a case moves; the value is its name in tables."""

    MINIMUM = "minimum"
    INTERMEDIATE = "intermediate"
    FULL = "full"


class Answer(enum.Enum):
    """The verdict; the value is the sentence that a person reads."""

    LINEAR = (
        f"A linear model may do: at every amplitude its fit is {ENOUGH:.0f} % or more, or its error is less than twice "
        "the network's."
    )
    NETWORK = "Linear is not enough: at some amplitude the network's error is less than half the linear model's."
    NEITHER = (
        "Neither is good at every amplitude, and the network is not clearly better: more or other data are needed."
    )
    UNKNOWN = "No answer: it takes a linear model, a network, and cases that neither was chosen on."


WORST_FIRST = (Answer.NETWORK, Answer.NEITHER, Answer.UNKNOWN, Answer.LINEAR)
"""What the verdict on an output makes of the one on all."""


@dataclass(frozen=True, kw_only=True)
class AmplitudeRow:
    """Both kinds at one amplitude.

    Args:
        amplitude: Which.
        cases: Names of its cases.
        linear: Name of the linear model.
        linear_fit: Its mean fit over these cases in percent.
        network: Name of the network.
        network_fit: Its mean fit over these cases in percent.
        output: Which output it is about, where there are several.
        better_linear: Name of another linear model with a higher mean fit here, which was not chosen.
        better_linear_fit: That fit in percent.
        better_network: Likewise of another network.
        better_network_fit: That fit in percent.
    """

    amplitude: Amplitude
    cases: tuple[str, ...]
    linear: str
    linear_fit: float
    network: str
    network_fit: float
    output: str = ""
    better_linear: str = ""
    better_linear_fit: float = math.nan
    better_network: str = ""
    better_network_fit: float = math.nan

    @property
    def good(self) -> bool:
        """Whether the linear model is good here."""
        return self.linear_fit >= ENOUGH

    @property
    def worse(self) -> bool:
        """Whether the linear model's error is more than ``FACTOR`` times the network's, and not good."""
        return not self.good and 100.0 - self.linear_fit > FACTOR * (100.0 - self.network_fit)

    def to_dict(self) -> dict[str, Any]:
        """The row as JSON values."""
        return {
            "amplitude": self.amplitude.value,
            "cases": list(self.cases),
            "linear": self.linear,
            "linear_fit": self.linear_fit,
            "network": self.network,
            "network_fit": self.network_fit,
            **({"output": self.output} if self.output else {}),
            **({"better_linear": self.better_linear} if self.better_linear else {}),
            **({"better_linear_fit": self.better_linear_fit} if self.better_linear else {}),
            **({"better_network": self.better_network} if self.better_network else {}),
            **({"better_network_fit": self.better_network_fit} if self.better_network else {}),
        }


@dataclass(frozen=True, kw_only=True)
class Linearity:
    """The verdict on a data set.

    Args:
        rows: By amplitude, smallest first, output by output; amplitudes without a case are left out.
        answer: The verdict.
        by_output: The verdict on each output, where there are several.
    """

    rows: tuple[AmplitudeRow, ...]
    answer: Answer
    by_output: Dict[str, Answer] = field(default_factory=dict)

    @classmethod
    def of_outputs(cls, each: Dict[str, Linearity]) -> Linearity:
        """The verdict on several outputs: a linear model is enough for the whole where it is for each of them.

        Args:
            each: By output its verdict.

        Returns:
            The verdict; of one output the output's.
        """
        if len(each) == 1:
            return next(iter(each.values()))
        rows = tuple(replace(row, output=output) for output, one in each.items() for row in one.rows)
        worst = min((one.answer for one in each.values()), key=WORST_FIRST.index, default=Answer.UNKNOWN)
        return cls(rows=rows, answer=worst, by_output={output: one.answer for output, one in each.items()})

    @property
    def text(self) -> str:
        """The verdict in words; of several outputs with those that each sentence is about."""
        if not self.by_output:
            return self.answer.value
        about: dict[Answer, list[str]] = {}
        for output, answer in self.by_output.items():
            about.setdefault(answer, []).append(output)
        return " ".join(f"{', '.join(about[answer])}: {answer.value}" for answer in WORST_FIRST if answer in about)

    def to_dict(self) -> dict[str, Any]:
        """The verdict as JSON values."""
        return {"answer": self.answer.name, "text": self.text, "rows": [row.to_dict() for row in self.rows]}


def judge_linearity(
    linear: Dict[str, Evaluation], networks: Dict[str, Evaluation], *, ranked: Sequence[str] = ()
) -> Linearity:
    """Compare a linear free run with a network's, amplitude by amplitude; unseen cases count, and no other.

    Args:
        linear: Evaluations of linear models by name, on the same cases.
        networks: Evaluations of networks by name, on the same cases.
        ranked: Names of both kinds by what chose between them, best first: the first of each kind is judged, and of
            the others it is only said where one would be better. Without it each amplitude has the best of each kind,
            which asks what the kind can do, and is too kind to whichever has more models.

    Returns:
        The verdict.
    """
    groups = _by_amplitude([*linear.values(), *networks.values()])
    if not linear or not networks or not groups:
        return Linearity(rows=(), answer=Answer.UNKNOWN)
    rows = []
    for amplitude in Amplitude:
        cases = groups.get(amplitude, ())
        if cases:
            both = {"linear": _shown(linear, cases, ranked), "network": _shown(networks, cases, ranked)}
            fields = {name.format(kind): value for kind, found in both.items() for name, value in found.items()}
            rows.append(AmplitudeRow(amplitude=amplitude, cases=cases, **fields))
    if any(row.worse for row in rows):
        answer = Answer.NETWORK
    elif all(row.good or row.linear_fit >= row.network_fit - 1.0 for row in rows):
        answer = Answer.LINEAR
    else:
        answer = Answer.NEITHER
    return Linearity(rows=tuple(rows), answer=answer)


def _by_amplitude(evaluations: Sequence[Evaluation]) -> dict[Amplitude, tuple[str, ...]]:
    """Unseen cases by how far their target moves, relative to the one that moves furthest."""
    if not evaluations:
        return {}
    unseen = {n: c for n, c in evaluations[0].cases.items() if c.role in {Role.VALIDATION, Role.TEST}}
    # A target that does not vary has no amplitude, and no fit in percent either.
    spans = {name: 0.0 if is_constant(case.target) else float(np.ptp(case.target)) for name, case in unseen.items()}
    largest = max(spans.values(), default=0.0)
    groups: dict[Amplitude, tuple[str, ...]] = {}
    for name, span in spans.items():
        if span > 0.0:
            part = span / largest
            kind = Amplitude.MINIMUM if part <= SMALL else Amplitude.FULL if part >= LARGE else Amplitude.INTERMEDIATE
            groups[kind] = (*groups.get(kind, ()), name)
    return groups


def _shown(evaluations: Dict[str, Evaluation], cases: Sequence[str], ranked: Sequence[str]) -> dict[str, Any]:
    """The chosen one and its fit, and the best of the others where that is better, by field of a row."""
    fits = {
        name: mean_fit(evaluation.cases[case].free_run.nrmse_fit for case in cases)
        for name, evaluation in evaluations.items()
    }
    best = max(fits, key=lambda key: fits[key] if np.isfinite(fits[key]) else -np.inf)
    chosen = next((name for name in ranked if name in fits), best)
    better = {"better_{}": best, "better_{}_fit": fits[best]} if not fits[chosen] >= fits[best] else {}
    return {"{}": chosen, "{}_fit": fits[chosen], **better}
