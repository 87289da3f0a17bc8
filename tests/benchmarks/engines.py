"""One network alone and as a cascade of one: free run, and residuals with their normal equations.

    python -m tests.benchmarks engines

Networks of two inputs with random weights over 20,000 samples, and free runs of 200. Medians of nine after one run that
warms up, the two in turn; one BLAS thread, processor times. Both have one mechanism: what is left between them is
noise, or what the whole's errors cost, of which none counts as one here.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.networks.together.provider import CascadeProvider
from sysid.estimation.records.experiment import Experiment
from sysid.models import NARX, Cascade, History, Mapping, NARXModel, Scaling, parameter_count
from sysid.reporting.numbers import number
from sysid.traces import Channel, Trace
from tests.benchmarks._findings import found

SAMPLES, SHORT, REPEATS, CALLS, ERROR = 20_000, 200, 9, 100, 0.25
NETWORKS = (
    NARX(input_delays=5, output_delays=3, neurons=0),
    NARX(input_delays=2, output_delays=2, neurons=4),
    NARX(input_delays=5, output_delays=3, neurons=12),
    NARX(input_delays=5, output_delays=3, neurons=12, gated=True),
    NARX(input_delays=10, output_delays=10, neurons=40),
)


def providers(network: NARX, samples: int = SAMPLES) -> tuple[RecursionProvider, CascadeProvider]:
    """The residuals of one network over one record, both ways."""
    rng, names = np.random.default_rng(0), ("u0", "u1")
    model = NARXModel(
        network=network,
        theta=0.1
        * rng.standard_normal(parameter_count(network.lags(2), network.neurons, linear=True, gated=network.gated)),
        scaling=Scaling.identity(2),
        mapping=Mapping.parse("u0+u1 -> y"),
        sample_time=0.1,
        input_units=("", ""),
        output_unit="",
        rest_output=0.0,
    )
    u, y = rng.uniform(-1.0, 1.0, (samples, 2)), rng.uniform(-1.0, 1.0, samples)
    record = Experiment(inputs=u, output=y, history=History.at_rest(inputs=list(u[0]), output=0.0))
    channels = tuple(Channel(name=name, unit="") for name in (*names, "y"))
    trace = Trace(name="record", sample_time=0.1, channels=channels, values=np.column_stack([u, y]))
    return (
        RecursionProvider(template=model.recursion, experiments=(record,), closed=True),
        CascadeProvider(cascade=Cascade(models=(model,)), traces=(trace,), errors={"y": ERROR}),
    )


def medians(calls: list[Callable[[], object]]) -> list[float]:
    """Processor times of some calls in turn, in milliseconds."""
    took: list[list[float]] = [[] for _ in calls]
    for _ in range(1 + REPEATS):
        for call, times in zip(calls, took, strict=True):
            began = time.process_time()
            call()
            times.append(1e3 * (time.process_time() - began))
    return [statistics.median(times[1:]) for times in took]


def often(call: Callable[[], object]) -> None:
    """A short call as often as a clock can tell."""
    for _ in range(CALLS):
        call()


def main() -> None:
    """Every network, both ways."""
    for network in NETWORKS:
        alone, whole = providers(network)
        theta = whole.theta
        own, of_whole = (provider.linearise(theta).gradient for provider in (alone, whole))
        np.testing.assert_allclose(of_whole * ERROR**2, own, rtol=0.0, atol=1e-13 * np.abs(own).max())
        loss, linearise = (
            medians([partial(getattr(one, name), theta) for one in (alone, whole)]) for name in ("loss", "linearise")
        )
        for what, (one, other) in (("free run", loss), ("normal equations", linearise)):
            label = f"{network.label}, {len(theta)} parameters: {what}, alone over as a cascade of one"
            found(label, one / other, "x", note=f"{number(one)} and {number(other)} ms")
        calls = [partial(often, partial(provider.loss, theta)) for provider in providers(network, SHORT)]
        one, other = (1e3 * took / CALLS for took in medians(calls))
        label = f"{network.label}: free run of {SHORT} samples, alone over as a cascade of one"
        found(label, one / other, "x", note=f"{number(one)} and {number(other)} us")


if __name__ == "__main__":
    with threadpool_limits(1, "blas"):
        main()
