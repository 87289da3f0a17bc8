"""From plants of thirteen kinds to surrogates: what one command makes of each in some minutes.

Run with ``python -m tests.benchmarks surrogate_kinds --minutes=2 --only=dcmotor,exchanger --proof=200 --seed=0``.
References are those of ``tests/references/compiled_kinds.py``, by their ranges, sample time and duration alone, with
one worker. ``--clock=processor`` lets the minutes count processor time, so that figures of a machine that does other
things meanwhile can be set beside each other; by default they count the wall's. The target is 99 % of new experiments
within 1 % of the range for what is smooth, 95 % for what has events (stops, relay, cylinder).
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

MODELS = Path(__file__).parents[1] / "references"


def count_processor_time() -> None:
    """Let both clocks count the processor time of this process; before anything that reads them is imported."""
    began = time.monotonic()
    time.monotonic = time.perf_counter = lambda: began + time.process_time()


def spent() -> float:
    """Processor seconds of this process and of those that it has started."""
    return sum(resource.getrusage(who).ru_utime for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def main() -> None:
    """Make each, and print a row."""
    given = dict(word.removeprefix("--").split("=", 1) for word in sys.argv[1:])
    if given.get("clock") == "processor":
        count_processor_time()
    import numpy as np

    import sysid

    sys.path.insert(0, str(MODELS))
    from compiled_kinds import TABLE

    print(f"{'reference':<12}{'new':>6}{'rms':>9}{'everywhere':>12}{'processor s':>13}  error in half of them, model")
    for name in given["only"].split(",") if "only" in given else TABLE:
        ranges, outputs, sample_time, duration = TABLE[name]
        began = spent()
        with tempfile.TemporaryDirectory() as place:
            made = sysid.surrogate(
                f"{MODELS / 'compiled_kinds.py'}:{name}", place, ranges=ranges, outputs=outputs, workers=1,
                sample_time=sample_time, duration=duration, minutes=float(given.get("minutes", 2.0)),
                proof=int(given.get("proof", 200)), seed=int(given.get("seed", 0)),
            )  # fmt: skip
        proof, took = made.proof, spent() - began
        half = ", ".join(f"{100.0 * one:.2g} %" for one in np.median(proof.errors, axis=0))
        row = f"{name:<12}{len(proof.errors):>6}{proof.share:>9.1%}{proof.share_everywhere:>12.1%}{took:>13.0f}  {half}"
        print(row, flush=True)
        for note in made.notes:
            print(f"  {note}")


if __name__ == "__main__":
    main()
