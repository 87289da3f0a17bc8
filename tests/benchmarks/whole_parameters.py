"""Parameters of an equation in a whole, estimated with a network: how often their 95 % intervals hold the truth.

    python -m tests.benchmarks whole_parameters --seeds=50

Two simulated tanks (``tests/composite/composites.py``) with noise of 0.01 cm: the outflow of the upper one is an
equation of two parameters, the lower tank a network of two neurons. Two traces of 300 samples are fitted, one chooses.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from sysid.estimation import JointTraining
from sysid.models import NARX
from tests.benchmarks._findings import found
from tests.composite.composites import SHORT, member
from tests.composite.test_parameters import TRUTH, plan, tanks, trained


def main() -> None:
    """Every seed."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--seeds", type=int, default=50)
    seeds = arguments.parse_args().seeds
    structure = NARX(input_delays=[0], output_delays=1, neurons=2)
    composite = tanks(members=(member("flow -> lower", 0.0, structure=structure, training=SHORT),))
    asked = plan(training=JointTraining(max_iterations=60, workers=1))
    began, off = time.process_time(), []
    for seed in range(seeds):
        one = trained(1000 + 3 * seed, composite, asked).rounds[0].fit.uncertainty
        off.append((one.values - list(TRUTH.values())) / one.standard_deviations)
    for name, column in zip(TRUTH, np.abs(off).T, strict=True):
        found(f"{name}: 95 % intervals that hold the truth", 100.0 * float(np.mean(column < 1.96)), "%")
    found("deviations from the truth over the standard deviations told", float(np.std(off)), "")
    found("processor time of a fit, candidates and all", (time.process_time() - began) / seeds, "s")


if __name__ == "__main__":
    main()
