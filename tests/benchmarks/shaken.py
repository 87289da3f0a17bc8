"""A shaken structure of eight modes whose last spring stiffens: networks on thinned records and on all samples.

    python -m tests.benchmarks shaken

Two records of 12,000 samples at 400 Hz, forces of 2 and 6 N from 2 to 15 Hz, and the acceleration of the first of eight
masses; a third one, of 4 N, is free-run after 50 samples. One start each of NSS 16/4, ended after 100 s by the clock,
and a linear state space of 16 states.
"""

from __future__ import annotations

import os
import time
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from sysid.estimation.linear.state_space.fit import fit_state_space
from sysid.estimation.networks.neural.state_space import fit_neural_state_space
from sysid.estimation.networks.training import Training
from sysid.models import LinearStateSpace, NeuralStateSpace, Start
from sysid.traces import Role
from sysid.validation import case_results
from tests.benchmarks._findings import found
from tests.estimation.networks.structures import MAPPING, shaken

SAMPLES, MODES, STIFFENING, SECONDS = 12_000, 8, 1e-3, 100.0


def main() -> None:
    """Each once."""
    made: dict[str, Any] = {"n": SAMPLES, "modes": MODES, "stiffening": STIFFENING}
    records, other = [shaken(0, 2.0, **made), shaken(1, 6.0, **made)], shaken(7, 4.0, **made)
    start, network = Start.of({"measured": 50}), NeuralStateSpace(states=2 * MODES, neurons=4)
    linear = LinearStateSpace(states=2 * MODES, noise=False, feedthrough=True)
    fits = {
        "linear state space, 16 states": lambda: fit_state_space(records, MAPPING, linear, start=start),
        **{
            f"NSS 16/4, {name}": lambda thin=thin: fit_neural_state_space(
                records, MAPPING, network, Training(starts=1, thin=thin, max_time_s=SECONDS), start=start
            )
            for name, thin in (("thinned records first", None), ("all samples throughout", 1))
        },
    }
    for name, fit in fits.items():
        begin = time.process_time()
        model = fit().model
        took = time.process_time() - begin
        (case,) = case_results(model, other, Role.TEST, start, 1).values()
        share = float(np.sqrt(case.free_run.mse / np.var(other["y"])))
        found(
            f"shaken structure, {name}",
            100.0 * share,
            "%",
            note=f"of the standard deviation; {took:.0f} s of processor",
        )


if __name__ == "__main__":
    main()
