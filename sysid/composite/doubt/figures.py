"""From which difference on a committee says that it does not know, and how far that can be trusted."""

from __future__ import annotations

import re
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.composite.doubt.committee import APART, committee
from sysid.errors import ConfigError
from sysid.models import AbstractModel, Cascade, Limit
from sysid.models.cascades.cascade_run import Level
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True)
class DoubtFigures:
    """How far doubt can be trusted.

    Args:
        samples: How many were looked at.
        wrong: Share of them with an error over what is allowed.
        flagged: Share of the wrong ones that are in doubt; 1 where none is wrong.
        false: Share of the others that are in doubt.
        error: What is allowed, in the output's unit.
        threshold: From which difference an answer is in doubt, in the output's unit.
    """

    samples: int
    wrong: float
    flagged: float
    false: float
    error: float
    threshold: float


def doubt_threshold(
    wholes: Sequence[Cascade | AbstractModel],
    traces: Sequence[Trace],
    output: str,
    *,
    error: float,
    false: float = 0.05,
    each: bool = False,
    mean: bool = False,
    rest: Dict[str, Level] | None = None,
) -> float:
    """The smallest threshold at which hardly any right answer is in doubt.

    Args:
        wholes: The committee.
        traces: Sequences that trained none of them, with the inputs and the measured output; of more than one kind, or
            it holds for that kind only.
        output: The output.
        error: Largest error of a right answer, in its unit.
        false: Share of the right answers that may be in doubt.
        each: As in :func:`committee`.
        mean: Whether the mean of all answers.
        rest: As in :func:`committee`.

    Returns:
        In the output's unit.

    Raises:
        ConfigError: If no answer is right, or they cannot be a committee.
    """
    both = committee(wholes, {output: 1.0}, each=each, mean=[output] if mean else (), rest=rest)
    apart, errors = _apart(both, traces, output)
    right = apart[errors <= error]
    if not len(right):
        raise ConfigError(
            "no answer of the committee is right",
            where="doubt_threshold",
            expected=f"samples of {output} with an error of at most {error:g}",
            got=f"none of {len(errors)}",
            remedy="allow a larger error, or train better surrogates",
        )
    return float(max(np.quantile(right, 1.0 - false), np.finfo(np.float64).tiny))


def doubt_figures(whole: Cascade, traces: Sequence[Trace], output: str, *, error: float) -> DoubtFigures:
    """How many wrong answers a committee doubts, and how many right ones.

    Args:
        whole: The committee.
        traces: Sequences with the inputs and the measured output, which chose neither it nor its threshold.
        output: A judged output.
        error: Largest error of a right answer, in its unit.

    Returns:
        The figures over all samples.

    Raises:
        ConfigError: If the output is not judged.
    """
    limit = whole.limits[judging[0]].high if (judging := _judging(whole, output)) else None
    if not isinstance(limit, float):
        raise ConfigError(
            f"{output} is not judged by this committee",
            where="doubt_figures",
            expected="an output with a threshold",
            got=output,
            remedy="name it when the committee is made",
        )
    apart, errors = _apart(whole, traces, output)
    wrong, doubted = errors > error, apart >= limit
    return DoubtFigures(
        samples=len(errors),
        wrong=float(np.mean(wrong)),
        flagged=float(np.mean(doubted[wrong])) if wrong.any() else 1.0,
        false=float(np.mean(doubted[~wrong])) if not wrong.all() else 0.0,
        error=error,
        threshold=limit,
    )


def _apart(whole: Cascade, traces: Sequence[Trace], output: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """At every sample how far the answers are apart, as what judges them has it, and the answer from the measured."""
    groups = [whole.member(name).mapping.inputs for name in _judging(whole, output)]
    apart, errors = [], []
    for trace in traces:
        run = whole.simulate_trace(trace)
        each = [np.abs(run[one] - (np.mean([run[name] for name in rest], axis=0) if rest else 0.0))
                for one, *rest in groups]  # fmt: skip
        apart.append(np.max(each, axis=0))
        errors.append(np.abs(run[output] - trace[output]))
    return np.concatenate(apart), np.concatenate(errors)


def _judging(whole: Cascade, output: str) -> list[str]:
    """The channels that say how far apart the answers are: one, or one for each of the others."""
    pattern = re.compile(re.escape(output + APART) + r"(_\d+)?")
    return [name for name in whole.outputs if pattern.fullmatch(name) and whole.limits.get(name, Limit()).doubt]
