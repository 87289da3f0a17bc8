"""A free run that goes on from measured samples, of one model or of several wired together.

Each model begins by its own outputs, as :mod:`sysid.models.contract.beginning` has it for every model: what it reads of
the others is what they compute. Models that read each other, or outputs held at limits that were declared for the
whole, have no such beginning; they begin at rest, and it is said why.
"""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.export.surrogate import Surrogate
from sysid.ingest.memory.run_records import before_a_run, levels_of
from sysid.models import AbstractModel, Cascade, History, Start, StartKind, beginning

Initial = float | Dict[str, float] | tuple[Any, Any] | None
"""What stands before a run: nothing, the output, outputs by name, or the pair ``(u, y)`` of the samples before."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredRun:
    """A free run that goes on from measured samples.

    Args:
        computed: Everything that is computed, shape ``(n_samples, n_computed)``, in units; in the samples that it began
            by, what the model follows in them or was told.
        first: By output that began by its measurement: the sample that is run first; those before are not scored.
    """

    computed: NDArray[np.float64]
    first: Dict[str, int]


def obstacle(source: AbstractModel | Cascade) -> str:
    """Why a run cannot begin by measured outputs.

    Args:
        source: What is run.

    Returns:
        The reason as a clause; empty where nothing is in the way.
    """
    if any(source.limits.get(name) != limit for model in source.models for name, limit in model.limits.items()) or (
        set(source.limits) - {name for model in source.models for name in model.limits}
    ):
        return "its outputs are held at limits that were declared for the whole"
    if isinstance(source, Cascade) and any(source.wiring.feeds_back(model.ends) for model in source.models):
        return "its models read each other"
    return ""


def able(source: AbstractModel | Cascade, measured: Collection[str]) -> tuple[str, ...]:
    """The outputs that can begin by what was measured: those of models of which every output was.

    Args:
        source: What is run.
        measured: Names of the outputs that were measured.

    Returns:
        Names; none where there is an :func:`obstacle`.
    """
    if obstacle(source):
        return ()
    whole = [model for model in source.models if set(model.outputs) <= set(measured)]
    return tuple(name for model in whole for name in model.outputs)


def check_able(source: AbstractModel | Cascade, measured: Collection[str], start: Start, *, where: str) -> None:
    """Refuse a start that is asked for and cannot be.

    Args:
        source: What is run.
        measured: Names of the outputs that were measured.
        start: What is asked for; not ``rest``.
        where: The record, for the error.

    Raises:
        ConfigError: If something is in the way, or no model has all of its outputs measured.
    """
    why, names = obstacle(source), source.outputs
    if why:
        raise ConfigError(
            "these models begin at their declared levels", where="start", expected=f"rest, because {why}",
            got=start.kind.value, remedy="leave start out, or give rest",
        )  # fmt: skip
    if not able(source, measured):
        missing = [name for name in names if name not in measured]
        needed = f"a column {missing[0]}" if len(missing) == 1 else f"columns {', '.join(missing)}"
        raise ConfigError(
            f"a run that begins {start.kind.value} needs the measured output", where=where,
            expected=f"{needed} with the samples that were measured", got=", ".join(measured) or "no output",
            remedy="put the measured output beside the inputs, or leave start out: the run then begins at rest",
        )  # fmt: skip


def check_one_start(initial: Initial, start: Start | None) -> None:
    """Refuse a run that would begin by what stands before it and by its first samples.

    Args:
        initial: What stands before it.
        start: How it begins.

    Raises:
        ConfigError: If both say something.
    """
    if initial is not None and start is not None and start.kind is not StartKind.REST:
        raise ConfigError(
            "the run cannot begin in two ways", where="initial", expected="initial, or a start from measured samples",
            got=f"initial and start {start.kind.value}", remedy="leave one of them out",
        )  # fmt: skip


def run_measured(
    surrogate: Surrogate,
    inputs: NDArray[np.float64],
    measured: Dict[str, NDArray[np.float64]],
    start: Start,
    usable: NDArray[np.bool_] | None = None,
) -> MeasuredRun:
    """A free run whose models begin by their measured outputs, where all of these were measured; the others at rest.

    Args:
        surrogate: What is run; nothing is in its way.
        inputs: Shape ``(n_samples, n_inputs)``, in their units.
        measured: Outputs that were measured, in their units, by name, shape ``(n_samples,)`` each.
        start: How it begins; not ``rest``.
        usable: Which samples of them are not masked, shape ``(n_samples,)``; all by default.

    Returns:
        The run.

    Raises:
        TraceError: If the record is not longer than a measured start.
    """
    levels = dict(zip((port.name for port in surrogate.channels), surrogate.levels(inputs[0]), strict=True))
    known: dict[str, NDArray[np.float64]] = {
        port.name: column for port, column in zip(surrogate.inputs, inputs.T, strict=True)
    }
    # Members of a committee are the same quantity as what follows from them, and begin as it was measured.
    measured = {**measured, **{name: measured[led] for name, led in surrogate.following(measured).items()}}
    first: dict[str, int] = {}
    for model in surrogate.source.models:
        names, u = model.outputs, matrix_of(known, model.inputs, len(inputs))
        if set(names) <= set(measured):
            run, begun = _begun(model, u, matrix_of(measured, names, len(inputs)), start, usable)
            first |= dict.fromkeys(names, begun)
        else:
            rest = np.array([levels[name] for name in names])
            held = np.array([levels[name] for name in model.inputs])
            output = rest if model.structure.several_outputs else float(rest[0])
            run = model.simulate(u, History.at_rest(inputs=held, output=output)).reshape(len(inputs), -1)
        known |= dict(zip(names, run.T, strict=True))
    computed = matrix_of(known, [port.name for port in surrogate.computed], len(inputs))
    return MeasuredRun(computed=computed, first=first)


def run_with(surrogate: Surrogate, inputs: NDArray[np.float64], initial: Initial) -> NDArray[np.float64]:
    """A free run from what somebody says that stands before it.

    Args:
        surrogate: What is run.
        inputs: Shape ``(n_samples, n_inputs)``, in their units.
        initial: Nothing, for the declared levels; a number, which every output has stood at, or numbers by name; or the
            pair ``(u, y)`` of the samples before, oldest first, from which the run goes on.

    Returns:
        Everything that is computed, shape ``(n_samples, n_computed)``, in units.

    Raises:
        ChannelError: If it names no output, or a pair lacks a channel.
        ConfigError: If it is no finite number, says nothing to the models, or a pair cannot be gone on from.
        TraceError: If a sample of a pair is missing.
    """
    names = tuple(port.name for port in surrogate.outputs)
    if isinstance(initial, tuple):
        return _after(surrogate, inputs, initial, names)
    return surrogate.run_from(inputs, levels_of(initial, names))


def _after(
    surrogate: Surrogate, inputs: NDArray[np.float64], pair: tuple[Any, Any], names: tuple[str, ...]
) -> NDArray[np.float64]:
    """The run behind measured samples: over both, and of it what comes after them."""
    units = {port.name: port.unit for port in surrogate.channels}
    before, output = before_a_run(pair, surrogate.source.inputs, names, units, sample_time=surrogate.sample_time)
    start = Start(kind=StartKind.MEASURED, n_measured=len(output))
    check_able(surrogate.source, names, start, where="initial")
    before = np.zeros((len(output), 1)) if surrogate.ticks else before
    padded = np.concatenate([output, np.zeros((len(inputs), len(names)))])  # which is not read
    measured = dict(zip(names, padded.T, strict=True))
    return run_measured(surrogate, np.concatenate([before, inputs]), measured, start).computed[len(output) :]


def _begun(
    model: AbstractModel,
    inputs: NDArray[np.float64],
    output: NDArray[np.float64],
    start: Start,
    usable: NDArray[np.bool_] | None,
) -> tuple[NDArray[np.float64], int]:
    """A model's run behind what it follows or was told in its first samples, and how many these are."""
    begun = beginning(model, inputs, output if model.structure.several_outputs else output[:, 0], start, usable)
    run = model.simulate(inputs[begun.first :], begun.history)
    if begun.first:
        estimated = start.kind is StartKind.ESTIMATED
        before = model.recursion.followed(begun.history) if estimated else begun.history.output
        run = np.concatenate([before[-begun.first :], run])
    return run.reshape(len(inputs), -1), begun.first


def matrix_of(columns: Dict[str, NDArray[np.float64]], names: Collection[str], length: int) -> NDArray[np.float64]:
    """Columns by name side by side, shape ``(length, n_names)``."""
    return np.column_stack([columns[name] for name in names]) if names else np.zeros((length, 0))
