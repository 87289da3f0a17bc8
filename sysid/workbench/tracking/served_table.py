"""A bundle's ``sequence.onnx`` for whoever loads it by MLflow: a table of inputs in, a table of outputs out.

This file is copied beside the model when it is logged, and runs from there. It therefore imports nothing of the
workbench; nothing is unpickled. A table has a row a sample, and a column ``name [unit]`` a channel.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas as pd

SEQUENCE_FILE, MANIFEST = "sequence.onnx", "model.json"
"""What is run, and what says how it is begun."""
NEAR = 0.1
"""Share of the sample time by which a stamp may be beside the grid: stamps are rounded."""
STATE = "state"
"""The parameter that goes on where a run ended, and what of a table's ``attrs`` holds it."""


def label(channel: dict[str, Any]) -> str:
    """A channel's column: its name with its unit, as the workbench heads columns of files.

    Args:
        channel: As ``model.json`` describes it.

    Returns:
        For example ``BP [psi gauge]``.
    """
    known = [channel["unit"], channel["reference"] if channel["reference"] != "none" else ""]
    unit = " ".join(filter(None, known))
    return f"{channel['name']} [{unit}]" if unit else str(channel["name"])


def flags_column(outputs: list[str]) -> str:
    """The column of flags, whatever the outputs are called.

    Args:
        outputs: Their columns.

    Returns:
        ``flags``, with an underscore where an output is called so.
    """
    return "flags_" if "flags" in outputs else "flags"


def rests(about: dict[str, Any]) -> dict[str, tuple[str, float]]:
    """The parameters that say where outputs stood before the first row.

    Args:
        about: Content of ``model.json``.

    Returns:
        By the parameter's name the output and its declared level; none of an output that stands where an input does,
        nor of one whose level no state heeds.
    """
    levels, heeded = about["initialisation"]["levels"], _heeded(about)
    names = [channel["name"] for channel in about["outputs"] if channel["name"] in heeded]
    return {f"{name}_at_rest": (name, levels[name]) for name in names if not isinstance(levels[name], str)}


def _heeded(about: dict[str, Any]) -> set[str]:
    """The channels whose level at rest a state follows; equations begin where they are declared or found."""
    found = {line["channel"] for line in about["state"]["lines"]}
    for space in about["state"].get("state_spaces", []):
        found |= {name for i, name in enumerate(space["channels"]) if np.any(np.array(space["at_rest"])[:, i])}
    return found.union(*(_walk(about, name) for name in found))


def _walk(about: dict[str, Any], name: str, ends: Iterable[str] = ()) -> list[str]:
    """A channel, the one where it is declared to begin, as a committee's members are, and so on to one of the ends."""
    declared, walk = about["model"].get("rest") or {}, [name]
    while walk[-1] not in ends and isinstance(level := declared.get(walk[-1]), str) and level not in walk:
        walk.append(level)
    return walk


class Table:
    """A surrogate that takes and gives tables.

    Args:
        folder: Holds ``sequence.onnx`` and ``model.json``.
    """

    def __init__(self, folder: Path) -> None:
        import onnxruntime

        options = onnxruntime.SessionOptions()
        # Steps are so small that more threads make them slower.
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        graph = folder / SEQUENCE_FILE
        self.session = onnxruntime.InferenceSession(graph, options, providers=["CPUExecutionProvider"])
        self.about = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))

    def predict(self, model_input: pd.DataFrame, params: dict[str, Any] | None = None) -> pd.DataFrame:
        """Run the surrogate over a table.

        Args:
            model_input: A row a sample, a column an input. An index that is time (stamps, durations, or numbers with a
                fraction, in seconds) has to go on by the sample time.
            params: ``state``, the numbers that a run ended with, to go on from there; ``<output>_at_rest``, where an
                output stood before the first row. By default all is at rest.

        Returns:
            A column an output and one of flags, with the index that came. ``attrs`` holds the state after the last
            row, the units and the sample time.

        Raises:
            ValueError: If a column lacks, the index is of another sample time, or a parameter is unknown or cannot be
                taken.
        """
        import pandas as pd

        labels = [label(channel) for channel in self.about["inputs"]]
        missing = [name for name in labels if name not in model_input.columns]
        if missing:
            raise ValueError(f"expected the columns {', '.join(labels)}; {', '.join(missing)} lacks")
        self._check_time(model_input.index)
        inputs = model_input[labels].to_numpy(dtype=np.float64)
        state = self._beginning(inputs, params or {})
        feed = {"u": inputs[:, np.newaxis], "state": state[np.newaxis]}
        output, after, flags = self.session.run(["y", "state_out", "flags"], feed)
        names = [label(channel) for channel in self.about["outputs"]]
        table = pd.DataFrame(output[:, 0], index=model_input.index, columns=names)
        table[flags_column(names)] = flags[:, 0]
        table.attrs = {
            STATE: after[0].tolist(),
            "units": {name: channel["unit"] for name, channel in zip(names, self.about["outputs"], strict=True)},
            "sample_time_s": self.about["sample_time_s"],
        }
        return table

    def _check_time(self, index: pd.Index) -> None:
        """Refuse a table that says by its index that it has another sample time."""
        import pandas as pd

        if isinstance(index, pd.DatetimeIndex):
            seconds = (index - index.min()).total_seconds().to_numpy()
        elif isinstance(index, pd.TimedeltaIndex):
            seconds = index.total_seconds().to_numpy()
        elif pd.api.types.is_float_dtype(index.dtype):
            seconds = index.to_numpy()
        else:
            return
        step = self.about["sample_time_s"]
        beside = np.abs(seconds - seconds[:1] - step * np.arange(len(seconds))) > NEAR * step
        # What is not a number is beside any grid.
        if (beside | np.isnan(seconds)).any():
            at = int(np.argmax(beside | np.isnan(seconds)))
            raise ValueError(
                f"the index is time, and its row {at} is not a whole number of samples from the first: expected a row "
                f"every {step:g} s, got {seconds[at] - seconds[0]:g} s. Bring the table to the sample time, or take "
                "the index off (reset_index(drop=True)) if it is no time in seconds."
            )

    def _beginning(self, inputs: NDArray[np.float64], params: dict[str, Any]) -> NDArray[np.float64]:
        """The state before the first row, as it was given, or at rest."""
        given = np.asarray(params.get(STATE, []), dtype=np.float64)
        size, known = self.about["state"]["size"], rests(self.about)
        if strangers := set(params) - {STATE, *known}:
            took = ", ".join([STATE, *known])
            raise ValueError(f"{', '.join(sorted(strangers))}: this surrogate has no such parameter; expected {took}")
        moved = {}
        for parameter, (name, declared) in known.items():
            value = float(params.get(parameter, declared))
            if not np.isfinite(value):
                raise ValueError(f"{parameter}: expected a finite number, got {value}")
            if value != declared:
                moved[name] = value
        if len(given):
            if given.shape != (size,) or moved:
                what = f"{size} numbers and no level at rest beside it"
                came = f"{given.size} numbers{''.join(f', {name} = {value:g}' for name, value in moved.items())}"
                raise ValueError(f"{STATE}: expected {what}, as attrs['{STATE}'] of an earlier table; got {came}")
            return given
        return self._at_rest(inputs, moved) if len(inputs) else np.zeros(size)

    def _at_rest(self, inputs: NDArray[np.float64], moved: dict[str, float]) -> NDArray[np.float64]:
        """All at its declared level, but for outputs that stand elsewhere."""
        about, start = self.about, self.about["initialisation"]
        first = {
            channel["name"]: value for channel, value in zip(about["inputs"], inputs[0] + 0.0 * inputs[0], strict=True)
        }
        rest = {name: first.get(level, level) for name, level in start["levels"].items()} | self._followed(moved)
        state = np.zeros(about["state"]["size"])
        for line in about["state"]["lines"]:
            begin = line["first"]
            state[begin : begin + line["length"]] = (rest[line["channel"]] - line["offset"]) / line["scale"]
        for space in about["state"].get("state_spaces", []):
            scaled = (np.array([rest[name] for name in space["channels"]]) - space["offset"]) / space["scale"]
            levels = np.array(space["constant"]) + np.array(space["at_rest"]) @ scaled
            bound = space.get("bound", np.inf)
            state[space["first"] : space["first"] + space["size"]] = np.clip(levels, -bound, bound)
        for equations in about["state"].get("equations", []):
            at = slice(equations["first"], equations["first"] + equations["size"])
            if None not in equations["declared"]:
                state[at] = equations["declared"]
            elif all(value == start["values"][name] for name, value in first.items()):
                state[at] = start["state"][at]
            else:
                raise ValueError(
                    f"where {', '.join(equations['names'])} are at rest at these inputs has to be searched for, which "
                    f"is not done here: give {STATE}, as it stands in model.json under initialisation.state"
                )
        return state

    def _followed(self, moved: dict[str, float]) -> dict[str, float]:
        """The same with what is declared to begin where one of them does, as the members of a committee."""
        ends = {name: _walk(self.about, name, moved)[-1] for name in self.about["model"].get("rest") or {}}
        return moved | {name: moved[end] for name, end in ends.items() if end in moved}


def _load_pyfunc(path: str) -> Table:
    """What MLflow calls to load the model."""
    return Table(Path(path))
