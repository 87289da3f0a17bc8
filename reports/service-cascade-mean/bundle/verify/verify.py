"""Run sequence.onnx over the records beside this script. Needs numpy and onnxruntime; from anywhere: python verify.py."""

import csv
import json
import pathlib
import sys

import numpy as np
import onnxruntime

here = pathlib.Path(__file__).resolve().parent
session = onnxruntime.InferenceSession(here.parent / "sequence.onnx", providers=["CPUExecutionProvider"])
about = json.loads((here.parent / "model.json").read_text(encoding="utf-8"))
names = [channel["name"] for channel in about["inputs"]]
faults = 0
for path in sorted(here.glob("record*.csv")):
    with path.open(newline="", encoding="utf-8") as file:
        table = np.array(list(csv.reader(file))[1:], dtype=float)  # time, inputs, output, flags
    n = len(names)
    u, expected, expected_flags = table[:, 1 : 1 + n], table[:, 1 + n : -1], table[:, -1:]
    first = dict(zip(names, u[0]))  # at rest at the first inputs
    rest = {channel: first.get(level, level) for channel, level in about["initialisation"]["levels"].items()}
    state = np.zeros(session.get_inputs()[1].shape[1])
    for line in about["state"]["lines"]:
        begin = line["first"]
        state[begin : begin + line["length"]] = (rest[line["channel"]] - line["offset"]) / line["scale"]
    for space in about["state"].get("state_spaces", []):
        scaled = (np.array([rest[channel] for channel in space["channels"]]) - space["offset"]) / space["scale"]
        levels = np.array(space["constant"]) + np.array(space["at_rest"]) @ scaled
        bound = space.get("bound", np.inf)
        state[space["first"] : space["first"] + space["size"]] = np.clip(levels, -bound, bound)
    if (here / "states.json").is_file():  # equations: where nothing changes has been searched for
        found = json.loads((here / "states.json").read_text(encoding="utf-8"))[path.name]
        state[: len(found)] = found
    feed = {"u": u[:, np.newaxis].astype("float64"), "state": np.array([state], dtype="float64")}
    y, flags = (values[:, 0] for values in session.run(["y", "flags"], feed))
    both_lost = np.isnan(y) & np.isnan(expected)
    off = np.where(both_lost, 0.0, np.abs(y - expected))
    worst = np.max(off)
    good = (off <= np.array([2e-05, 2e-05, 2e-05, 2e-05])).all() and (flags == expected_flags).all()
    faults += not good
    print(f"{path.name}: {'as recorded' if good else 'NOT as recorded'}, largest difference {worst:.1e}")
sys.exit(1 if faults else 0)
