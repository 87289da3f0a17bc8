"""Remedies lead on: each is followed to the letter, and what was refused is then done.

A row breaks a data set, a structure or a call that is right but for one thing. The error's remedy holds the words of
each cure, and with any of the cures applied the same request is answered.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import sysid
from sysid.errors import SysidError, UserError
from sysid.ingest import load_dataset
from sysid.models import Mapping as ModelMapping
from sysid.models import Start

ROWS = 40


def table(**cells: str) -> str:
    """Forty rows of time, input and output; ``r7`` replaces the seventh."""
    lines = [f"{0.1 * i:.1f},{1 + i % 3},{np.sin(i):.6f}" for i in range(ROWS)]
    for name, text in cells.items():
        lines[int(name[1:]) - 1] = text
    return "\n".join(["t [s],u [V],y [m]", *lines]) + "\n"


def description(**changes: Any) -> dict[str, Any]:
    """A data set of one file that is right, with changes."""
    return {
        "name": "rig",
        "sample_time": 0.1,
        "channels": [{"name": "u", "unit": "V"}, {"name": "y", "unit": "m"}],
        "source": {"files": {}},
        "cases": {"EST": {"role": "estimation", "file": "a.csv"}},
        **changes,
    }


@dataclass(frozen=True, kw_only=True)
class Data:
    """A data set that is refused.

    Args:
        text: Of its file.
        changes: Of its description.
        cures: What the remedy says, and what that changes in the description, part by part.
        file: The cure that is made in the file itself, in place of another text.
    """

    text: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    cures: Mapping[str, Mapping[str, Any]]
    file: tuple[str, str] = ("", "")


def source(**parts: Any) -> dict[str, Any]:
    return {"source": {"files": {}, **parts}}


MISSING = table(r7="0.6,,0.1")
UNEVEN = table(**{f"r{i}": f"{0.1 * i - 0.1 + 0.03 * (i % 2):.2f},{1 + i % 3},{i}" for i in range(2, ROWS)})
GAP = "\n".join(line for i, line in enumerate(table().splitlines()) if not 10 <= i <= 13) + "\n"
TWICE = "\n".join([*table().splitlines()[:8], table().splitlines()[7], *table().splitlines()[8:]]) + "\n"
BACK = "\n".join([*table().splitlines()[:8], *table().splitlines()[4:5], *table().splitlines()[8:]]) + "\n"
COUNTED = table().replace("t [s]", "n [1]")
DATA = {
    "a missing value": Data(
        text=MISSING,
        cures={f"{{nan: {how}}}": source(repairs={"nan": how}) for how in ("interpolate", "hold", "mask")},
    ),
    "a missing value at the end": Data(
        text=table(r40="3.9,,0.1"),
        changes=source(repairs={"nan": "interpolate"}),
        cures={"{nan: mask}": source(repairs={"nan": "mask"})},
    ),
    "a constant channel": Data(
        text="\n".join(
            line if i == 0 else ",".join([line.split(",")[0], "2", line.split(",")[2]])
            for i, line in enumerate(table().splitlines())
        ),
        cures={"{constant: accept}": source(repairs={"constant": "accept"})},
    ),
    "a time stamp twice": Data(
        text=TWICE,
        cures={f"{{duplicates: {how}}}": source(repairs={"duplicates": how}) for how in ("drop", "average")},
    ),
    "a time stamp that is empty": Data(
        text=table(r7=",1,0.1"),
        cures={"{stamps: drop}": source(repairs={"stamps": "drop", "gaps": "linear"})},
    ),
    "samples are missing": Data(
        text=GAP,
        cures={f"{{gaps: {how}}}": source(repairs={"gaps": how}) for how in ("linear", "hold", "mask")},
    ),
    "uneven stamps": Data(
        text=UNEVEN,
        cures={
            "{method: linear}": source(repairs={"jitter": "resample"}, grid={"method": "linear"}),
            "{method: hold}": source(repairs={"jitter": "resample"}, grid={"method": "hold"}),
            "grid: {tolerance: ...}": source(grid={"tolerance": 0.4}),
        },
    ),
    "uneven stamps, and no method": Data(
        text=UNEVEN,
        changes=source(repairs={"jitter": "resample"}),
        cures={"grid: {method: linear}": source(repairs={"jitter": "resample"}, grid={"method": "linear"})},
    ),
    "another sample time": Data(
        text=table(),
        changes={"sample_time": 0.2},
        cures={
            "sample_time: 0.1": {"sample_time": 0.1},
            "grid: {method: average}": {"sample_time": 0.2, **source(grid={"method": "average"})},
            "{method: linear}": {"sample_time": 0.2, **source(grid={"method": "linear"})},
            "{method: hold}": {"sample_time": 0.2, **source(grid={"method": "hold"})},
        },
    ),
    "a record that is short": Data(
        text="\n".join(table().splitlines()[:7]) + "\n",
        cures={"grid: {fewest_samples: ...}": source(grid={"fewest_samples": 6})},
    ),
    "no unit of time": Data(
        text=table().replace("t [s]", "t"),
        cures={"files: {time: 't [s]'}": source(files={"time": "t [s]"})},
    ),
    "no column of time": Data(
        text=COUNTED,
        cures={
            "files: {time: {step: 0.1}}": source(files={"time": {"step": 0.1}}),
            "files: {time: 't [ms]'}": {"sample_time": 0.0001, **source(files={"time": "n [ms]"})},
        },
    ),
    "a unit is missing": Data(
        text=table().replace("u [V]", "u"),
        cures={"files: {units: {u: V}}": source(files={"units": {"u": "V"}})},
    ),
    "a unit is missing, in the header": Data(
        text=table().replace("u [V]", "u"), cures={"'u [V]'": {}}, file=("t [s],u,", "t [s],u [V],")
    ),
    "an option that is nearly one": Data(
        text=MISSING,
        changes=source(repair={"nan": "hold"}),
        cures={"repairs": source(repairs={"nan": "hold"})},
    ),
    "a role that is nearly one": Data(
        text=table(),
        changes={"cases": {"EST": {"role": "estimate", "file": "a.csv"}}},
        cures={"estimation": {"cases": {"EST": {"role": "estimation", "file": "a.csv"}}}},
    ),
    "a file that is nearly there": Data(
        text=table(),
        changes={"cases": {"EST": {"role": "estimation", "file": "aa.csv"}}},
        cures={"a.csv": {"cases": {"EST": {"role": "estimation", "file": "a.csv"}}}},
    ),
    "a channel that is nearly there": Data(
        text=table().replace("u [V]", "uu [V]"),
        cures={"uu": {"channels": [{"name": "uu", "unit": "V"}, {"name": "y", "unit": "m"}]}},
    ),
    "a word among the numbers": Data(
        text=table(**{f"r{i}": f"{0.1 * i - 0.1:.1f},{'OFF' if i % 2 else 'ON'},{i}" for i in range(1, ROWS + 1)}),
        cures={"states: {": source(files={"states": {"OFF": 0, "ON": 1}})},
    ),
}


@pytest.mark.parametrize(("row", "words"), [(row, words) for row, one in DATA.items() for words in one.cures])
def test_a_data_set_that_is_cured_as_its_error_says_loads(tmp_path: Path, row: str, words: str) -> None:
    data = DATA[row]
    place = tmp_path / "dataset.yaml"
    (tmp_path / "a.csv").write_text(data.text)
    place.write_text(yaml.safe_dump(description(**data.changes)))
    with pytest.raises(UserError) as refused:
        load_dataset(place)
    assert words in str(refused.value.remedy)
    place.write_text(yaml.safe_dump(description(**{**data.changes, **data.cures[words]})))
    (tmp_path / "a.csv").write_text(data.text.replace(*data.file) if data.file[0] else data.text)
    assert len(load_dataset(place)["EST"]) > 1


@dataclass(frozen=True, kw_only=True)
class Call:
    """A call that is refused.

    Args:
        bad: Raises.
        words: What its remedy says.
        cured: The same as the remedy says.
    """

    bad: Callable[[], object]
    words: str
    cured: Callable[[], object]


def traces(n: int = 60) -> Any:
    """A plant of one pole that is at rest when its record begins."""
    rng = np.random.default_rng(0)
    u, y = np.repeat(rng.normal(size=n // 5 + 1), 5)[:n], np.zeros(n)
    for k in range(1, n):
        y[k] = 0.8 * y[k - 1] + 0.2 * u[k - 1]
    return sysid.data({"u": u, "y": y}, inputs=["u"], outputs=["y"], sample_time=0.1)


ARX1, TF1 = sysid.ARX(na=1, nb=(1,), nk=(1,)), sysid.TransferFunction(poles=(1,), zeros=(0,), delays=(1,))


def fitted(structure: Any = ARX1, mapping: str = "u -> y", **given: Any) -> Any:
    return sysid.fit(traces(), mapping, structure, **given)


CALLS = {
    "a transfer function does not predict": Call(
        bad=lambda: fitted(TF1).model.predict(np.zeros((5, 1)), np.zeros(5)),
        words="use simulate",
        cured=lambda: fitted(TF1).model.simulate(np.zeros((5, 1))),
    ),
    "an initial output that says nothing": Call(
        bad=lambda: fitted(TF1).simulate(np.ones(5), initial=3.0),
        words="give measured samples of the output",
        cured=lambda: fitted(TF1).simulate(np.ones(5), initial=(np.ones(9), np.full(9, 3.0))),
    ),
    "an initial output that says nothing, left out": Call(
        bad=lambda: fitted(TF1).simulate(np.ones(5), initial=3.0),
        words="leave it out",
        cured=lambda: fitted(TF1).simulate(np.ones(5)),
    ),
    "a start that is none": Call(
        bad=lambda: Start(kind="measured"),
        words="start: {measured: 50}",
        cured=lambda: Start(kind="measured", n_measured=50),
    ),
    "orders for too many inputs": Call(
        bad=lambda: fitted(sysid.ARX(na=1, nb=(1, 1), nk=(1, 1))),
        words="give one nb for each input",
        cured=fitted,
    ),
    "training where there is nothing to choose": Call(
        bad=lambda: fitted(ARX1, training=sysid.Training()), words="leave training out", cured=fitted
    ),
    "another kind of training": Call(
        bad=lambda: fitted(TF1, training=sysid.Training()), words="leave training out", cured=lambda: fitted(TF1)
    ),
    "a mapping of nearly a channel": Call(
        bad=lambda: fitted(mapping="uu -> y"), words="did you mean u?", cured=lambda: fitted(mapping="u -> y")
    ),
    "a mapping without an arrow": Call(
        bad=lambda: ModelMapping.parse("u, y"), words="write ->", cured=lambda: ModelMapping.parse("u -> y")
    ),
    "orders that are none": Call(
        bad=lambda: sysid.TransferFunction(poles=(1,), zeros=(2,)),
        words="poles: [2, 2], zeros: [1, 1], delays: [1, 1]",
        cured=lambda: sysid.TransferFunction(poles=[2, 2], zeros=[1, 1], delays=[1, 1]),
    ),
    "orders of an ARX model that are none": Call(
        bad=lambda: sysid.ARX(na=1, nb=(1,), nk=(1, 1)),
        words="na: 2, nb: [2, 2], nk: [1, 1]",
        cured=lambda: sysid.ARX(na=2, nb=[2, 2], nk=[1, 1]),
    ),
    "no sample time": Call(
        bad=lambda: sysid.data({"u": np.ones(5), "y": np.arange(5.0)}, inputs=["u"], outputs=["y"]),
        words="sample_time=0.1",
        cured=lambda: sysid.data({"u": np.ones(5), "y": np.arange(5.0)}, inputs=["u"], outputs=["y"], sample_time=0.1),
    ),
    "a trace that is no case": Call(
        bad=lambda: traces()["nothing"], words="name", cured=lambda: traces()[traces().traces[0].name]
    ),
}


@pytest.mark.parametrize("row", CALLS)
def test_a_call_that_is_cured_as_its_error_says_is_answered(row: str) -> None:
    call = CALLS[row]
    with pytest.raises(SysidError) as refused:
        call.bad()
    assert call.words in str(refused.value.remedy)
    call.cured()
