"""Run a bundle's FMUs, FMI 2.0 and 3.0, over its records in Ecos, whose importer is fmi4c.

pip install ecospy tbb
python ecos_fmus.py path/to/bundle
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import json
import sys
from pathlib import Path

from records import Row, check

# Ecos is built on TBB's library, and looks for it where the system keeps its own. Loaded before, it is found.
for file in importlib.metadata.files("tbb") or []:
    if file.name == "libtbb.so.12":
        ctypes.CDLL(str(file.locate()), mode=ctypes.RTLD_GLOBAL)

from ecospy import EcosSimulation, EcosSimulationStructure  # noqa: E402 - TBB first, see above


def simulate(fmu: Path, inputs: dict[str, list[float]], outputs: list[str]) -> tuple[list[Row], list[int]]:
    """A free run from rest: the inputs of each sample are set before its step, its outputs are read after it."""
    step = json.loads((fmu.parent / "model.json").read_text(encoding="utf-8"))["sample_time_s"]
    structure = EcosSimulationStructure()
    structure.add_model("one", str(fmu))
    simulation = EcosSimulation(step_size=step, structure=structure)
    samples = [dict(zip(inputs, row, strict=True)) for row in zip(*inputs.values(), strict=True)]
    for name, value in samples[0].items():
        simulation.set_real(f"one::{name}", value)
    if not simulation.init():
        sys.exit(f"Ecos cannot initialise {fmu.name}")
    found, flags = [], []
    for sample in samples:
        for name, value in sample.items():
            simulation.set_real(f"one::{name}", value)
        simulation.step()
        found.append([simulation.get_real(f"one::{name}") for name in outputs])
        flags.append(simulation.get_integer("one::flags"))
    simulation.terminate()
    simulation.free()
    structure.free()
    return found, flags


if __name__ == "__main__":
    sys.exit(1 if check(Path(sys.argv[1]), [".fmi2.fmu", ".fmi3.fmu"], simulate) else 0)
