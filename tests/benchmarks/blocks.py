"""Block-oriented models: of how many simulated systems whose blocks and curve are drawn the fit finds the system.

    python -m tests.benchmarks blocks [--seeds=20] [--only=Wiener] [--more=1]

Blocks of two poles (radius up to 0.95) and curves as below, over 800 samples of steps with 1 % of white noise.
A system is found where the free run over another record is off by less than 1 % of the spread of its true output.
Plain fits, nothing declared but the structure: default starts and iterations. With --more the structure has so many
states more in each block than the system.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

from sysid.estimation.fitting import fit
from sysid.estimation.networks.training import Training
from sysid.models import AbstractStructure, HammersteinWiener, Mapping, WienerHammerstein
from sysid.traces import Channel, Trace
from tests.benchmarks._findings import found

MAPPING = Mapping.parse("u -> y")
SAMPLES, NOISE, FOUND = 800, 0.01, 0.01
Curve = Callable[[np.ndarray], np.ndarray]
CUBIC, BETWEEN = "a cubic", ("a cubic", "a saturation")
CURVES: dict[str, tuple[Curve, str]] = {
    CUBIC: (lambda z: np.asarray(z + 2.0 * z**3), "polynomial 3"),
    "a cubic that folds back": (lambda z: np.asarray(z - 1.2 * z**3), "polynomial 3"),
    "a cubic without slope": (lambda z: np.asarray(z**3), "polynomial 3"),
    "a saturation": (lambda z: np.asarray(np.clip(z, -0.4, 0.5)), "saturation"),
}
KINDS: dict[str, Callable[[str, int], AbstractStructure]] = {
    "Hammerstein": lambda curve, more: HammersteinWiener(states=2 + more, input=curve),
    "Wiener": lambda curve, more: HammersteinWiener(states=2 + more, output=curve),
    "Wiener-Hammerstein": lambda curve, more: WienerHammerstein(first=2 + more, second=2 + more, curve=curve),
}


def block(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A block of two poles, a pair or real ones, whose largest gain is 1."""
    pair = rng.uniform(0.5, 0.93) * np.exp(1j * rng.uniform(0.1, 1.0))
    poles = [pair, pair.conjugate()] if rng.random() < 0.6 else list(rng.uniform(0.3, 0.95, 2))
    denominator, numerator = np.poly(poles).real, np.concatenate([[0.0], rng.standard_normal(2)])
    gain = np.abs(np.fft.rfft(numerator, 4096) / np.fft.rfft(denominator, 4096)).max()
    return numerator / gain, denominator


def steps(rng: np.random.Generator) -> np.ndarray:
    u = np.repeat(rng.uniform(-1.0, 1.0, SAMPLES // 4), 4)
    u[:20] = 0.0
    return u


def error(kind: str, curve: Curve, structure: AbstractStructure, seed: int) -> float:
    """Of the free run over another record, over the spread of its output."""
    rng = np.random.default_rng([seed, 7])
    first, second, u, other = block(rng), block(rng), steps(rng), steps(rng)
    size = np.abs(lfilter(*first, u)).max()

    def system(u: np.ndarray) -> np.ndarray:
        if kind == "Hammerstein":
            return np.asarray(lfilter(*first, curve(u)))
        y = curve(lfilter(*first, u) / size)
        return y if kind == "Wiener" else np.asarray(lfilter(*second, y))

    y, wanted = system(u), system(other)
    values = np.column_stack([u, y + NOISE * y.std() * rng.standard_normal(len(y))])
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    trace = Trace(name="record", sample_time=1.0, channels=channels, values=values)
    result = fit([trace], MAPPING, structure, Training(workers=1), stability=None)
    return float(np.std(result.model.simulate(other[:, None]) - wanted) / np.std(wanted))


def main() -> None:
    """Measure."""
    given = dict(option.removeprefix("--").split("=") for option in sys.argv[1:] if option.startswith("--"))
    seeds, more = int(given.get("seeds", 20)), int(given.get("more", 0))
    for kind, structure in KINDS.items():
        for name, (curve, written) in CURVES.items():
            if given.get("only", kind) != kind or (kind == "Wiener-Hammerstein" and name not in BETWEEN):
                continue
            began = time.process_time()
            errors = np.array([error(kind, curve, structure(written, more), seed) for seed in range(seeds)])
            missed = ", ".join(f"seed {i}: {100.0 * errors[i]:.1f} %" for i in np.flatnonzero(errors >= FOUND))
            seconds = (time.process_time() - began) / seeds
            note = f"median error {100.0 * np.median(errors):.2f} %, {seconds:.1f} s of processor time each; {missed}"
            title = f"{kind} with {name}{f', {more} states more in each block' * (more > 0)}: found of {seeds}"
            count = float(np.count_nonzero(errors < FOUND))
            found(title, count, target=float(seeds), at_least=True, note=note.rstrip("; "))


if __name__ == "__main__":
    main()
