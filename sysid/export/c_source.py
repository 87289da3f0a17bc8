"""A surrogate as C99 text: one header, one source, nothing but libm."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from typing import Any

import numpy as np

import sysid
from sysid.export.flags import MEANING
from sysid.export.surrogate import Stage, Surrogate
from sysid.export.templating import render


def c_files(surrogate: Surrogate) -> dict[str, str]:
    """The header and the source.

    Args:
        surrogate: What to write.

    Returns:
        Text by file name.
    """
    stages = [_stage(stage) for stage in surrogate.stages]
    values = {
        "s": surrogate,
        "p": surrogate.identifier,
        "P": surrogate.identifier.upper(),
        "version": sysid.__version__,
        "meaning": MEANING,
        "stages": stages,
        "any_neurons": any(stage["neurons"] for stage in stages),
        "rest_lines": _rest_lines(surrogate),
    }
    return {f"{surrogate.identifier}.{end}": render(f"surrogate.{end}.j2", **values) for end in ("h", "c")}


def _stage(stage: Stage) -> dict[str, Any]:
    """The numbers and expressions of one stage."""
    layout, recursion = stage.layout, stage.recursion
    lags, scaling, n_inputs = recursion.lags, recursion.scaling, len(layout.inputs)
    columns = layout.regressor_columns(lags)
    used = [bool(line.length) or 0 in per for line, per in zip(layout.inputs, lags.inputs, strict=True)]
    newest = [f"u{i}" for i in range(n_inputs)] + ["y"]
    return {
        "title": f"{stage.model.mapping}, {stage.model.structure.label}",
        "first": stage.first,
        "n": lags.n_regressors,
        "neurons": recursion.neurons,
        "weights": recursion.hidden_weights.T,
        "bias": recursion.hidden_bias,
        "readout": recursion.readout,
        "linear": recursion.linear,
        "constant": recursion.constant,
        "low": recursion.low if np.isfinite(recursion.low) else None,
        "high": recursion.high if np.isfinite(recursion.high) else None,
        "scaled": [
            {
                "number": i,
                "source": stage.sources[i],
                "name": line.channel,
                "unit": line.unit,
                "offset": line.offset,
                "scale": line.scale,
            }
            for i, line in enumerate(layout.inputs)
            if used[i]
        ],
        "regressors": [f"u{column}" if column < n_inputs else f"past[{column - n_inputs}]" for column in columns],
        "lines": [
            {"first": line.first, "length": line.length, "newest": newest[i]}
            for i, line in enumerate(layout.lines)
            if line.length
        ],
        "output": layout.output.channel,
        "output_unit": layout.output.unit,
        "output_offset": scaling.output_offset,
        "output_scale": scaling.output_scale,
    }


def _rest_lines(surrogate: Surrogate) -> list[Dict[str, Any]]:
    """Every delay line with the place of its channel in ``[inputs | outputs]``."""
    names = [port.name for port in (*surrogate.inputs, *surrogate.outputs)]
    return [{**line.to_dict(), "source": names.index(line.channel)} for line in surrogate.lines if line.length]
