"""The cascades that benchmarks run: fitted ones from where they lie, and others with random weights."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sysid.airbrake.command import Command
from sysid.export import read_bundle
from sysid.models import NARX, Cascade, Limit, Mapping, NARXModel, Scaling, parameter_count
from sysid.workbench.assembly.runner import read_assembly
from sysid.workbench.assembly.warm_start import read_whole
from tests.benchmarks._findings import read

ROWS = [[0, 90], [100, 84], [300, 90], [500, 70], [800, 90], [1100, 64.2], [1300, 90], [1700, 0], [1800, 90]]
DESIGNED = Command.from_rows(ROWS, duration=2000.0)
"""2,000 s of command: applications of every depth, and an emergency."""
SERVICE = (("STP -> BP", 20), ("BP -> AR", 15), ("BP+AR -> BC", 30))
COMBINED = (("STP -> BP", 20), ("BP -> ER", 15), ("BP+ER -> AR", 20), ("BP+AR+ER -> BC", 30))
LEVELS = {"BP": 90.0, "AR": 90.0, "ER": 90.0, "BC": 0.0}


@dataclass(frozen=True)
class Fitted:
    """A fitted whole, what it is called, and what it puts out as a surrogate: everything, if ``None``."""

    name: str
    whole: Cascade
    outputs: tuple[str, ...] | None


def fitted(place: Path) -> Fitted:
    """The fitted whole of a bundle, folder or zip, whose digest is said; or of a run folder."""
    if not place.is_file() and not (place / "model.json").is_file():
        return Fitted(place.resolve().name, read_assembly(place), None)
    whole, bundle = read_whole(place)[0], read_bundle(place)
    read(f"{place.as_posix()}, as its model.json has it", str(bundle.metadata["digest"]))
    # A published bundle lies in the folder of its report, a run's in the folder of the run.
    name = place.resolve().parent.name if place.name == "bundle" else place.resolve().stem
    return Fitted(name, whole, tuple(str(entry["name"]) for entry in bundle.outputs))


def network(text: str, neurons: int, seed: int, extra: tuple[str, ...] = ()) -> NARXModel:
    """A network with lags in powers of two and small random weights."""
    mapping = Mapping.parse(text)
    mapping = Mapping(inputs=(*mapping.inputs, *extra), output=mapping.output)
    n = len(mapping.inputs)
    delays = [[0, 1, 2, 4, 8, 16, 32]] * (n - len(extra)) + [[0]] * len(extra)
    structure = NARX(input_delays=delays, output_delays=[1, 2, 4, 8], neurons=neurons)
    count = parameter_count(structure.lags(n), neurons, linear=True)
    return NARXModel(
        network=structure,
        theta=np.random.default_rng(seed).normal(0.0, 0.05, count),
        scaling=Scaling(input_offset=(77.0,) * n, input_scale=(13.0,) * n, output_offset=45.0, output_scale=45.0),
        mapping=mapping,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_unit="psi",
        rest_output=LEVELS[mapping.output],
    )


def cascade(members: tuple[tuple[str, int], ...], seed: int = 0, extra: tuple[str, ...] = ()) -> Cascade:
    """An assembly with the limits that users expect."""
    models = [network(text, neurons, seed + i, extra) for i, (text, neurons) in enumerate(members)]
    return Cascade(models=models, rest={"BP": "STP"}, limits={"BC": Limit(low=0.0, high="BP")})
