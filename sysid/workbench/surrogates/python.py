"""A surrogate from Python: :func:`sysid.surrogate`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from sysid.workbench.runner.program import carry_out
from sysid.workbench.surrogates.asked import surrogate_of, wish_of
from sysid.workbench.surrogates.make import Made

COMMAND = "sysid.surrogate(...)"


def surrogate(
    source: str | Path,
    folder: str | Path | None = None,
    *,
    ranges: Mapping[str, Sequence[float]] | None = None,
    parameters: Mapping[str, Sequence[float]] | None = None,
    outputs: Iterable[str] = (),
    sample_time: float | None = None,
    duration: float | None = None,
    minutes: float = 60.0,
    proof: int | None = None,
    iterations: int | None = None,
    rounds: int | None = None,
    workers: int | None = None,
    seed: int = 0,
) -> Made:
    """Make a surrogate of a slow model: experiments, a model, its export as a drop-in FMU, and the proof.

    ``sysid surrogate`` takes the same, with the same errors, which name its options: ``--range`` is ``ranges``,
    ``--parameter`` is ``parameters``, ``--output`` is ``outputs``.

    Args:
        source: An FMU; ``package.module:function`` or ``file.py:function``; a command line with ``{inputs}`` and
            ``{outputs}`` in it; a YAML that has one of these under ``reference``; or a pipeline of kind
            ``experiment``, by its file or its name. **It is code, and is run with your rights.**
        folder: Where everything is kept; a run that was killed goes on there. ``runs/surrogate-<name>`` by default.
        ranges: Least and greatest value of each input, by name, as ``valve`` or ``valve [V]``.
        parameters: The same of parameters that vary: inputs of the surrogate.
        outputs: Their names, with or without a unit; all of an FMU by default.
        sample_time: Seconds; as an FMU says by default.
        duration: Seconds of an experiment; as an FMU says by default.
        minutes: Time for all.
        proof: New random experiments that teach nothing, beside the minutes; 1,000, or as many as these have time for.
        iterations: In place of the search's time: the same result on every machine.
        rounds: Rounds of experiments that are added where the surrogate is worst, in place of those of the pipeline.
        workers: Processes; as the pipeline says, and two of a reference, by default.
        seed: Of everything random.

    Returns:
        The surrogate: its bundle, FMU, report and proof.

    Raises:
        UserError: If the reference or the pipeline cannot be used, or does not say enough.
    """
    wish = wish_of(
        (ranges or {}).items(), (parameters or {}).items(), outputs, sample_time=sample_time, duration=duration
    )
    return surrogate_of(
        source, wish, None if folder is None else Path(folder), minutes=minutes, proof=proof, iterations=iterations,
        rounds=rounds, workers=workers, seed=seed,
        perform=lambda program, place: carry_out(program, place, command=COMMAND),
    )  # fmt: skip
