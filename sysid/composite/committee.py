r"""A committee: several surrogates of the same outputs side by side, which says at each sample whether it knows.

What a surrogate never saw it answers all the same. Where several that were trained apart (other seeds, data or
structures) agree, the answer is mostly right; where they do not, none of them knows. The first answers; it is in doubt
at a sample where

.. math:: \Bigl| y_1 - \operatorname{med}(y_2, \dots, y_n) \Bigr| \ge d,

query by committee (Seung, Opper and Sompolinsky 1992; ensemble variance of Krogh and Vedelsby 1995) at run time, by the
median: one of three others that runs away raises neither a doubt of its own nor the threshold of all. The
difference is a channel of the whole like any other, held between :math:`\pm d`, so that every export computes it and
raises the flag ``IN_DOUBT``. With ``each`` it is in doubt where it is as far from any one of them: the others may then
be the first itself, what its switches compare moved up and down (:func:`sysid.composite.perturbed`), whose mean says
nothing. The threshold is found on sequences that trained nothing: :func:`doubt_threshold`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.models import NARX, AbstractModel, Cascade, Limit, Mapping, NARXModel, Scaling
from sysid.models.wiring import Member
from sysid.traces import Trace

APART = "_apart"
"""Behind the name of an output: the channel of its difference."""


def committee(
    wholes: Sequence[Cascade | AbstractModel], thresholds: Dict[str, float], *, each: bool = False
) -> Cascade:
    """Surrogates of the same outputs as one, which the first of them answers and the others doubt.

    Args:
        wholes: Two or more with the same inputs, units and sample time.
        thresholds: By output, in its unit: the difference from the median of the others from which it is in doubt.
        each: Whether it is the difference from any one of the others.

    Returns:
        The channels of the first under their names; of the others with their number behind them (``BC_2``); and of
        each judged output the difference (``BC_apart``), or those from each of the others (``BC_apart_2``), and of
        three others and more what puts them in order (``BC_lower``, ``BC_upper``).

    Raises:
        ConfigError: If there are fewer than two, they have not the same inputs, one of them does not compute a judged
            output, or a threshold is not positive.
    """
    cascades = [one if isinstance(one, Cascade) else Cascade(models=(one,)) for one in wholes]
    _check(cascades, thresholds)
    taken = {*cascades[0].inputs, *cascades[0].outputs}
    names = [{name: name for name in cascades[0].outputs}]
    for number, one in enumerate(cascades[1:], 2):
        names.append({name: _free(f"{name}_{number}", taken) for name in one.outputs})
    models = [renamed(model, own) for one, own in zip(cascades, names, strict=True) for model in one.models]
    rest: dict[str, Any] = {}
    limits: dict[str, Limit] = {}
    for one, own in zip(cascades, names, strict=True):
        rest |= {own.get(name, name): level for name, level in one.rest.items()}
        limits |= {own[name]: _limit(limit, own) for name, limit in one.limits.items()}
    for output, threshold in thresholds.items():
        first, *others = (own[output] for own in names)
        groups = {f"_{k}": [other] for k, other in enumerate(others, 2)} if each else {"": others}
        if not each and len(others) > 2:
            ordering = _Ordering(output=output, like=cascades[0], taken=taken)
            groups = {"": ordering.median(others)}
            models += ordering.models
            limits |= ordering.limits
        for behind, group in groups.items():
            name = _free(f"{output}{APART}{behind}", taken)
            models.append(_difference([first, *group], name, cascades[0], output))
            limits[name] = Limit(low=-float(threshold), high=float(threshold), doubt=True)
    return Cascade(models=tuple(models), rest=rest, limits=limits)


def _check(cascades: Sequence[Cascade], thresholds: Dict[str, float]) -> None:
    if len(cascades) < 2 or not thresholds or not all(0.0 < value < np.inf for value in thresholds.values()):
        raise ConfigError(
            "not a committee",
            where="committee",
            expected="two surrogates or more, and a positive threshold for one output or more",
            got=f"{len(cascades)} with {dict(thresholds)}",
            remedy="give surrogates that were trained apart; doubt_threshold finds a threshold",
        )
    first = cascades[0]
    for one in cascades[1:]:
        lacking = [name for name in thresholds if name not in one.outputs or name not in first.outputs]
        if set(one.inputs) != set(first.inputs) or lacking:
            raise ConfigError(
                "the surrogates do not answer the same question",
                where="committee",
                expected=f"{', '.join(first.inputs)} in, {', '.join(thresholds)} among what is computed",
                got=f"{', '.join(one.inputs)} in, {', '.join(one.outputs)} computed",
                remedy="give surrogates with the same inputs, and judge outputs that all of them compute",
            )


def _free(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def renamed(model: Member, names: Dict[str, str]) -> Member:
    """A model over other channels.

    Args:
        model: The model.
        names: New names by old ones; channels that are not named keep theirs.

    Returns:
        The model.
    """
    mapping = model.mapping
    inputs, outputs = ([names.get(name, name) for name in own] for own in (mapping.inputs, mapping.outputs))
    return model.over(Mapping(inputs=inputs, outputs=outputs))


def _limit(limit: Limit, names: Dict[str, str]) -> Limit:
    low, high = (names.get(one, one) if isinstance(one, str) else one for one in (limit.low, limit.high))
    return replace(limit, low=low, high=high)


@dataclass(kw_only=True, eq=False)
class _Ordering:
    """Channels in order, by exchanges of neighbours: the lower of two is one that the other holds from above.

    Args:
        output: Which they answer.
        like: A whole with it.
        taken: Names that are given.
        models: What has been made.
        limits: What holds it.
    """

    output: str
    like: Cascade
    taken: set[str]
    models: list[NARXModel] = field(default_factory=list)
    limits: dict[str, Limit] = field(default_factory=dict)

    def median(self, channels: Sequence[str]) -> list[str]:
        """The one in the middle, or the two."""
        row = list(channels)
        for last in range(len(row) - 1, 0, -1):
            for k in range(last):
                a, b = row[k : k + 2]
                row[k] = self._held(a, "_lower", Limit(high=b))
                row[k + 1] = self._held(a, "_upper", Limit(low=b))
        half = (len(row) - 1) // 2
        return row[half : len(row) - half]

    def _held(self, channel: str, behind: str, limit: Limit) -> str:
        name = _free(f"{self.output}{behind}", self.taken)
        self.models.append(_sum({channel: 1.0}, name, self.like, self.output))
        self.limits[name] = limit
        return name


def _difference(judged: Sequence[str], name: str, like: Cascade, output: str) -> NARXModel:
    """The first less the mean of the others."""
    first, *others = judged
    return _sum({first: 1.0, **dict.fromkeys(others, -1.0 / len(others))}, name, like, output)


def _sum(gains: Dict[str, float], name: str, like: Cascade, output: str) -> NARXModel:
    """A weighted sum of channels, as a network without neurons: it is run and exported like the others."""
    unit, n = like.units[output], len(gains)
    return NARXModel(
        network=NARX(input_delays=[[0]] * n, output_delays=1, neurons=0),
        theta=np.array([0.0, *gains.values(), 0.0]),
        scaling=Scaling.identity(n),
        mapping=Mapping(inputs=tuple(gains), output=name),
        sample_time=like.sample_time,
        input_units=(unit,) * n,
        output_unit=unit,
        rest_output=0.0,
        clamp=np.inf,  # its bounds are limits of the whole
    )


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

    Returns:
        In the output's unit.

    Raises:
        ConfigError: If no answer is right, or they cannot be a committee.
    """
    apart, errors = _apart(committee(wholes, {output: 1.0}, each=each), traces, output)
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
    """At every sample how far the answer is from the others, and from the measured output."""
    groups = [whole.member(name).mapping.inputs[1:] for name in _judging(whole, output)]
    apart, errors = [], []
    for trace in traces:
        run = whole.simulate_trace(trace)
        answer = run[output]
        apart.append(
            np.max([np.abs(answer - np.mean([run[name] for name in group], axis=0)) for group in groups], axis=0)
        )
        errors.append(np.abs(answer - trace[output]))
    return np.concatenate(apart), np.concatenate(errors)


def _judging(whole: Cascade, output: str) -> list[str]:
    """The channels that say how far apart the answers are: one, or one for each of the others."""
    pattern = re.compile(re.escape(output + APART) + r"(_\d+)?")
    return [name for name in whole.outputs if pattern.fullmatch(name) and whole.limits.get(name, Limit()).doubt]
