"""A surrogate from Python: :func:`sysid.surrogate`."""

from __future__ import annotations

from pathlib import Path

from sysid.workbench.runner.program import carry_out
from sysid.workbench.surrogates.make import Made, make_surrogate

COMMAND = "sysid.surrogate(...)"


def surrogate(
    pipeline: str | Path,
    folder: str | Path,
    *,
    minutes: float = 60.0,
    proof: int | None = None,
    iterations: int | None = None,
    rounds: int | None = None,
    workers: int | None = None,
    seed: int = 0,
) -> Made:
    """Make a surrogate of a slow model: experiments, a model, its export as a drop-in FMU, and the proof.

    Args:
        pipeline: YAML of kind ``experiment``. **What it names is run, with your rights.**
        folder: Where everything is kept; a run that was killed goes on there.
        minutes: Time for all.
        proof: New random experiments that teach nothing; 1,000, or as many as there is time for.
        iterations: In place of the search's time: the same result on every machine.
        rounds: Rounds of experiments that are added where the surrogate is worst, in place of those of the pipeline.
        workers: Processes, in place of those of the pipeline.
        seed: Of the search.

    Returns:
        The surrogate: its bundle, FMU, report and proof.

    Raises:
        UserError: If the pipeline or its reference cannot be used.
    """
    return make_surrogate(
        Path(pipeline), Path(folder), minutes=minutes, proof=proof, iterations=iterations, rounds=rounds,
        workers=workers, seed=seed,
        perform=lambda program, place: carry_out(program, place, command=COMMAND),
    )  # fmt: skip
