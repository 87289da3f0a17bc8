"""An FMU as a reference, run by fmpy: versions 2.0 and 3.0, co-simulation and model exchange.

Inputs are held from sample to sample, and the outputs of a sample are those at its end: what another importer reads
after ``doStep(t, h)`` with the inputs that it set at ``t``. A surrogate that is exported as an FMU gives its outputs at
the same instants, so that it can be put in the place of its reference.
"""

from __future__ import annotations

import hashlib
import re
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError, UnitError
from sysid.extras import need
from sysid.references.config import Port, ReferenceConfig
from sysid.references.fmu_variables import check_variables, declared_unit, type_of
from sysid.references.kinds import RunError, checked
from sysid.units import convert

VERSION, HEAD = re.compile(rb"""fmiVersion\s*=\s*["']([\w.-]{1,20})["']"""), 65_536
PURPOSE = "running an FMU"


def read_fmu(path: Path) -> Any:
    """The model description of an FMU; its binary is not touched.

    Args:
        path: The file.

    Returns:
        As fmpy has it.

    Raises:
        ConfigError: If it is none, or of version 1.0.
        MissingExtraError: If fmpy is not installed.
    """
    need("fmpy", PURPOSE)
    import fmpy

    try:
        with zipfile.ZipFile(path) as archive, archive.open("modelDescription.xml") as file:
            told = VERSION.search(file.read(HEAD))
        version = told.group(1).decode() if told else "none that is said"
        # fmpy reads the whole of it only where it is of a version that we run.
        description = fmpy.read_model_description(str(path), validate=False) if version[:2] in {"2.", "3."} else None
    except Exception as error:  # noqa: BLE001 - fmpy raises whatever its parser does
        raise ConfigError(
            "this is no FMU that can be read", where=path, expected="an FMU of version 2.0 or 3.0",
            got=f"{type(error).__name__}: {error}",
            remedy="check the path, and that the tool exported it whole; a Python function is named as "
            "file.py:function, a program by its command line (docs/how/slow-models.md)",
        ) from None  # fmt: skip
    if description is None:
        raise ConfigError(
            f"the FMU is of version {version}", where=path, expected="version 2.0 or 3.0", got=version,
            remedy="export it as FMI 2.0 or 3.0; every tool that writes 1.0 and is maintained can",
        )  # fmt: skip
    return description


class FmuReference:
    """An FMU, unpacked once for all runs of a process; each run is an instance of its own.

    Args:
        config: What it is.

    Raises:
        ConfigError: If it cannot be read, or has no interface as it is asked for.
        ChannelError: If it lacks a port.
    """

    def __init__(self, config: ReferenceConfig) -> None:
        self.config, self.path = config, Path(str(config.fmu))
        self.description = read_fmu(self.path)
        self.variables = {one.name: one for one in self.description.modelVariables}
        wanted = [*config.inputs, *config.variables.values(), *config.constants, *config.outputs]
        missing = [name for name in wanted if name not in self.variables]
        if missing:
            raise ChannelError(missing, list(self.variables), where=self.path)
        self.interface = self._interface()
        check_variables(config, self.variables, self.path)
        self.units = {name: self._unit(name, port) for name, port in self._ports.items()}
        self.place = tempfile.TemporaryDirectory(prefix="sysid-fmu-")
        with zipfile.ZipFile(self.path) as archive:
            archive.extractall(self.place.name)

    @property
    def _ports(self) -> dict[str, Port]:
        config = self.config
        return {**config.inputs, **config.parameters, **config.outputs}

    def _unit(self, name: str, port: Port) -> str:
        """The unit that a port's numbers have in the FMU; where one side does not say, that of the other."""
        declared = declared_unit(self.variables[self.config.variables.get(name, name)])
        if declared is None or "1" in {declared, port.unit}:
            return port.unit
        try:
            convert(np.zeros(1), port.unit, declared)
        except UnitError:
            raise ConfigError(
                f"{name} has another unit in the FMU", where=self.path, expected=declared, got=port.unit,
                remedy=f"give it in {declared}, or in a unit that can be converted to it",
            ) from None  # fmt: skip
        return declared

    def _given(self, name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values of an input or a parameter as the FMU takes them."""
        return self._converted(values, self._ports[name].unit, self.units[name])

    def _taken(self, name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values of an output as they are asked for."""
        return self._converted(values, self.units[name], self._ports[name].unit)

    @staticmethod
    def _converted(values: NDArray[np.float64], unit: str, other: str) -> NDArray[np.float64]:
        return values if unit == other else convert(values, unit, other)

    def _interface(self) -> str:
        has = {
            "co-simulation": self.description.coSimulation is not None,
            "model-exchange": self.description.modelExchange is not None,
        }
        first = next((name for name, there in has.items() if there), "co-simulation")
        wish: str = self.config.interface or first
        if not has[wish]:
            raise ConfigError(
                f"the FMU has no interface for {wish}", where=self.path, expected="one that it has",
                got=", ".join(name for name in has if has[name]) or "none",
                remedy="leave interface out, or name the one that it has",
            )  # fmt: skip
        return "CoSimulation" if wish == "co-simulation" else "ModelExchange"

    @property
    def digest(self) -> str:
        """Of the file, and of the interface that is run."""
        return hashlib.sha256(self.path.read_bytes() + self.interface.encode()).hexdigest()

    def run(
        self, inputs: NDArray[np.float64], parameters: Mapping[str, float]
    ) -> tuple[NDArray[np.float64] | None, NDArray[np.float64]]:
        """Run an instance; see :class:`sysid.references.kinds.Loaded`."""
        import fmpy

        h, n, names = self.config.sample_time, len(inputs), list(self.config.outputs)
        ends = h * np.arange(n + 1, dtype=np.float64)
        try:
            found = fmpy.simulate_fmu(
                self.place.name, model_description=self.description, validate=False, fmi_type=self.interface,
                start_time=0.0, stop_time=float(ends[-1]), output_interval=h, input=self._signals(inputs, ends),
                start_values=self._starts(parameters), output=names, remote_platform=None,
            )  # fmt: skip
        except Exception as error:
            raise RunError(f"the FMU failed: {str(error).strip() or type(error).__name__}") from error
        # The first row at an instant is the one before its events, when the next inputs are not yet set.
        rows = np.searchsorted(found["time"], ends - 1e-6 * h)
        if rows[-1] >= len(found):
            raise RunError(f"the FMU ended by itself at {float(found['time'][-1]):g} s")
        outputs = np.column_stack([self._taken(name, found[name][rows].astype(np.float64)) for name in names])
        # Before the first sample something may not be a number yet; nobody needs it then.
        first = outputs[0] if np.isfinite(outputs[0]).all() else None
        return first, checked(outputs[1:], self.config, n)

    def _signals(self, inputs: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[Any] | None:
        """Held inputs as fmpy takes them: two rows at each instant, before and after."""
        names = list(self.config.inputs)
        if not names:
            return None
        signals = np.zeros(2 * len(inputs), dtype=[("time", np.float64), *((name, self._type(name)) for name in names)])
        signals["time"] = np.repeat(ends, 2)[1:-1]
        for name, column in zip(names, inputs.T, strict=True):
            held = np.repeat(self._given(name, column), 2)
            signals[name] = held if self._type(name) in {np.float64, np.float32} else np.round(held)
        return signals

    def _type(self, name: str) -> Any:
        return type_of(self.variables[name])

    def _starts(self, parameters: Mapping[str, float]) -> dict[str, float | int | bool]:
        """Parameters as the variables that they set."""
        variables = self.config.variables
        own = {
            name: float(self._given(name, np.array([x]))[0]) if name in variables else x
            for name, x in parameters.items()
        }
        return {variables.get(name, name): self._start(variables.get(name, name), x) for name, x in own.items()}

    def _start(self, name: str, value: float) -> float | int | bool:
        kind = self._type(name)
        return bool(round(value)) if kind is np.bool_ else round(value) if kind is np.int32 else value
