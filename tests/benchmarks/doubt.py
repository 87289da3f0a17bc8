"""Published wholes of the brake on kinds of command that they never saw, and how many of their errors they doubt.

    python -m tests.benchmarks doubt
    python -m tests.benchmarks doubt --count=8 --first=100 --error=1
    python -m tests.benchmarks doubt --wholes=service-cascade-any,combined-brake-grown,combined-brake-held
    python -m tests.benchmarks doubt --wholes=service-cascade-any --perturb=0.3
    python -m tests.benchmarks doubt --wholes=service-cascade-held,service-cascade-any --count=1 --cost=1

* Each published whole of the service brake (``WHOLES``, or those of ``--wholes=``) alone on ``abdx-kinds-unseen``: per
  kind the share of the sequences within 1 psi rms, and how many diverge. ``--count=`` takes so many of each kind from
  number ``--first=`` on.
  ``--fresh=10000`` draws the same kinds from other seeds, which begin there: nothing here has looked at those.
* Each of them as the first member of a committee with the others: the threshold of its doubt is found on
  ``abdx-kinds-calibration`` (``--calibrate=`` sequences of each of its three kinds) so that 5 % of the right answers
  are doubted there; then per unseen kind the share of samples with an error over ``--error=`` psi, how many of these
  are in doubt, and how many of the others.
* With ``--perturb=`` psi each of them with itself, what its relay reads of the pipe moved up and down by so much.
* With ``--mean=1`` each of them, and the committee that answers with the mean of all: of all samples the share with an
  error over ``--error=`` psi, on the calibration and the unseen sequences, and how many of these its spread doubts.
* With ``--look=1`` nothing of that, but each stretch of over 3 s in which a whole, or the mean of all, is off by more
  than ``--error=``: by how much at most, and the median error of cylinder, pipe and reservoir in it.
* With ``--cost=1`` what a doubt costs: size and run time of the files of each whole, alone and as a committee's first.

Making the traces takes some 2 s of processor time each, once.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sysid.composite import DoubtFigures, committee, doubt_figures, doubt_threshold, perturbed, run_monte_carlo
from sysid.export import EXPORTERS, Surrogate, read_bundle
from sysid.export.run_times import SAMPLES, measure_run_times
from sysid.ingest import load_dataset
from sysid.ingest.datasets.dataset import find_dataset
from sysid.models import Cascade
from sysid.traces import Trace

REPORTS = Path(__file__).parents[2] / "reports"
WHOLES = ("service-cascade-grown", "combined-brake-grown", "combined-brake-held")
UNSEEN = ("staircase", "ramps", "sine", "prbs", "minimum")
CALIBRATION = ("noise", "multisine", "random")
OUTPUT = "BC"


def option(name: str, default: float) -> float:
    """A number given as ``--name=value``."""
    given = [word.partition("=")[2] for word in sys.argv[1:] if word.startswith(f"--{name}=")]
    return float(given[-1]) if given else default


def named() -> tuple[str, ...]:
    """The wholes."""
    given = [word.partition("=")[2] for word in sys.argv[1:] if word.startswith("--wholes=")]
    return tuple(given[-1].split(",")) if given else WHOLES


def sequences(data: str, kinds: tuple[str, ...], first: int, count: int) -> dict[str, list[Trace]]:
    """Traces by kind."""
    return {
        kind: list(load_dataset(data, cases=[f"{kind}-{k:03}" for k in range(first, first + count)])) for kind in kinds
    }


def fresh(data: str, count: int, seed: int) -> dict[str, list[Trace]]:
    """The same kinds of command from other seeds."""
    text = find_dataset(data).read_text(encoding="utf-8")
    text = re.sub(r"seed: (\d+)", lambda found: f"seed: {int(found[1]) + seed}", text)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "dataset.yaml").write_text(text, encoding="utf-8")
        return sequences(folder, UNSEEN, 0, count)


def main(unseen: dict[str, list[Trace]], known: dict[str, list[Trace]], error: float, by: float) -> None:
    """Print both tables."""
    wholes: dict[str, Cascade] = {}
    for name in named():
        model = read_bundle(REPORTS / name / "bundle").model
        wholes[name] = model if isinstance(model, Cascade) else Cascade(models=(model,))
    if option("look", 0.0):
        look(wholes, unseen, error)
        return
    every = [trace for traces in unseen.values() for trace in traces]
    for name, whole in wholes.items():
        found = run_monte_carlo(whole, every, OUTPUT, 1.0)
        print(f"{name}: {100 * found.within:.1f} % of {found.sequences} within 1 psi, {found.lost} diverge")
        for kind, one in found.by_kind.items():
            print(f"  {kind:<10} {100 * one.within:5.1f} %  median {one.quantiles[0.5]:.2f} psi, {one.lost} diverge")
    if option("mean", 0.0):
        mean(wholes, known, unseen, error)
    calibration = [trace for traces in known.values() for trace in traces]
    for name in named() if by or len(wholes) > 1 else ():
        others = [whole for other, whole in wholes.items() if other != name]
        if by:
            others = [perturbed(wholes[name], "BP", one, readers=["RL"]) for one in (by, -by)]
        members, each = [wholes[name], *others], bool(by)
        threshold = doubt_threshold(members, calibration, OUTPUT, error=error, each=each)
        both = committee(members, {OUTPUT: threshold}, each=each)
        print(f"{name} first, in doubt from {threshold:.2f} psi: wrong, of these in doubt, of the others in doubt, %")
        known_kinds = {f"({kind})": traces for kind, traces in known.items()}
        if option("cost", 0.0):
            cost(wholes[name], both)
        of = {
            kind: doubt_figures(both, traces, OUTPUT, error=error) for kind, traces in {**known_kinds, **unseen}.items()
        }
        report(of, tuple(unseen))


def mean(
    wholes: dict[str, Cascade], known: dict[str, list[Trace]], unseen: dict[str, list[Trace]], error: float
) -> None:
    """Print how many samples are wrong of each whole and of the mean of all, and how many its spread doubts."""
    calibration = [trace for traces in known.values() for trace in traces]
    threshold = doubt_threshold(list(wholes.values()), calibration, OUTPUT, error=error, mean=True)
    both = committee(list(wholes.values()), {OUTPUT: threshold}, mean=[OUTPUT])
    sequences = {**{f"({kind})": traces for kind, traces in known.items()}, **unseen}
    print(f"samples with an error over {error:g} psi, %")
    for name, whole in {**wholes, "their mean": both}.items():
        wrong = {
            kind: [
                100.0 * float(np.mean(np.abs(whole.simulate_trace(one)[OUTPUT] - one[OUTPUT]) > error)) for one in some
            ]
            for kind, some in sequences.items()
        }
        told = ", ".join(f"{kind} {np.mean(shares):.2f}" for kind, shares in wrong.items())
        print(f"  {name}: all unseen {np.mean([share for kind in unseen for share in wrong[kind]]):.2f}; {told}")
    print(f"their mean, in doubt from a spread of {threshold:.2f} psi: wrong, of these in doubt, of the others, %")
    report(
        {kind: doubt_figures(both, traces, OUTPUT, error=error) for kind, traces in sequences.items()}, tuple(unseen)
    )


def look(wholes: dict[str, Cascade], unseen: dict[str, list[Trace]], error: float) -> None:
    """Print where wholes and their mean are wrong, and what else is wrong there."""
    channels = ("BC", "BP", "AR")
    for trace in [one for traces in unseen.values() for one in traces]:
        alone = {name: whole.simulate_trace(trace) for name, whole in wholes.items()}
        off = {name: np.array([run[one] - trace[one] for one in channels]) for name, run in alone.items()}
        for name, errors in {**off, "their mean": np.mean(list(off.values()), axis=0)}.items():
            edges = np.flatnonzero(np.diff(np.abs(np.pad(errors[0], 1)) > error))
            for begin, end in edges.reshape(-1, 2):
                if (end - begin) * trace.sample_time > 3.0:
                    part = errors[:, begin:end]
                    told = ", ".join(f"{c} {v:+.2f}" for c, v in zip(channels, np.median(part, axis=1), strict=True))
                    span = f"{begin * trace.sample_time:.0f} to {end * trace.sample_time:.0f} s"
                    print(f"{trace.name} {name}, {span}: {np.abs(part[0]).max():.2f} at most; median {told}")


def report(of: dict[str, DoubtFigures], unseen: Sequence[str]) -> None:
    """Print how much is wrong, and in doubt, by kind."""
    for kind, figures in {**of, "all unseen": together([of[kind] for kind in unseen])}.items():
        print(f"  {kind:<12} {100 * figures.wrong:5.1f} {100 * figures.flagged:5.1f} {100 * figures.false:5.1f}")


def cost(alone: Cascade, both: Cascade) -> None:
    """Print size and run time of the files of a whole, and how many times that is what it is with its doubts."""
    found = []
    for one in (alone, both):
        surrogate = Surrogate.of(one, {"STP": (64.0, 90.0)}, outputs=[OUTPUT])
        with tempfile.TemporaryDirectory() as folder:
            files = [file for name in ("c", "onnx") for file in EXPORTERS[name].write(surrogate, Path(folder))]
            sizes = {file.name: (Path(folder) / file.name).stat().st_size for file in files}
            times = {run.name: run.seconds for run in measure_run_times(surrogate, files, Path(folder), cars=1)}
        found.append((sizes, times))
    (size, seconds), (larger, longer) = found
    for name in seconds:
        run = f"{1e6 * longer[name] / SAMPLES:.2f} µs a sample ({longer[name] / seconds[name]:.2f} x)"
        told = f", {larger[name] / 1e3:.0f} kB ({larger[name] / size[name]:.2f} x)" if name in size else ""
        print(f"  {name}: {run}{told}")


def together(parts: list[DoubtFigures]) -> DoubtFigures:
    """The figures of several sets of samples as those of one."""
    samples = np.array([part.samples for part in parts])
    wrong = samples * [part.wrong for part in parts]
    return replace(
        parts[0],
        samples=int(samples.sum()),
        wrong=float(wrong.sum() / samples.sum()),
        flagged=float(np.sum(wrong * [part.flagged for part in parts]) / max(wrong.sum(), 1.0)),
        false=float(np.average([part.false for part in parts], weights=samples - wrong)),
    )


if __name__ == "__main__":
    number, begins = int(option("count", 8)), int(option("fresh", 0))
    main(
        fresh("abdx-kinds-unseen", number, begins)
        if begins
        else sequences("abdx-kinds-unseen", UNSEEN, int(option("first", 100)), number),
        {}
        if option("look", 0.0)
        else sequences("abdx-kinds-calibration", CALIBRATION, 0, int(option("calibrate", 10))),
        option("error", 1.0),
        option("perturb", 0.0),
    )
