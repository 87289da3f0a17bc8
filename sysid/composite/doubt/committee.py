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

With ``mean`` it is the mean of all that answers. Its squared error is the members' mean squared error less the variance
between them (Krogh and Vedelsby 1995): where they err apart it is better than they are. It is in doubt where the
largest answer less the smallest, its spread, is :math:`d` or more. A mean keeps fixed limits, and limits that are
averaged channels, as each of its members does, and tells where a limit holds any of them (``AT_LIMIT``).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace

import numpy as np

from sysid.errors import ChannelError, ConfigError
from sysid.models import NARX, AbstractModel, Cascade, Limit, Mapping, NARXModel, Scaling
from sysid.models.cascades.cascade_run import Level
from sysid.models.cascades.wiring import Member
from sysid.models.interpolation import SPREAD
from sysid.models.lagged.cascade_program import NOBODY

APART = "_apart"
"""Behind the name of an output: the channel of its difference."""


def committee(
    wholes: Sequence[Cascade | AbstractModel],
    thresholds: Dict[str, float] | None = None,
    *,
    each: bool = False,
    mean: Collection[str] = (),
    rest: Dict[str, Level] | None = None,
) -> Cascade:
    """Surrogates of the same outputs as one: the first of them answers, or the mean of all.

    An output of the same name that the wholes declare at the same level is one quantity: where somebody says that it
    begins elsewhere, it does so in all of them.

    Args:
        wholes: Two or more with the same inputs, units and sample time: assemblies, or plain models.
        thresholds: By output, in its unit: the difference from the median of the others, or the spread of all, from
            which it is in doubt. Only a mean needs none.
        each: Whether it is the difference from any one of the others.
        mean: Outputs of which the mean of all answers; none, and the first does.
        rest: Levels at rest of outputs that are judged or averaged, where the wholes declare them otherwise.

    Returns:
        The channels of the first under their names; of the others with their number behind them (``BC_2``); and of
        each judged output the difference (``BC_apart``), or those from each of the others (``BC_apart_2``), and of
        three others and more what puts them in order (``BC_lower``, ``BC_upper``). Of a mean the averaged outputs have
        their names, all channels of the wholes have numbers (``BC_1``, ``BC_2``), and each averaged output has its
        spread, the largest less the smallest (``BC_spread``).

    Raises:
        ConfigError: If there are fewer than two, they have not the same inputs, units and sample time, one of them does
            not compute a judged or averaged output or has it at another level at rest, or a threshold is not positive.

    Example:
        >>> from sysid.models import ARX, ARXModel
        >>> def lag(rate: float) -> ARXModel:
        ...     return ARXModel(orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([rate, 1.0 - rate]),
        ...         intercept=0.0, mapping=Mapping.parse("u -> y"), sample_time=1.0, input_units=("V",),
        ...         output_unit="V", rest_output=0.0)
        >>> both = committee([lag(0.5), lag(0.9)], mean=["y"])
        >>> run = both.simulate(np.ones((2, 1)))
        >>> run["y"].round(3).tolist(), run["y_spread"].round(3).tolist()
        ([0.7, 0.87], [0.4, 0.24])
    """
    cascades, thresholds = [_cascade(one) for one in wholes], thresholds or {}
    answered = tuple(mean) or tuple(thresholds)
    _check(cascades, thresholds, answered, each=each, averaged=bool(mean))
    levels = _levels(cascades, answered, rest or {})
    taken = {*cascades[0].inputs, *(mean or cascades[0].outputs)}
    names = [] if mean else [{name: name for name in cascades[0].outputs}]
    for number, one in enumerate(cascades[len(names) :], len(names) + 1):
        names.append({name: _free(f"{name}_{number}", taken) for name in one.outputs})
    made = _Made(
        like=cascades[0], taken=taken, models=_renamed_models(cascades, names), limits=_limits(cascades, names, mean)
    )
    for output in answered:
        own = [given[output] for given in names]
        groups = made.spread(output, own) if mean else made.others(output, own, each=each)
        if output in thresholds:
            made.doubt(output, groups, thresholds[output])
    declared = _rests(cascades, names, levels, own_names=not mean)
    return Cascade(models=tuple(made.models), rest=declared, limits=made.limits)


def _cascade(one: Cascade | AbstractModel) -> Cascade:
    return one if isinstance(one, Cascade) else Cascade(models=(one,))


def _check(
    cascades: Sequence[Cascade], thresholds: Dict[str, float], answered: Sequence[str], *, each: bool, averaged: bool
) -> None:
    if len(cascades) < 2 or not answered or not all(0.0 < value < np.inf for value in thresholds.values()):
        raise ConfigError(
            "not a committee",
            where="committee",
            expected="two surrogates or more, and a positive threshold for one output or more, or outputs to average",
            got=f"{len(cascades)} with {dict(thresholds)}",
            remedy="give surrogates that were trained apart; doubt_threshold finds a threshold",
        )
    if averaged and (each or set(thresholds) - set(answered) or len(set(answered)) < len(answered)):
        raise ConfigError(
            "a mean is doubted by the spread of what it is the mean of",
            where="committee",
            expected="thresholds of outputs that are averaged, each named once, and not each",
            got=f"mean {', '.join(answered)}; thresholds {', '.join(thresholds) or 'none'}; each {each}",
            remedy="name the judged outputs in mean too, and leave each out",
        )
    for number, one in enumerate(cascades[1:], 2):
        check_alike(cascades[0], one, answered, where=f"committee, number {number}")


def check_alike(first: Cascade, other: Cascade, answered: Sequence[str], *, where: str) -> None:
    """Refuse a whole that cannot stand beside another.

    Args:
        first: The whole.
        other: What is to stand beside it.
        answered: Outputs that are judged or averaged.
        where: Of whom an error speaks.

    Raises:
        ConfigError: If they have not the same inputs, outputs, units and sample time.
    """
    asked = (*first.inputs, *answered)
    lacking = [name for one in (first, other) for name in answered if name not in one.outputs]
    if set(other.inputs) != set(first.inputs) or lacking:
        raise ConfigError(
            "the surrogates do not answer the same question",
            where=where,
            expected=f"{', '.join(first.inputs)} in, {', '.join(answered)} among what is computed",
            got=f"{', '.join(other.inputs)} in, {', '.join(other.outputs)} computed",
            remedy="give surrogates with the same inputs, and judge or average outputs that all of them compute",
        )
    expected, got = (
        [f"one sample every {one.sample_time:g} s", *(f"{name} in {one.units[name]}" for name in asked)]
        for one in (first, other)
    )
    if unlike := [(one, two) for one, two in zip(expected, got, strict=True) if one != two]:
        raise ConfigError(
            "the surrogates answer at other times or in other units",
            where=where,
            expected=", ".join(one for one, _ in unlike),
            got=", ".join(two for _, two in unlike),
            remedy="train the other one on a data set that declares the same sample_time, for which grid resamples its "
            "files, and the same units of its channels",
        )


def _levels(cascades: Sequence[Cascade], answered: Sequence[str], given: Dict[str, Level]) -> dict[str, Level]:
    """Where each answered output is at rest: one system, one level."""
    found: dict[str, Level] = {}
    for output in answered:
        said = dict.fromkeys(one.level(output) for one in cascades)
        if output not in given and len(said) > 1:
            raise ConfigError(
                f"the surrogates have {output} at rest at different levels",
                where="committee, rest",
                expected="one level, as they are of one system",
                got=", ".join(str(level) for level in said),
                remedy=f"say which it is: rest={{'{output}': ...}}",
            )
        found[output] = given.get(output, next(iter(said)))
    if strangers := sorted(set(given) - set(answered)):
        raise ChannelError(strangers, answered, where="rest of the committee")
    return found


def _rests(
    cascades: Sequence[Cascade], names: Sequence[Dict[str, str]], levels: Dict[str, Level], *, own_names: bool
) -> dict[str, Level]:
    """Levels at rest: what is one quantity in several wholes has one, wherever that is said to be."""
    rest: dict[str, Level] = {}
    for one, own in zip(cascades, names, strict=True):
        for name, level in one.rest.items():
            rest[own.get(name, name)] = own.get(level, level) if isinstance(level, str) else level
    rest |= levels
    first = cascades[0]
    for one, own in zip(cascades, names, strict=True):
        for name in one.outputs:
            alike = own_names and name in first.outputs and _like(first, name) == _like(one, name)
            if own[name] != name and (name in levels or alike):
                rest[own[name]] = name
    return rest


def _like(whole: Cascade, output: str) -> tuple[str, Level]:
    return whole.units[output], whole.level(output)


def _renamed_models(cascades: Sequence[Cascade], names: Sequence[Dict[str, str]]) -> list[Member]:
    return [renamed(model, own) for one, own in zip(cascades, names, strict=True) for model in one.models]


def _limits(cascades: Sequence[Cascade], names: Sequence[Dict[str, str]], mean: Collection[str]) -> dict[str, Limit]:
    """The limits of all; what holds a part of a mean holds the mean, and is told of it."""
    found = {}
    for whole, own in zip(cascades, names, strict=True):
        for name, limit in whole.limits.items():
            of = next((one for one in (name, limit.tells) if one in mean), None)
            low, high = (own.get(one, one) if isinstance(one, str) else one for one in (limit.low, limit.high))
            tells = of if of is not None or limit.tells is None else own.get(limit.tells, limit.tells)
            found[own[name]] = replace(limit, low=low, high=high, tells=tells)
    return found


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


@dataclass(kw_only=True, eq=False)
class _Made:
    """A committee on its way: its members, and what judges or averages their answers.

    Args:
        like: A whole with the outputs.
        taken: Names that are given.
        models: What has been made.
        limits: What holds it.
    """

    like: Cascade
    taken: set[str]
    models: list[Member]
    limits: dict[str, Limit]

    def others(self, output: str, answers: Sequence[str], *, each: bool) -> dict[str, dict[str, float]]:
        """How far the first is from the others, or from each: by what stands behind the name, gains of channels."""
        first, *rest = answers
        if each:
            return {f"_{k}": {first: 1.0, other: -1.0} for k, other in enumerate(rest, 2)}
        if len(rest) > 2:  # the mean of two is their median
            rest = self._median(output, rest)
        return {"": {first: 1.0, **dict.fromkeys(rest, -1.0 / len(rest))}}

    def spread(self, output: str, answers: Sequence[str]) -> dict[str, dict[str, float]]:
        """The mean of all, and how far they are apart: the largest less the smallest."""
        self._sum(dict.fromkeys(answers, 1.0 / len(answers)), output, output)
        low = high = answers[0]
        for other in answers[1:]:
            low = self._held(output, low, "_lower", Limit(high=other))
            high = self._held(output, high, "_upper", Limit(low=other))
        name = _free(f"{output}{SPREAD}", self.taken)
        self._sum({high: 1.0, low: -1.0}, name, output)
        return {"": {name: 1.0}}

    def doubt(self, output: str, apart: Dict[str, Dict[str, float]], threshold: float) -> None:
        """Channels that are held where the answer is in doubt."""
        for behind, gains in apart.items():
            name = _free(f"{output}{APART}{behind}", self.taken)
            self._sum(gains, name, output)
            self.limits[name] = Limit(low=-float(threshold), high=float(threshold), doubt=True)

    def _median(self, output: str, channels: Sequence[str]) -> list[str]:
        """The one in the middle, or the two, by exchanges of neighbours: the lower of two is held by the other."""
        row = list(channels)
        for last in range(len(row) - 1, 0, -1):
            for k in range(last):
                a, b = row[k : k + 2]
                row[k] = self._held(output, a, "_lower", Limit(high=b))
                row[k + 1] = self._held(output, a, "_upper", Limit(low=b))
        half = (len(row) - 1) // 2
        return row[half : len(row) - half]

    def _held(self, output: str, channel: str, behind: str, limit: Limit) -> str:
        name = _free(f"{output}{behind}", self.taken)
        self._sum({channel: 1.0}, name, output)
        self.limits[name] = replace(limit, tells=NOBODY)
        return name

    def _sum(self, gains: Dict[str, float], name: str, output: str) -> None:
        self.models.append(_sum(gains, name, self.like, output))


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
