"""FMI 2.0 and 3.0 for co-simulation: one file that Simulink, Dymola, OpenModelica and others take as a block."""

from __future__ import annotations

import ctypes
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sysid.errors import SysidError
from sysid.export.c.compiler import compiler
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Run, Runner
from sysid.export.surrogate import Surrogate

_P, _D, _I, _N = ctypes.c_void_p, ctypes.c_double, ctypes.c_int, ctypes.c_size_t


@dataclass(frozen=True, kw_only=True)
class FmuExporter(AbstractExporter):
    """Writes ``<name>.fmi2.fmu`` or ``<name>.fmi3.fmu``.

    Args:
        name: Name in the table.
        version: 2 or 3.
    """

    begins: ClassVar[bool] = True
    searches: ClassVar[bool] = True

    name: str
    version: int

    def check(self) -> None:
        """Look for a compiler: an FMU holds a binary."""
        compiler()

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Write the sources, build the binary for this machine, and pack both with the description."""
        from sysid.export.fmi.fmu import write_fmu

        file = f"{surrogate.identifier}.{self.name}.fmu"
        details = write_fmu(surrogate, self.version, folder / file)
        details |= {"n_inputs": len(surrogate.inputs), "n_outputs": len(surrogate.outputs)}
        details |= {"sample_time_s": surrogate.sample_time}
        return (ExportedFile(name=file, format=self.name, kind=Kind.STEP, details=details),)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Call the binary through the functions of FMI."""
        from sysid.export.fmi.fmu import unpack_binary

        with tempfile.TemporaryDirectory() as workplace:
            # The loader keeps what it has mapped, so that the file may go.
            library = ctypes.CDLL(str(unpack_binary(folder / file.name, self.version, Path(workplace))))
        calls = _Calls(library=library, version=self.version)

        def run(inputs: NDArray[Any], state: NDArray[Any] | None) -> Run:
            begun = [None] * inputs.shape[1] if state is None else list(state)
            cars = [_run_car(calls, file.details, inputs[:, i], one) for i, one in enumerate(begun)]
            return Run(
                output=np.stack([car.output for car in cars], axis=1),
                state=np.stack([car.state for car in cars]),
                flags=np.stack([car.flags for car in cars], axis=1),
            )

        return run


@dataclass(frozen=True, kw_only=True)
class _Calls:
    """The functions of either version by what they do."""

    library: ctypes.CDLL
    version: int

    def __getattr__(self, name: str) -> Any:
        old = {"Float64": "Real", "Int32": "Integer", "FMUState": "FMUstate", "Deserialize": "DeSerialize"}
        for new, former in old.items() if self.version == 2 else ():
            name = name.replace(new, former)
        return self.library[f"fmi{self.version}{name}"]

    def instantiate(self, guid: str) -> ctypes.c_void_p:
        """A new instance without callbacks."""
        call, text = self.library, guid.encode()
        if self.version == 2:
            call.fmi2Instantiate.restype = _P
            found = call.fmi2Instantiate(b"parity", _I(1), text, None, None, _I(0), _I(0))
        else:
            call.fmi3InstantiateCoSimulation.restype = _P
            no = ctypes.c_bool(False)
            found = call.fmi3InstantiateCoSimulation(
                b"parity", text, None, no, no, no, no, None, _N(0), None, None, None
            )
        if not found:
            raise SysidError("the FMU refuses to be instantiated", expected=f"an instance for the token {guid}")
        return _P(found)

    def initialise(self, one: ctypes.c_void_p) -> None:
        """From a new instance to one that can step."""
        if self.version == 2:
            self.check(self.library.fmi2SetupExperiment(one, _I(0), _D(0), _D(0), _I(0), _D(0)))
            self.check(self.library.fmi2EnterInitializationMode(one))
        else:
            no = ctypes.c_bool(False)
            self.check(self.library.fmi3EnterInitializationMode(one, no, _D(0), _D(0), no, _D(0)))
        self.check(self.ExitInitializationMode(one))

    def stepper(self, one: ctypes.c_void_p, step: float) -> Any:
        """What advances an instance from a time by one step."""
        if self.version == 2:
            return lambda time: self.library.fmi2DoStep(one, _D(time), _D(step), _I(0))
        no, said, last = ctypes.c_bool(False), [ctypes.byref(ctypes.c_bool()) for _ in range(3)], ctypes.byref(_D())
        return lambda time: self.library.fmi3DoStep(one, _D(time), _D(step), no, *said, last)

    def check(self, status: int) -> None:
        """Refuse a call that failed."""
        if status:
            raise SysidError("a function of the FMU failed", expected="status 0", got=status)


def _run_car(calls: _Calls, details: dict[str, Any], inputs: NDArray[Any], state: NDArray[Any] | None) -> Run:
    n_in, n_out = details["n_inputs"], details["n_outputs"]
    one = calls.instantiate(details["guid"])
    try:
        values = np.ascontiguousarray(inputs, dtype=np.float64)
        output, flags = np.empty((len(values), n_out)), np.empty(len(values), dtype=np.int32)
        into, out_of, flag = (
            (ctypes.c_uint * len(numbers))(*numbers)
            for numbers in (range(1, 1 + n_in), range(1 + n_in, 1 + n_in + n_out), [1 + n_in + 2 * n_out])
        )
        sizes = [(_N(size), _N(size)) if calls.version == 3 else (_N(size),) for size in (n_in, n_out, 1)]
        set_numbers, get_numbers, get_flag = calls.SetFloat64, calls.GetFloat64, calls.GetInt32
        if state is None:  # as a simulator does, which hands over what the inputs are at the start
            calls.check(set_numbers(one, into, sizes[0][0], _P(values[0].ctypes.data), *sizes[0][1:]))
        calls.initialise(one)
        if state is not None:
            _put_state(calls, one, state)
        step = calls.stepper(one, details["sample_time_s"])
        # Asked for at each sample, the address of an array took as long as the FMU.
        read, written, flagged = (table.ctypes.data for table in (values, output, flags))
        for i in range(len(values)):
            failed = set_numbers(one, into, sizes[0][0], _P(read + 8 * n_in * i), *sizes[0][1:])
            failed |= step(i * details["sample_time_s"])
            failed |= get_numbers(one, out_of, sizes[1][0], _P(written + 8 * n_out * i), *sizes[1][1:])
            failed |= get_flag(one, flag, sizes[2][0], _P(flagged + 4 * i), *sizes[2][1:])
            calls.check(failed)
        return Run(output=output, state=_state(calls, one)[: None if state is None else len(state)], flags=flags)
    finally:
        calls.FreeInstance(one)


def _bytes(calls: _Calls, one: ctypes.c_void_p) -> NDArray[np.uint8]:
    """The serialised state: the model's number, then the state of the surrogate, then the rest."""
    held, size = _P(), _N()
    calls.check(calls.GetFMUState(one, ctypes.byref(held)))
    calls.check(calls.SerializedFMUStateSize(one, held, ctypes.byref(size)))
    data = np.empty(size.value, dtype=np.uint8)
    calls.check(calls.SerializeFMUState(one, held, _P(data.ctypes.data), size))
    calls.check(calls.FreeFMUState(one, ctypes.byref(held)))
    return data


def _state(calls: _Calls, one: ctypes.c_void_p) -> NDArray[np.float64]:
    return np.frombuffer(_bytes(calls, one)[8:].tobytes(), dtype=np.float64)


def _put_state(calls: _Calls, one: ctypes.c_void_p, state: NDArray[Any]) -> None:
    data = _bytes(calls, one)
    data[8 : 8 + 8 * len(state)] = np.ascontiguousarray(state, dtype=np.float64).view(np.uint8)
    held = _P()
    calls.check(calls.DeserializeFMUState(one, _P(data.ctypes.data), _N(len(data)), ctypes.byref(held)))
    calls.check(calls.SetFMUState(one, held))
    calls.check(calls.FreeFMUState(one, ctypes.byref(held)))
