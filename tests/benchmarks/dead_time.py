"""Dead times that the search of a transfer function finds: 0 to 60 samples, noise 20 dB below.

    python -m tests.benchmarks dead_time [--seeds=3] [--step=1]

600 samples through one pole, or two, or two that are close; steps of five, a PRBS, steps of chance lengths, filtered
noise; and two inputs with dead times of their own. Each dead time is tried with some of 20 seeds, others for each:
``--seeds=20`` tries all. It counts as found within one sample; one that stands at the end of the search has to say so.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter, max_len_seq

from sysid.estimation import fit_transfer_function
from sysid.models import Mapping, Start, StartKind, TransferFunction
from sysid.traces import Trace
from tests.benchmarks._findings import found
from tests.estimation.linear_systems import trace_of

SAMPLES, DECIBEL, LONGEST, SEEDS = 600, 20.0, 60, 20
PLANTS = {
    "1 pole": ([0.3], [1.0, -0.7]),
    "2 poles": ([0.02, 0.015], list(np.convolve([1.0, -0.9], [1.0, -0.8]))),
    "2 close poles": ([0.05, 0.0], list(np.convolve([1.0, -0.86], [1.0, -0.84]))),
}
"""Numerator and denominator."""
ESTIMATED = Start(kind=StartKind.ESTIMATED)
Signal = Callable[[np.random.Generator], NDArray[np.float64]]


def steps_of_five(rng: np.random.Generator) -> NDArray[np.float64]:
    """Two levels, each held for five samples."""
    return np.repeat(rng.integers(0, 2, SAMPLES // 5), 5) * 2.0 - 1.0


def prbs(rng: np.random.Generator) -> NDArray[np.float64]:
    """A maximum length sequence of order 8, a clock of three samples, begun anywhere."""
    bits = np.roll(max_len_seq(8)[0], int(rng.integers(255)))
    return np.resize(np.repeat(bits, 3), SAMPLES) * 2.0 - 1.0


def steps_of_chance(rng: np.random.Generator) -> NDArray[np.float64]:
    """Levels of chance, held for 20 to 80 samples."""
    lengths = rng.integers(20, 80, SAMPLES // 20)
    return np.repeat(rng.uniform(-1.0, 1.0, len(lengths)), lengths)[:SAMPLES]


def filtered_noise(rng: np.random.Generator) -> NDArray[np.float64]:
    """White noise through a pole at 0.8."""
    return np.asarray(lfilter([1.0], [1.0, -0.8], rng.standard_normal(SAMPLES)))


@dataclass(frozen=True, kw_only=True)
class Kind:
    """One kind of record.

    Args:
        plant: Which plant.
        signal: Its input.
        step: From one dead time to the next.
        share: Of the seeds that are asked for.
        second: Whether another input acts, through one pole and a dead time of its own.
    """

    plant: str
    signal: Signal
    step: int = 1
    share: float = 1.0
    second: bool = False


KINDS = {
    "1 pole, steps of five": Kind(plant="1 pole", signal=steps_of_five),
    "2 poles, steps of five": Kind(plant="2 poles", signal=steps_of_five),
    "2 close poles, steps of five": Kind(plant="2 close poles", signal=steps_of_five, step=4, share=0.5),
    "2 poles, PRBS": Kind(plant="2 poles", signal=prbs, step=4, share=0.5),
    "1 pole, steps of 20 to 80": Kind(plant="1 pole", signal=steps_of_chance, step=4, share=0.5),
    "2 poles, filtered noise": Kind(plant="2 poles", signal=filtered_noise, step=4, share=0.5),
    "two inputs": Kind(plant="1 pole", signal=steps_of_five, step=6, share=0.25, second=True),
}


def passed(u: NDArray[np.float64], plant: str, dead: int) -> NDArray[np.float64]:
    """An input through a plant with a dead time."""
    b, f = PLANTS[plant]
    return np.asarray(lfilter([*np.zeros(dead), *b], f, u))


def record(kind: Kind, dead: int, seed: int) -> tuple[Trace, tuple[int, ...]]:
    """A record with noise, and its dead times."""
    rng = np.random.default_rng([seed, dead])
    inputs, delays = [kind.signal(rng)], (dead,)
    clean = passed(inputs[0], kind.plant, dead)
    if kind.second:
        inputs.append(kind.signal(rng))
        delays = (dead, (dead * 7 + 11) % (LONGEST + 1))
        clean = clean + passed(inputs[1], "1 pole", delays[1])
    noise = rng.standard_normal(SAMPLES) * clean.std() * 10 ** (-DECIBEL / 20)
    return trace_of(np.column_stack(inputs), clean + noise), delays


def hit(kind: Kind, dead: int, seed: int) -> tuple[bool, bool]:
    """Whether the dead times are found within one sample, and whether one at the end of the search was not told."""
    trace, delays = record(kind, dead, seed)
    poles = tuple(len(PLANTS[plant][1]) - 1 for plant in [kind.plant, "1 pole"][: len(delays)])
    mapping = Mapping.parse("u1 -> y" if len(delays) == 1 else "u1+u2 -> y")
    orders = TransferFunction(poles=poles, zeros=tuple(n - 1 for n in poles))
    fit = fit_transfer_function([trace], mapping, orders, start=ESTIMATED)
    got = fit.model.structure.to_dict()["delays"]
    silent = max(got) >= SAMPLES // 3 and not any("longest that was tried" in note for note in fit.notes)
    return all(abs(one - other) <= 1 for one, other in zip(got, delays, strict=True)), silent


def main() -> None:
    """Count."""
    given = dict(option.removeprefix("--").split("=") for option in sys.argv[1:] if option.startswith("--"))
    seeds, step = int(given.get("seeds", 3)), int(given.get("step", 1))
    silent = 0
    for name, kind in KINDS.items():
        began, results = time.process_time(), []
        for dead in range(0, LONGEST + 1, kind.step * step):
            some = max(1, round(seeds * kind.share))
            results += [hit(kind, dead, (dead * seeds + i) % SEEDS) for i in range(some)]
        hits, total = sum(found for found, _ in results), len(results)
        silent += sum(quiet for _, quiet in results)
        share, each = 100.0 * hits / total, (time.process_time() - began) / total
        print(f"{name}: {hits} of {total} within one sample ({share:.1f} %), {each:.2f} s a fit", flush=True)
        found(f"dead times found within one sample, {name}", share, "%", target=95.0, at_least=True)
    found("dead times at the end of the search in silence", silent, "", target=0.0)


if __name__ == "__main__":
    main()
