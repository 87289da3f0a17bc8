"""A bundle on disk: a folder that holds a surrogate and everything its receiver needs to run and to judge it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError
from sysid.export.surrogate import Surrogate
from sysid.ingest.arrays import inputs_of, level_of
from sysid.models import AbstractModel, Cascade
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True)
class BundleFile:
    """An exported file in a bundle.

    Args:
        name: File name.
        format: Name of the exporter, such as ``"onnx"``.
        kind: ``"step"`` or ``"sequence"``.
        dtype: Of the numbers.
        sha256: Of the bytes.
        largest_difference: From the model, over all cases and random sequences, in the output's unit.
        case: The case with the largest difference.
        tolerance: What was allowed.
    """

    name: str
    format: str
    kind: str
    dtype: str
    sha256: str
    largest_difference: float
    case: str
    tolerance: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Bundle:
    """A bundle on disk.

    Args:
        folder: Where it lies.
        model: The model or cascade, built from ``model.json``.
        metadata: Everything that ``model.json`` says.
        files: The exported files.
    """

    folder: Path
    model: AbstractModel | Cascade
    metadata: dict[str, Any]
    files: tuple[BundleFile, ...]

    def __repr__(self) -> str:
        files = ", ".join(file.name for file in self.files) or "no files"
        return f"<Bundle of {self.metadata.get('label', 'a model')} in {self.folder}: {files}>"

    @property
    def inputs(self) -> tuple[dict[str, Any], ...]:
        """What ``model.json`` says of each input: name, unit, reference, range."""
        return tuple(self.metadata["inputs"])

    @property
    def outputs(self) -> tuple[dict[str, Any], ...]:
        """The same of each output; before version 3 there was one."""
        return tuple(self.metadata.get("outputs") or [self.metadata["output"]])

    def simulate(self, u: Any, *, initial: float | Dict[str, float] | None = None, warn: bool = True) -> Any:
        """Free run of the model over inputs that are in memory.

        Args:
            u: Inputs: an array of shape ``(n_samples,)`` or ``(n_samples, n_inputs)`` in the bundle's order, a frame or
                dict with columns by name, in the bundle's units, or a trace; for a model without input the number of
                samples.
            initial: Output before the first sample, in its unit, or one for each output by name; the declared levels
                where nothing is said.
            warn: Whether inputs beyond their declared ranges are told, by an :class:`OutsideRangeWarning`.

        Returns:
            For a pandas frame a frame of the outputs with the same index; else an array of shape ``(n_samples,)``, or
            ``(n_samples, n_outputs)`` where there are several.

        Raises:
            ChannelError: If an input is missing, or ``initial`` names no output.
            ConfigError: If an array has another number of columns, its samples are at another distance, a trace is in
                other units, or ``initial`` is no finite number or says nothing to the model.
        """
        names = tuple(str(entry["name"]) for entry in self.outputs)
        surrogate = Surrogate.of(self.model, {}, outputs=names)
        if surrogate.ticks:
            inputs = np.zeros((len(inputs_of(u, ())), 1))
        else:
            units = {str(entry["name"]): str(entry["unit"]) for entry in self.inputs}
            inputs = inputs_of(u, tuple(units), sample_time=self.model.sample_time, units=units)
            told = self._outside(inputs) if warn else ""
            if told:
                warnings.warn(told, OutsideRangeWarning, stacklevel=2)
        given = dict(initial) if isinstance(initial, Dict) else {} if initial is None else dict.fromkeys(names, initial)
        strangers = [name for name in given if name not in names]
        if strangers:
            raise ChannelError(strangers, names, where="initial")
        found = surrogate.chosen(surrogate.run_from(inputs, {name: level_of(level) for name, level in given.items()}))
        if hasattr(u, "columns") and hasattr(u, "index") and not isinstance(u, Trace):
            return type(u)(found, index=u.index, columns=list(names))
        return found[:, 0] if len(names) == 1 else found

    def _outside(self, inputs: NDArray[np.float64]) -> str:
        """A sentence on the inputs that are beyond their declared ranges; empty where none is."""
        told = []
        for column, entry in zip(inputs.T, self.inputs, strict=True):
            low, high = entry.get("range") or (-np.inf, np.inf)
            share = float(np.mean((column < low) | (column > high)))
            if share:
                unit = "" if entry["unit"] == "1" else f" {entry['unit']}"
                told.append(
                    f"{entry['name']} is beyond {low:g} to {high:g}{unit} in {100.0 * share:.3g} % of the samples"
                )
        return f"{'; '.join(told)}: nothing there was fitted, and the accuracy is unknown" if told else ""


class OutsideRangeWarning(UserWarning):
    """Inputs that are beyond what a bundle was made from, so that nobody knows how accurate its answer is."""


def bundle_files(manifest: Dict[str, Any]) -> tuple[BundleFile, ...]:
    """The exported files that a manifest lists.

    Args:
        manifest: Content of ``model.json``.

    Returns:
        One entry per file.
    """
    return tuple(
        BundleFile(
            name=entry["name"],
            format=entry["format"],
            kind=entry["kind"],
            dtype=entry["dtype"],
            sha256=entry["sha256"],
            largest_difference=max(
                entry["parity"]["largest_difference"], entry["parity"].get("random_difference", 0.0)
            ),
            case=entry["parity"]["case"],
            tolerance=entry["parity"]["tolerance"],
        )
        for entry in manifest["files"]
    )
