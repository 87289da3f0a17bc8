"""What EST01 tells networks of the handle alone: those that fit it equally well, where they agree, where all are wrong.

Run with ``python -m tests.benchmarks identifiability``; some five minutes on two cores. STP -> BP is fitted on EST01
alone from 24 random starts, each to the end, with the structure of ``pipelines/mapping-stp-bp.yaml``. Of the eight
networks with the least error on EST01 the table says, by case and in 1e-3 psi^2: their mean error; how far they
disagree (the variance between their outputs); and the error of their mean, which all share. Where they disagree,
the record did not determine them. Where they agree and are wrong together, it says something else than the truth.

VAL03 moves the handle as EST01 does from 1,330 s on, for 60 s to 74 psi; but there the train has charged for 280 s, and
here it has stood charged from the start. The last line is the mean squared difference between the two answers of the
reference itself: what a model makes that knows the movement and not the charge.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.estimation import fit_narx
from sysid.ingest import load_dataset
from sysid.models import NARX, AbstractModel
from sysid.traces import Trace
from tests.benchmarks._findings import found
from tests.workbench.pipelines import parse_pipeline

PIPELINE = Path("pipelines/mapping-stp-bp.yaml")
STARTS, KEPT, WORKERS = 24, 8, 2
SAME_MOVEMENT_S = 1330.0
"""Where EST01 begins what VAL03 begins at 0: 20 s at 90 psi, 60 s at 74 psi, 90 psi."""


def networks(estimation: Trace) -> list[AbstractModel]:
    """The networks with the least error on EST01, best first."""
    config = parse_pipeline(PIPELINE.read_text(encoding="utf-8"), where=PIPELINE)
    ((entry, network),) = ((fit, fit.structure) for fit in config.fits if isinstance(fit.structure, NARX))

    def one(seed: int) -> tuple[float, AbstractModel]:
        training = replace(entry.training_options(seed), starts=1, ensemble=1)
        model = fit_narx([estimation], config.mapping, network, training, rest_output=config.rest_output).model
        return mse(model.simulate(estimation.columns(config.mapping.inputs)), estimation["BP"]), model

    with ThreadPoolExecutor(WORKERS) as pool:
        fitted = sorted(pool.map(one, range(STARTS)), key=lambda pair: pair[0])
    return [model for _, model in fitted[:KEPT]]


def mse(ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> float:
    """Mean squared difference."""
    return float(np.mean((ours - theirs) ** 2))


def main() -> None:
    """The table, and the two answers of the reference."""
    cases = {trace.name: trace for trace in load_dataset("abdx-service")}
    models = networks(cases["EST01"])
    print("| case | mean error | disagreement | error of the mean |\n|---|---|---|---|")
    for name, trace in cases.items():
        outputs = np.array([model.simulate(trace.columns(["STP"])) for model in models])
        errors = [mse(output, trace["BP"]) for output in outputs]
        apart, shared = float(outputs.var(axis=0, ddof=1).mean()), mse(outputs.mean(axis=0), trace["BP"])
        print(f"| {name} | {1e3 * np.mean(errors):.3g} | {1e3 * apart:.3g} | {1e3 * shared:.3g} |", flush=True)
        found(f"{name}: error that the {KEPT} share", 1e3 * shared, "1e-3 psi²", note=f"disagreement {1e3 * apart:.3g}")
    truth, record = cases["VAL03"]["BP"], cases["EST01"]
    first = round(SAME_MOVEMENT_S / record.sample_time)
    again = record["BP"][first : first + len(truth)]
    found("VAL03 against the same movement in EST01", 1e3 * mse(again, truth[: len(again)]), "1e-3 psi²")


if __name__ == "__main__":
    main()
