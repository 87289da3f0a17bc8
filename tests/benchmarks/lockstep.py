"""Many records of a whole in lockstep, one by one, and as the whole's plan chooses.

    python -m tests.benchmarks lockstep

Wholes of networks with random weights, each reading what the two before it write; 4,000 samples a record, one thread.
Medians of seven after one run that warms up, the three ways in turn; processor times.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from unittest import mock

import numpy as np

from sysid.models import NARX, Cascade, Mapping, NARXModel, Scaling, parameter_count
from sysid.models.cascades import cascade_batch
from sysid.reporting.numbers import number
from tests.benchmarks._findings import found

SAMPLES, REPEATS = 4_000, 7
WHOLES = ((1, 3, 4), (1, 8, 8), (2, 3, 6), (3, 2, 4), (3, 3, 40), (3, 8, 4), (3, 8, 12), (5, 3, 8), (8, 3, 4), (8, 8, 2), (3, 3, 0))  # fmt: skip  # noqa: E501
"""Members, lags of each channel, and neurons of each member."""
RECORDS = (24, 50, 64, 100)
WAYS: dict[str, Callable[..., bool]] = {
    "one by one": lambda _plan, _records: False,
    "in lockstep": lambda _plan, _records: True,
    "as chosen": cascade_batch.lockstep_pays,
}


def whole(members: int, lags: int, neurons: int) -> Cascade:
    """A whole of networks in a row."""
    names, models, rng = ["u", *(f"y{i}" for i in range(members))], [], np.random.default_rng(0)
    for i in range(members):
        read = names[max(0, i - 1) : i + 1]
        network = NARX(input_delays=lags, output_delays=lags, neurons=neurons)
        n = parameter_count(network.lags(len(read)), neurons, linear=True, gated=False)
        models.append(
            NARXModel(
                network=network, theta=0.05 * rng.standard_normal(n), scaling=Scaling.identity(len(read)),
                mapping=Mapping.parse(f"{'+'.join(read)} -> {names[i + 1]}"), sample_time=0.1,
                input_units=("",) * len(read), output_unit="", rest_output=0.0,
            )
        )  # fmt: skip
    return Cascade(models=tuple(models))


def times(cascade: Cascade, records: int) -> dict[str, float]:
    """Milliseconds a record, by way."""
    inputs = np.random.default_rng(3).uniform(-1.0, 1.0, (records, SAMPLES, 1))
    took: dict[str, list[float]] = {way: [] for way in WAYS}
    for _ in range(1 + REPEATS):
        for way, pays in WAYS.items():
            with mock.patch.object(cascade_batch, "lockstep_pays", pays):
                began = time.process_time()
                cascade.simulate_batch(inputs, workers=1)
                took[way].append(1e3 * (time.process_time() - began) / records)
    return {way: statistics.median(some[1:]) for way, some in took.items()}


def main() -> None:
    """Every whole with every number of records."""
    ratios = []
    for members, lags, neurons in WHOLES:
        cascade = whole(members, lags, neurons)
        for records in RECORDS:
            own = times(cascade, records)
            ratios.append(own["as chosen"] / min(own["one by one"], own["in lockstep"]))
            told = ", ".join(f"{way} {number(ms)} ms" for way, ms in own.items())
            print(f"  {members} networks of {neurons} neurons, lags to {lags}, {records} records: {told}")
    found("many records of a whole: as chosen over the better way, on average", float(np.mean(ratios)), "x")
    found("many records of a whole: as chosen over the better way, at most", max(ratios), "x")


if __name__ == "__main__":
    main()
