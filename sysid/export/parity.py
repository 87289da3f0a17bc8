"""Parity: every exported file is run against the model that it came from, on every case and on random sequences.

How much a free run makes of a difference is the model's own property, and decides what parity can be had at all: a
number rounded otherwise in its last digit comes out larger by :attr:`ParityCase.amplification`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ParityError
from sysid.export.differences import differences
from sysid.export.expected_runs import ParityCase
from sysid.export.exporter import ExportedFile, Runner
from sysid.export.exporters import exporter
from sysid.export.forms.stage import Port

SHARES: Mapping[str, float] = {"float64": 1e-9, "float32": 1e-5}
"""How far a file may be from its model by default, as a share of an output's size, by the type of its numbers."""
LOST = 1e6
"""Amplification from which a difference in the last digit may be as large as what is allowed."""

RESTED, STANDING = 10, 5
"""Runs that a file begins by itself, where it can: from rest at their first inputs; and samples over which a state that
is searched for has to stand."""

FOUND, NEARLY = 1e-5, 1e-9
"""Share of an output's size by which such a run may be off, as step sizes go by differences in the last digit; and of a
state, by which one is all but the same."""

ROUNDINGS = 1e3
"""Roundings of the last digit that add up in a run, of which each is amplified."""

NEAR_0 = 10.0
"""Movements from 0 within which a channel's level makes rounding no coarser than is allowed anyway."""


@dataclass(frozen=True, kw_only=True)
class Parity:
    """How far an exported file is from its model.

    Args:
        largest_difference: Over all samples of all cases, in the output's unit; of several outputs, of the one that is
            nearest to what is allowed.
        case: Where it occurred.
        random_difference: The same over the random sequences; where their outputs are larger than in all cases, as many
            times less.
        random_sequences: Their number.
        tolerance: What is allowed, in the same unit, in cases and sequences.
        share: The same as a share of the output's size; ``None`` where it was given in the output's unit.
        output: The output's name.
        unit: Its unit.
        samples: Number of samples compared.
    """

    largest_difference: float
    case: str
    random_difference: float
    random_sequences: int
    tolerance: float
    share: float | None
    output: str
    unit: str
    samples: int

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "largest_difference": self.largest_difference,
            "case": self.case,
            "random_difference": self.random_difference,
            "random_sequences": self.random_sequences,
            "tolerance": self.tolerance,
            "share": self.share,
            "output": self.output,
            "unit": self.unit,
            "samples": self.samples,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Allowed:
    """How far a file may be from its model.

    Args:
        each: Largest difference of each output, in its unit, shape ``(n_outputs,)``.
        share: The same as a share of each output's size; ``None`` where it was given.
        rounding: What rounding at the channels' levels makes of each output, before it is amplified; nothing of
            channels that move about 0.
    """

    each: NDArray[np.float64]
    share: float | None = None
    rounding: NDArray[np.float64] | float = 0.0

    def over(self, run: ParityCase) -> NDArray[np.float64]:
        """What is allowed in a run: more where its outputs are larger than in all cases, as an unstable model's become.

        And where a channel stands far from 0: what moves by 50 Pa about 100 kPa is rounded 2,000 times as coarsely as
        its movement, and so is every output that it moves, also one that stands at 0 itself.

        Args:
            run: The model's.

        Returns:
            Shape ``(n_outputs,)``.
        """
        if run.itself and run.searched:
            return np.asarray(np.maximum(self.each, FOUND * np.abs(run.output).max(axis=0, initial=0.0)))
        if self.share is None:
            return self.each
        own = np.maximum(self.each, self.share * np.abs(run.output).max(axis=0, initial=0.0))
        return np.asarray(np.maximum(own, self.rounding * min(run.amplification, LOST)))

    @classmethod
    def of(cls, cases: Sequence[ParityCase], dtype: str, given: float | None = None) -> Allowed:
        """What is allowed.

        A number in an output's unit would ask another thing of pascals than of bars. Rounding is in proportion to what
        is rounded: to the level that an output stands at, as well as to how far it moves.

        Args:
            cases: The model's runs over the cases.
            dtype: Of the file's numbers.
            given: Largest difference in the outputs' unit, where one was asked for.

        Returns:
            It; by default :data:`SHARES` of the largest magnitude that each output has over the cases.
        """
        sizes = np.max([np.abs(case.output).max(axis=0, initial=0.0) for case in cases], axis=0)
        if given is not None:
            return cls(each=np.full(sizes.shape, given))
        # One that is 0 throughout has no size of its own.
        usable = np.isfinite(sizes) & (sizes > 0.0)
        return cls(
            each=SHARES[dtype] * np.where(usable, sizes, 1.0),
            share=SHARES[dtype],
            rounding=ROUNDINGS * np.finfo(dtype).eps * _far_from_0(cases),
        )


def _far_from_0(cases: Sequence[ParityCase]) -> NDArray[np.float64]:
    """How far channels stand from 0, beyond some of their movements, as movements of each output."""
    inputs, outputs = (np.concatenate([getattr(case, name) for case in cases]) for name in ("inputs", "output"))
    with np.errstate(over="ignore", invalid="ignore"):  # of a model that grows without bound
        every = np.column_stack([inputs, outputs])
        moves, levels = every.std(axis=0), np.abs(every.mean(axis=0))
    moving = np.isfinite(moves) & np.isfinite(levels) & (moves > 0.0)
    farthest = float((levels[moving] / moves[moving]).max(initial=0.0))
    return np.where(moving, moves, 0.0)[inputs.shape[1] :] * max(0.0, farthest - NEAR_0)


def check_parity(
    file: ExportedFile,
    folder: Path,
    cases: tuple[ParityCase, ...],
    sequences: tuple[ParityCase, ...],
    *,
    allowed: Allowed,
    outputs: Sequence[Port],
) -> Parity:
    """Run an exported file on every case and on the random sequences over which its model stays finite.

    A file that comes to rest by itself runs some of them from its own beginning, too.

    Args:
        file: The file.
        folder: Where it lies.
        cases: From :func:`parity_cases`; at least one.
        sequences: From :func:`random_cases`, all of one length; may be empty.
        allowed: Largest difference of each output.
        outputs: The outputs.

    Returns:
        The largest differences, and where they occurred.

    Raises:
        ParityError: If a difference is larger than the tolerance, or not a number.
    """
    writer = exporter(file.format)
    runner = writer.load(file, folder)
    differences = np.concatenate([_compare(runner, (case,)) for case in cases])
    # Where the model itself grows without bound there is nothing to reproduce: in float32 it does so sooner.
    sequences = tuple(case for case in sequences if np.isfinite(case.output).all())
    drawn = _compare(runner, sequences) if sequences else differences[:0]
    begun = [case for case in (*sequences, *cases) if writer.begins and (writer.searches or not case.searched)]
    rested = _resting(runner, begun, file.dtype, allowed)
    own = _compare(runner, rested, begun=False) if rested else differences[:0]
    for found, runs in ((differences, cases), (drawn, sequences), (own, rested)):
        larger = np.array([allowed.over(run) for run in runs]).reshape(found.shape) / allowed.each
        np.divide(found, larger, out=found)
        ratios = found / allowed.each
        if (ratios > 1.0).any():
            row, column = divmod(int(ratios.argmax()), ratios.shape[1])
            each, port = float((allowed.each * larger[row])[column]), outputs[column]
            found_there = float(found[row, column] * larger[row, column])
            coarse, grown = file.dtype == "float32", runs[row].amplification
            raise ParityError(
                file.name, runs[row].name, found_there, each, port.unit, coarse=coarse,
                grown=grown if not coarse and grown > LOST else 0.0, searched=runs[row].itself and runs[row].searched,
            )  # fmt: skip
    every = np.concatenate([differences, drawn, own])
    near = int((every / allowed.each).max(axis=0).argmax())
    return Parity(
        largest_difference=float(differences[:, near].max()),
        case=cases[int(differences[:, near].argmax())].name,
        random_difference=float(np.concatenate([drawn, own])[:, near].max(initial=0.0)),
        random_sequences=len(sequences),
        tolerance=float(allowed.each[near]),
        share=allowed.share,
        output=outputs[near].name,
        unit=outputs[near].unit,
        samples=sum(len(case.output) for case in (*cases, *sequences)),
    )


def _compare(runner: Runner, cases: tuple[ParityCase, ...], *, begun: bool = True) -> NDArray[np.float64]:
    """The largest difference of each case and output, all run side by side as cars; shape ``(n_cases, n_outputs)``.

    They begin at the states of the cases, or as the file does by itself.
    """
    states = np.stack([case.state for case in cases]) if begun else None
    run = runner(np.stack([case.inputs for case in cases], axis=1), states)
    found = [differences(run.output[:, i], case.output).max(axis=0, initial=0.0) for i, case in enumerate(cases)]
    return np.array(found).reshape(len(cases), -1)


def _resting(runner: Runner, cases: Sequence[ParityCase], dtype: str, allowed: Allowed) -> tuple[ParityCase, ...]:
    """Cases that a file may begin by itself, told by their names.

    A state at rest that is searched for is found as finely as a program searches. Where nothing stands still, where the
    run is another from a state that is all but the same, and in float32, there is nothing to find again.
    """
    own = tuple(
        replace(case, name=f"{case.name}, begun by the file itself", itself=True)
        for case in cases
        if case.rests and np.isfinite(case.output).all()
    )
    if any(case.searched for case in own):
        own = own[: RESTED * RESTED] if dtype == "float64" else ()
        own = tuple(case for case in own if _found_again(runner, case, allowed.over(case)))
    return own[:RESTED]


def _found_again(runner: Runner, case: ParityCase, allowed: NDArray[np.float64]) -> bool:
    """Whether a state stands still, and a run from close by is the same."""
    nudge = NEARLY * (1.0 + np.abs(case.state))
    still = case.inputs[:1].repeat(STANDING, axis=0)
    stands = runner(still[:, np.newaxis], case.state[np.newaxis]).output[:, 0]
    near = [replace(case, state=case.state + sign * nudge) for sign in (1.0, -1.0)]
    moved = np.concatenate([_compare(runner, (one,)) for one in near])
    return bool((np.abs(stands - stands[0]).max(axis=0) <= allowed).all() and (moved <= allowed).all())
