"""``sysid simulate``: a bundle's model over a file of inputs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sysid.errors import ConfigError
from sysid.export.reading import read_bundle
from sysid.ingest import read_trace, write_trace
from sysid.models import History
from sysid.traces import Channel, Trace
from sysid.units import Reference
from sysid.workbench.commands.run import console


def simulate_command(bundle: Path, inputs: Path, out: Path, *, initial: float | None) -> None:
    """Simulate and write time, inputs and output.

    Args:
        bundle: The bundle's folder.
        inputs: A file with the model's input channels; units are converted to the model's.
        out: The file to write, ``.csv`` or ``.parquet``.
        initial: The output's value before the first sample; ``None`` is the model's value at rest.

    Raises:
        BundleError: If the bundle is damaged or incomplete.
        UserError: If the inputs cannot be read, or the output not written.
    """
    if initial is not None and not np.isfinite(initial):
        raise ConfigError(
            "the output cannot begin there",
            where="option --initial",
            expected="a finite number, in the output's unit",
            got=f"--initial {initial}",
            remedy="give the output's value before the first sample, or leave --initial out",
        )
    read = read_bundle(bundle)
    model = read.model
    described = {entry["name"]: entry for entry in [*read.inputs, *read.outputs]}
    channels = {
        name: Channel(name=name, unit=entry["unit"], reference=Reference(entry.get("reference", "none")))
        for name, entry in described.items()
    }
    wanted = tuple(channels[name] for name in model.mapping.inputs)
    trace = read_trace(inputs, channels=wanted, sample_time=model.sample_time)
    columns = trace.columns(model.mapping.inputs)
    value = model.rest_output if initial is None else initial
    output = model.simulate(columns, History.at_rest(inputs=columns[0], output=value))
    simulated = Trace(
        name=out.stem,
        sample_time=trace.sample_time,
        start_time=trace.start_time,
        channels=(*wanted, channels[model.mapping.output]),
        values=np.column_stack([columns, output]),
        usable=trace.usable,
        provenance=(*trace.provenance, f"{model.mapping.output} simulated in free run by {bundle}"),
    )
    write_trace(simulated, out)
    console().print(f"{len(simulated)} samples of {model.mapping.output} written to {out}", soft_wrap=True)
