"""One iteration of training a whole end to end, against its limit: the matrix product of its normal equations.

    python -m tests.benchmarks end_to_end --whole=reports/combined-brake-held/bundle

2,000 s of command through the fitted whole of a bundle or a run folder (a cascade of four networks with random weights
without one); every member is trained, every tenth sample of every output of a network counts. Beside it the product of
a matrix of the same shape, which is all that an iteration would take if the sensitivities were free. Medians of five
after one run that warms up; one BLAS thread, processor times.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from sysid.estimation.networks.together.provider import CascadeProvider
from sysid.models import Cascade, Ends
from sysid.reporting.numbers import number
from sysid.traces import Channel, Trace
from tests.benchmarks._cascades import COMBINED, DESIGNED, cascade, fitted
from tests.benchmarks._findings import found
from tests.benchmarks._timing import handle
from tests.benchmarks.training import median_ms

STRIDE = 10


def networks(whole: Cascade) -> tuple[str, ...]:
    """Outputs of the members that have neurons."""
    with_neurons = [model for model in whole.models if getattr(model.structure, "neurons", 0)]
    return tuple(name for model in with_neurons for name in Ends.of(model).outputs)


def record(whole: Cascade, outputs: tuple[str, ...]) -> Trace:
    """What the whole itself puts out, and a little more: residuals that are not all zero."""
    u = handle(DESIGNED)
    run = whole.simulate(u)
    noise = np.random.default_rng(0).normal(0.0, 0.1, (len(u), len(outputs)))
    values = np.column_stack([u, np.stack([run[name] for name in outputs], axis=1) + noise])
    channels = tuple(Channel(name=name, unit="psi") for name in (*whole.inputs, *outputs))
    return Trace(name="command", sample_time=whole.sample_time, channels=channels, values=values)


def iteration(name: str, whole: Cascade) -> None:
    """One iteration and its limit."""
    outputs = networks(whole)
    provider = CascadeProvider(
        cascade=whole,
        traces=(record(whole, outputs),),
        errors=dict.fromkeys(outputs, 0.1),
        trained=outputs,
        stride=STRIDE,
    )
    theta = provider.theta
    print(f"{name}: {len(whole.models)} members, {len(outputs)} networks trained, {len(theta)} parameters")
    took, free = median_ms(lambda: provider.linearise(theta), 5), median_ms(lambda: provider.loss(theta), 5)
    rows = np.random.default_rng(0).standard_normal((provider.n_samples, len(theta)))
    product = median_ms(lambda: rows.T @ rows, 5)
    found(
        f"{name}: one iteration", took.processor / 1e3, "s", note=f"{took.note}; free run {number(free.processor)} ms"
    )
    found(
        f"{name}: one iteration, divided by the product of a matrix of its shape",
        took.processor / product.processor,
        "x",
        note=f"{provider.n_samples} rows; product {number(product.processor)} ms",
    )


def main() -> None:
    """The iterations of the wholes that are named."""
    folders = [Path(word.removeprefix("--whole=")) for word in sys.argv[1:] if word.startswith("--whole=")]
    with threadpool_limits(1, user_api="blas"):
        for folder in folders:
            one = fitted(folder)
            iteration(one.name, one.whole)
        if not folders:
            iteration("four networks", cascade(COMBINED))


if __name__ == "__main__":
    main()
