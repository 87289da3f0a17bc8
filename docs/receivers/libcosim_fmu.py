"""Run a bundle's FMI 2.0 FMU over its records in libcosim, whose importer is Modelon's FMI Library.

pip install libcosimpy
python libcosim_fmu.py path/to/bundle
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
from records import Row, check


def simulate(fmu: Path, inputs: dict[str, list[float]], outputs: list[str]) -> tuple[list[Row], list[int]]:
    """A free run from rest: the inputs of each sample are set before its step, its outputs are read after it."""
    step = json.loads((fmu.parent / "model.json").read_text(encoding="utf-8"))["sample_time_s"]
    execution = CosimExecution.from_step_size(step_size=round(step * 1e9))
    one = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=str(fmu), instance_name="one"))
    reference = {variable.name.decode(): variable.reference for variable in execution.slave_variables(one)}
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator)
    execution.add_observer(observer)
    into, out_of = ([reference[name] for name in names] for names in (inputs, outputs))
    for variable, values in zip(into, inputs.values(), strict=True):
        execution.real_initial_value(one, variable, values[0])
    found, flags = [], []
    for sample in zip(*inputs.values(), strict=True):
        manipulator.slave_real_values(one, into, sample)
        if not execution.step():
            sys.exit(f"libcosim cannot step {fmu.name}")
        found.append(list(observer.last_real_values(one, out_of)))
        flags.append(observer.last_integer_values(one, [reference["flags"]])[0])
    return found, flags


if __name__ == "__main__":
    log_output_level(CosimLogLevel.WARNING)
    sys.exit(1 if check(Path(sys.argv[1]), [".fmi2.fmu"], simulate) else 0)
