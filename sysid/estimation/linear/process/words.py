"""What the fit of a process model has to say."""

from __future__ import annotations

import numpy as np

from sysid.estimation.linear.process.search import End
from sysid.estimation.linear.process.uncertainty import at_bounds, merged
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import FittedProcess
from sysid.models.process.process_type import DAMPING, DEAD_TIME, GAIN, ZERO
from sysid.models.process.structure import shown
from sysid.units import in_unit


def of_parameters(model: FittedProcess, known: Uncertainty) -> str:
    """Every parameter with half of its 95 % interval and its unit; of those that were given, that they were.

    Args:
        model: The model.
        known: What is known of its parameters.

    Returns:
        One sentence.
    """
    half = dict(zip(known.names, known.interval(0.95)[:, 1] - known.values, strict=True))
    inputs, told = model.mapping.inputs, []
    for j, (kind, own) in enumerate(zip(model.process.types, model.values, strict=True)):
        for name, value in zip(kind.names, own, strict=True):
            label = shown(name, inputs[j], inputs)
            wide = half.get(label, np.nan)
            sure = " (given)" if label not in half else "" if np.isnan(wide) else f" ± {wide:.2g}"
            told.append(in_unit(f"{label} = {value:.5g}{sure}", model.units[label]))
    return f"{', '.join(told)}."


def of_bounds(model: FittedProcess, end: End) -> tuple[str, ...]:
    """Parameters that stand at a bound.

    Args:
        model: The model.
        end: Where the search ended.

    Returns:
        A sentence for each.
    """
    problem, inputs, told = end.problem, model.mapping.inputs, []
    for i, side in zip(problem.free, at_bounds(end), strict=True):
        if not side:
            continue
        j, name = problem.names[i]
        label, of = shown(name, inputs[j], inputs), inputs[j]
        known = model.process.known(name, of)
        declared = known is not None and np.isfinite(known.low if side == "low" else known.high)
        value = in_unit(f"{model.parameters[label]:.5g}", model.units[label])
        if declared:
            told.append(f"{label} stands at its bound, {value}: it has no interval. Widen the bound, or fix it there.")
        elif name == DEAD_TIME and side == "low":
            told.append(f"{label} is 0: these records show no dead time of {of}. Leave D out of the type.")
        elif name == DEAD_TIME:
            told.append(f"{label} is {value}, a third of the longest record, the longest that is tried: record longer.")
        elif name == DAMPING:
            told.append(
                f"{label} is {value}: these records show nothing that swings. Leave U out of the type."
                if side == "high"
                else f"{label} is {value}: what swings there hardly dies away. Record longer."
            )
        elif side == "low":
            told.append(
                f"{label} is {value}, too fast for these samples to show. Take a type with a pole less, or sample "
                "faster."
            )
        else:
            told.append(
                f"{label} is {value}, far longer than the records: the plant may integrate (I in the type), and these "
                "records cannot tell. Bound it, or record longer."
            )
    return tuple(told)


def of_open(model: FittedProcess, known: Uncertainty, end: End) -> tuple[str, ...]:
    """Parameters that the records hardly tell.

    Args:
        model: The model.
        known: What is known of its parameters.
        end: Where the search ended.

    Returns:
        A sentence for each gain or time constant that may as well be nothing, one for time constants that are equal,
        and one for all that are not told apart.
    """
    problem, inputs, told = end.problem, model.mapping.inputs, []
    labels = {int(i): shown(problem.names[i][1], inputs[problem.names[i][0]], inputs) for i in problem.free}
    equal = [labels[i] for i in merged(end)]
    if equal:
        told.append(
            f"{' and '.join(equal)} came out equal, and have no intervals: two real poles are no better than a pair. "
            "Try U in the type, or a pole less."
        )
    ends = dict(zip(known.names, known.interval(0.95), strict=True))
    sides = dict(zip(labels.values(), at_bounds(end), strict=True))
    lost = [one for one in labels.values() if np.isnan(ends[one][0]) and not sides[one] and one not in equal]
    if lost:
        told.append(
            f"These records do not tell {', '.join(lost)}: others make up for each. Give one (fixed: true), or take a "
            "letter out of the type; of records that begin at rest start: rest tells more."
        )
    for i, label in labels.items():
        name, (low, high) = problem.names[i][1], ends[label]
        if name.startswith("T") and name not in {DEAD_TIME, ZERO} and low <= 0.0:
            told.append(
                f"{label} may as well be 0 by these records, and others may make up for it: take a type with a pole "
                f"less, or give {label}."
            )
        elif name == GAIN and low <= 0.0 <= high:
            told.append(
                f"{label} may as well be 0 by these records. Where they begin at rest, start: rest tells more; else "
                "record more of what its input does."
            )
    return tuple(told)


def of_errors(end: End) -> tuple[str, ...]:
    """From how many samples, and which ones were left out."""
    lost = max((one.first for one in end.problem.records), default=0)
    if not lost:
        return ()
    return (f"The first {lost} samples do not count where an input of theirs came before the record.",)
