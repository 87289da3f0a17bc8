"""Outputs whose converter is so coarse that its steps, and no noise, are what a fit is wrong by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.models import AbstractModel
from sysid.traces.converter import converter_step
from sysid.units import in_unit

MATTERS, POOR = 0.02, 0.1
"""Part of the output's standard deviation that the error of the free run has where it is worth a word, and where the
fit is worse than it need be."""
MOST, SOME = 0.5, 0.08
"""Part of the squared error that the steps alone leave: where nothing else is left to explain; and one step ahead,
where they bend what is fitted one step ahead."""
BENT = 3.0
"""How many times larger the error of the free run is then."""


def resolution_told(model: AbstractModel, runs: Sequence[FreeRun]) -> dict[int, str]:
    """Which outputs are told in steps that are about as large as what the fit is wrong by.

    Rounding to a step leaves an error of a twelfth of its square (Widrow and Kollar 2008, chapter 5).

    Args:
        model: The fitted model.
        runs: Its free runs over the records that were fitted.

    Returns:
        A sentence for each such output, by its place.
    """
    told = dict[int, str]()
    for i, name in enumerate(model.mapping.outputs):
        output, simulated = (
            np.concatenate([signal[run.usable, i] for run, signal in pairs] or [np.empty(0)])
            for pairs in ([(run, run.output) for run in runs], [(run, run.simulated) for run in runs])
        )
        step, spread = converter_step(output), float(output.std()) if len(output) else 0.0
        if step is None or not spread > 0.0:
            continue
        error, of_step = _size(output - simulated), step / np.sqrt(12.0)
        steps = f"{name} comes in steps of {in_unit(f'{step:.3g}', model.ends.output_units[i])}"
        if not error > MATTERS * spread:
            continue
        if (share := (of_step / error) ** 2) > MOST:
            told[i] = (
                f"{steps}, and these are {100 * min(share, 1.0):.0f} % of the squared error that the free run leaves: "
                "no model comes nearer to this record. Record with a finer converter, or a smaller range of it."
            )
        elif error > POOR * spread:
            ahead = _size(np.concatenate([_ahead(model, run, i) for run in runs]))
            if (of_step / max(ahead, 1e-300)) ** 2 > SOME and error > BENT * ahead:
                told[i] = (
                    f"{steps}, and one step ahead the model is wrong by {ahead:.3g}: it was fitted to the steps of the "
                    "converter, and its free run bends. Fit the free run (OE, TransferFunction, a network with loop: "
                    "closed), take every nth sample (grid), or record with a finer converter."
                )
    return told


def _size(error: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        found = float(np.sqrt(np.mean(error**2))) if len(error) else np.inf
    return found if np.isfinite(found) else np.inf


def _ahead(model: AbstractModel, run: FreeRun, i: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """The error one step ahead of measured output, or of the free run where a model predicts nothing."""
    if not model.recursion.predicts:
        return np.asarray((run.output - run.simulated)[run.usable, i], dtype=np.float64)
    measured = run.output if model.structure.several_outputs else run.output[:, 0]
    found = model.predict(run.inputs, measured, run.history).reshape(run.output.shape)
    return np.asarray((run.output - found)[run.usable, i], dtype=np.float64)
