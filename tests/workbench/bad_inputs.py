"""The catalogue of bad inputs: what a user may hand in, and what each must be told.

Each row is a command, the files that it finds, and fragments that its message must hold: what is wrong, where
(file, line, channel, sample), what was expected, what came, what to do. ``test_bad_inputs.py`` runs the rows,
``test_bad_stores.py`` adds what can happen to files that a run has written, to disks and to processes.
"""

# ruff: noqa: E501 - a row a line reads as a table
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

HEADER = "t [s],inlet [kPa gauge],valve [V],outlet [kPa gauge]"


@dataclass(frozen=True, kw_only=True)
class Bad:
    """A bad input.

    Args:
        id: What is bad about it.
        command: The words after ``sysid``.
        says: Fragments of the message.
        files: Files to write into the workspace first, by path.
        edits: Files of the workspace to change first: old text and new, by path.
        code: The exit code: 2 where the input has to change.
        tracked: Whether the workspace has a tracking store.
    """

    id: str
    command: str
    says: tuple[str, ...]
    files: Mapping[str, str | bytes] = field(default_factory=dict)
    edits: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    code: int = 2
    tracked: bool = False


def rows(**cells: str) -> str:
    """Forty good rows of the rig's CSV; ``r7`` replaces the seventh, which stands on line 8."""
    lines = [f"{0.05 * n:.2f},{300 + n % 7},{1 + n % 3},{100 + n % 5}" for n in range(40)]
    for name, text in cells.items():
        lines[int(name[1:]) - 1] = text
    return "\n".join([HEADER, *lines]) + "\n"


def record(text: str | bytes, *says: str, id: str) -> Bad:  # noqa: A002 - the word pytest uses
    """A data set's first record is replaced."""
    return Bad(id=id, command="ingest rig", files={"datasets/rig/run-1.csv": text}, says=says)


RECORDS = [
    record("", "run-1.csv", "no samples", "remedy", id="an empty file"),
    record(HEADER + "\n", "run-1.csv", "no row of numbers", "remedy", id="a header alone"),
    record(bytes(range(256)) * 8, "run-1.csv", "remedy", id="bytes that are no text"),
    record(rows(r7="0.30,301,1,abc"), "run-1.csv", "line 8", "outlet", "abc", id="a word among the numbers"),
    record(rows(r7="0.30,301,1"), "run-1.csv", "line 8", "4", "3", "ragged: drop", id="a row with a cell too few"),
    record(rows(r7="0.30,301,1,104,9"), "run-1.csv", "line 8", "5", "ragged: drop", id="a row with a cell too many"),
    record(rows(r7="0.30,301,1,nan"), "run-1.csv", "line 8", "outlet", "nan: interpolate", id="a missing value"),
    record(rows(r7="0.30,inf,1,101"), "run-1.csv", "line 8", "inlet", "nan: interpolate", id="an infinite value"),
    record(rows(r7=",301,1,101"), "run-1.csv", "line 8", "stamps: drop", id="a row without a time stamp"),
    record(rows(r7="0.25,301,1,101"), "run-1.csv", "line 8", "duplicates: drop", id="a time stamp that stands twice"),
    record(rows(r7="0.10,301,1,101"), "run-1.csv", "line 8", "backward: sort", id="time that runs backwards"),
    record(rows(r40="9.00,301,1,101"), "run-1.csv", "line", "gaps: linear", id="a gap"),
    record(rows(r7="0.32,301,1,101"), "run-1.csv", "line", "jitter: resample", id="uneven time stamps"),
    record("\n".join(rows().splitlines()[:6]), "run-1.csv", "too few samples", "10", "5", id="too few samples"),
    record(rows().replace("outlet", "outlt"), "run-1.csv", "missing channel outlet", "did you mean outlt?", id="a misspelt column"),
    record(rows().replace("[V]", "[volz]"), "run-1.csv", "valve", "volz", "remedy", id="a unit that is not known"),
    record(rows().replace("[V]", "[kPa]"), "run-1.csv", "valve", "kPa", "V", id="a unit of another quantity"),
    record(rows().replace(" [V]", ""), "run-1.csv", "valve", "no unit", "units:", id="a column without a unit"),
    record(rows().replace("t [s]", "n"), "run-1.csv", "no time column", "step", id="no time column"),
    record(rows().replace("t [s]", "t"), "run-1.csv", "time column has no unit", "[s]", id="time without a unit"),
    record(rows().replace("[s]", "[kPa]"), "run-1.csv", "column t", "kPa", "remedy", id="time in kilopascal"),
    record(rows().replace("valve", "inlet"), "run-1.csv", "inlet", "remedy", id="two columns of one name"),
    record(rows().replace("[s]", "[min]"), "run-1.csv", "0.05 s", "3 s", "unit of time", id="another sample time"),
    record(
        "\n".join([HEADER, *(f"{0.05 * n:.2f},300,{1 + n % 3},{n}" for n in range(40))]),
        "run-1.csv", "inlet", "never changes", "constant: accept", id="a channel that never changes",
    ),
]  # fmt: skip

FILES = [
    Bad(id="a folder", command="ingest datasets/rig --propose datasets/new.yaml", says=("datasets/rig", "a folder is no record", "name one of its files")),
    Bad(id="a file that is not there", command="ingest no.csv", says=("no.csv", "there is no such file", "check the path")),
    Bad(id="a folder instead of a file", command="ingest datasets", says=("datasets", "a folder", "remedy")),
    Bad(id="an ending without a reader", command="ingest a.docx", files={"a.docx": "x"}, says=("a.docx", ".csv", "remedy")),
    Bad(id="no ending at all", command="ingest record", files={"record": "x"}, says=("record", ".csv", "remedy")),
    Bad(id="text named .parquet", command="ingest a.parquet", files={"a.parquet": "x"}, says=("a.parquet", "Parquet", "remedy")),
    Bad(id="text named .mat", command="ingest a.mat", files={"a.mat": "x" * 200}, says=("a.mat", "MATLAB", "remedy")),
    Bad(id="text named .h5", command="ingest a.h5", files={"a.h5": "x" * 200}, says=("a.h5", "HDF5", "remedy")),
    Bad(id="text named .mf4", command="ingest a.mf4", files={"a.mf4": "x" * 200}, says=("a.mf4", "MDF", "remedy")),
    Bad(id="text named .tdms", command="ingest a.tdms", files={"a.tdms": "x" * 200}, says=("a.tdms", "TDMS", "remedy")),
    Bad(id="a file without a column of numbers", command="ingest a.csv", files={"a.csv": "t [s],b\n0,x\n1,y\n"}, says=("a.csv", "b", "remedy")),
    Bad(id="a proposal over a file", command="ingest datasets/rig/run-1.csv --propose datasets/rig/run-2.csv", says=("run-2.csv", "nothing was changed")),
    Bad(id="a proposal for a data set", command="ingest rig --propose a.yaml", says=("rig", "leave --propose out")),
    Bad(id="a proposal into a file's inside", command="ingest datasets/rig/run-1.csv --propose datasets/rig/run-2.csv/a.yaml", says=("run-2.csv", "a file lies where a folder is needed", "remedy")),
]  # fmt: skip


def dataset(old: str, new: str, *says: str, id: str) -> Bad:  # noqa: A002 - the word pytest uses
    """The data set's description is changed."""
    return Bad(id=id, command="ingest rig", edits={"datasets/rig/dataset.yaml": (old, new)}, says=says)


DATASETS = [
    dataset("sample_time", "sampletime", "dataset.yaml, line 2", "unknown field 'sampletime'", "did you mean sample_time?", id="a misspelt field"),
    dataset("sample_time: 0.05\n", "", "'sample_time' is missing", "add sample_time", id="a missing field"),
    dataset("0.05", "-0.05", "line 2, field sample_time", "-0.05", "greater than 0", id="a negative sample time"),
    dataset("0.05", "fast", "field sample_time", "fast", "number", id="a word for the sample time"),
    dataset("name: valve", "name: inlet", "two channels are named inlet", "rename", id="two channels of one name"),
    dataset("unit: V", "unit: volz", "line 5, field channels[1]", "volz", "remedy", id="an unknown unit of a channel"),
    dataset(", reference: gauge}\n  - {name: valve", "}\n  - {name: valve", "channels[0]", "gauge or", id="a pressure without reference"),
    dataset("role: selection", "role: choosing", "cases.run-2.role", "estimation", "choosing", id="an unknown role"),
    dataset("file: run-2.csv", "file: run-9.csv", "run-9.csv", "there is no such file", "reading case run-2 of", "dataset.yaml", id="a case whose file is not there"),
    dataset("file: run-2.csv", "file: run-2.csv, start: 900", "run-2.csv", "start 900", "19.95 s", "reading case run-2", id="a start after the end"),
    dataset("file: run-2.csv", "recipe: {}", "case run-2 does not fit the source", "file", id="a recipe without a generator"),
    dataset("{files: {references: gauge}}", "{}", "field source", "files: {}", id="neither files nor a generator"),
    dataset("{files: {references: gauge}}", "{generator: warp, options: {}}", "case run-1", "file", id="files of a generator"),
    dataset("references: gauge", "separator: '!'", "source.files.separator", "!", id="a separator that is not known"),
    dataset("references: gauge", "units: {vlave: V}", "vlave", "one of inlet, outlet, valve", id="a unit for no channel"),
    dataset("  - {name: valve", "\t- {name: valve", "line 5", "a tab", "indent by spaces", id="a tab in the indentation"),
    dataset("name: rig", "name: rig\nname: rig2", "line 2", "stands twice", id="a key that stands twice"),
    dataset("name: rig", "name: !!python/object:os.system rig", "line 1", "remedy", id="a YAML tag that would run code"),
    dataset("name: rig", "name: [", "line", "not valid YAML", id="a bracket that is not closed"),
    Bad(id="an empty description", command="ingest rig", files={"datasets/rig/dataset.yaml": ""}, says=("dataset.yaml", "empty file")),
    Bad(id="a list for a description", command="ingest rig", files={"datasets/rig/dataset.yaml": "- a\n"}, says=("dataset.yaml", "a list")),
    Bad(id="a description in another encoding", command="ingest rig", files={"datasets/rig/dataset.yaml": "name: Prüfstand".encode("utf-16")}, says=("dataset.yaml", "UTF-8")),
    Bad(id="a generator that is not installed", command="ingest warp", files={"datasets/warp/dataset.yaml": "name: warp\nsample_time: 1\nchannels: [{name: a, unit: V}]\nsource: {generator: warp, options: {}}\ncases: {A: {role: test, recipe: {}}}\n"}, says=("generator", "warp", "dataset.yaml", "remedy")),
]  # fmt: skip


EXPORT = "export: {fit: closed loop, formats: [onnx]}"
AGAIN = """\
name: again
sample_time: 0.05
channels:
  - {name: inlet, unit: kPa, reference: gauge}
  - {name: valve, unit: V}
  - {name: outlet, unit: kPa, reference: gauge}
source: {files: {references: gauge}}
cases: {twice: {role: selection, file: ../rig/run-1.csv}}
"""
"""A data set that chooses on what is fitted."""


def pipeline(old: str, new: str, *says: str, id: str, files: Mapping[str, str] | None = None) -> Bad:  # noqa: A002
    """The pipeline is changed."""
    edits = {"pipelines/first.yaml": (old, new)}
    return Bad(id=id, command="run first --no-tracking", edits=edits, files=files or {}, says=says)


PIPELINES = [
    pipeline("mapping", "maping", "first.yaml", "did you mean mapping?", id="a misspelt field of a pipeline"),
    pipeline("name: first", "name: ../first", "field name", "../first", id="a name that leaves the folder"),
    pipeline("inlet+valve -> outlet", "inlet+valve", "field mapping", "->", id="a mapping without an arrow"),
    pipeline("inlet+valve -> outlet", "inlet+valve -> a+b", "write rest: {a: 0", id="a mapping with two outputs that have no rest"),
    pipeline("inlet+valve -> outlet", "inlet+inlet -> outlet", "field mapping", "inlet", id="an input twice"),
    pipeline("inlet+valve -> outlet", "inlet+vlave -> outlet", "missing channel vlave", "did you mean valve?", id="a channel that the data set lacks"),
    pipeline("data: rig", "data: rigg", "no data set rigg", "did you mean rig?", id="a data set that is not there"),
    pipeline("data: rig", "data: rig\nselection: again", "selection trace twice is the case run-1", "another trace", id="choosing on a trace that is scored", files={"datasets/again/dataset.yaml": AGAIN}),
    pipeline("data: rig", "data: rig\nselection: rigg", "no data set rigg", "remedy", id="a selection that is not there"),
    pipeline("start: rest", "start: {measured: many}", "field start", "measured", id="a start that is not a number"),
    pipeline("start: rest", "start: {measured: 400}", "start", "400", "remedy", id="a start longer than the record"),
    pipeline("start: rest", "start: sleeping", "field start", "first-sample", "sleeping", id="a start that is not known"),
    pipeline("rest: {outlet: 100}", "rest: {inlet: 100}", "rest names inlet", "outlet", id="a rest for an input"),
    pipeline("rest: {outlet: 100}", "rest: {outlet: low}", "field rest.outlet", "low", id="a word for a rest"),
    pipeline("seed: 3", "seed: -3", "field seed", "-3", id="a negative seed"),
    pipeline("kind: ARX", "kind: Volterra", "field fits[0].structure", "ARX", "NARX", "Volterra", id="a structure that is not known"),
    pipeline("na: 1, ", "", "structure ARX lacks na", "add na: 2", id="a structure without an order"),
    pipeline("kind: ARX, na: 1", "kind: TF, poles: [1]", "unknown field 'nb'", "TransferFunction", id="the short word for a kind"),
    pipeline("kind: ARX", "kind: tfest", "'tfest'", "did you mean TransferFunction?", id="a kind by its name in another tool"),
    pipeline("na: 1", "na: -1", "fits[0].structure", "-1", id="a negative order"),
    pipeline("nb: [1, 1]", "nb: [1]", "orders", "nb", "remedy", id="orders for one input of two"),
    pipeline("na: 1, nb: [1, 1]", "na: 300, nb: [300, 300]", "fitting ARX", "at least 901", "400", "lower the orders", id="more parameters than samples"),
    pipeline("neurons: 2", "neurons: -2", "line 10, field fits[1].structure", "a whole number", "-2", id="fewer neurons than none"),
    pipeline("neurons: 2", "neurons: two", "fits[1].structure", "two", id="a word for the neurons"),
    pipeline("input_delays: 1", "input_delays: '3:1'", "fits[1].structure", "3:1", id="delays that end before they begin"),
    pipeline("loop: open", "loop: ajar", "fits[1].training", "loop", "ajar", id="a loop that is neither open nor closed"),
    pipeline("max_iterations: 8}\n  - ", "max_iteration: 8}\n  - ", "max_iteration", "did you mean max_iterations?", id="a misspelt option of the training"),
    pipeline("max_iterations: 8}\n  - ", "max_iterations: 0}\n  - ", "fits[1]", "max_iterations", "1 or more", id="no iterations"),
    pipeline("initial: open loop", "initial: opne loop", "did you mean open loop?", id="an initial fit that is not there"),
    pipeline("neurons: 2}\n    training: {loop: open", "neurons: 3}\n    training: {loop: open", "'closed loop': the initial fit is not contained", "NARX 1/1/2", "3 neurons", id="an initial fit of a larger network"),
    pipeline("name: open loop", "name: ARX", "cannot be told from another", "rename", id="two fits of one name"),
    pipeline("nk: [1, 1]}}", "nk: [1, 1]}, training: {loop: open}}", "an ARX model takes no training", "fits[0].training", "leave training out", id="a training for a linear model"),
    pipeline(EXPORT, "export: {fit: opne loop}", "did you mean open loop?", id="an export of no fit"),
    pipeline(EXPORT, "export: {formats: [exe]}", "field export.formats", "onnx", "exe", id="a format that is not known"),
    pipeline(EXPORT, "export: {tolerance: 0}", "field export.tolerance", "greater than 0", id="a tolerance of nothing"),
    pipeline(EXPORT, "report: {published: nobody}", "nobody", "remedy", id="a published table that is not there"),
    pipeline("seed: 3", "seed: 3\nkind: dance", "kind", "dance", id="a kind of pipeline that is not known"),
    pipeline("seed: 3", "seed: 3\ndeep: &a [*a]", "first.yaml", "remedy", id="YAML that contains itself"),
    Bad(id="no fits", command="run first", edits={"pipelines/first.yaml": ("fits:", "fits: []\nfist:")}, says=("first.yaml", "fist", "did you mean fits?")),
    Bad(id="a data set without estimation", command="run first --no-tracking", edits={"datasets/rig/dataset.yaml": ("role: estimation", "role: test")}, says=("no trace is for estimation", "data set rig", "role: estimation")),
]  # fmt: skip

COMMANDS = [
    Bad(id="a pipeline that is not there", command="run frist", says=("no pipeline named frist", "did you mean first?")),
    Bad(id="a pipeline's file that is not there", command="run pipelines/no.yaml", says=("pipelines/no.yaml", "check the path")),
    Bad(id="results into a file", command="run first --out mine.txt", files={"mine.txt": "mine"}, says=("mine.txt", "cannot be written", "--out")),
    Bad(id="a command that is not there", command="rnu first", says=("No such command 'rnu'", "run")),
    Bad(id="an option that is not there", command="run first --frsh", says=("--frsh", "--fresh")),
    Bad(id="a missing argument", command="run", says=("Missing argument", "sysid run --help")),
    Bad(id="a word for a port", command="ui --port many", says=("--port", "valid integer", "--port many", "sysid ui --help")),
    Bad(id="a port out of range", command="ui --port 99999 --no-browser", says=("99999", "65535", "sysid ui --help")),
    Bad(id="a report of no run", command="report nowhere", says=("nowhere", "holds no results", "remedy")),
    Bad(id="a report of a file", command="report mine.txt", files={"mine.txt": "mine"}, says=("mine.txt", "remedy")),
    Bad(id="a workspace over another", command="init .", files={"README.md": "mine"}, says=("README.md", "nothing was changed")),
    Bad(id="a workspace in a file", command="init mine.txt", files={"mine.txt": "mine"}, says=("mine.txt", "remedy")),
    Bad(id="an export of a fit that is not in the pipeline", command="export first --fit none", says=("one of ARX; open loop; closed loop",)),
    Bad(id="an export before the run", command="export first --fit ARX --run-folder elsewhere", says=("elsewhere", "sysid run first")),
    Bad(id="an export over a folder of one's own", command="export first --fit ARX --out pipelines", says=("pipelines", "remedy")),
    Bad(id="a promotion of no model", command="promote nothing", tracked=True, says=("nothing", "remedy")),
    Bad(id="a bundle that is not there", command="simulate nowhere datasets/rig/run-1.csv --out o.csv", says=("nowhere", "no model.json", "remedy")),
    Bad(id="inputs that are not there", command="simulate runs/first/bundle no.csv --out o.csv", says=("no.csv", "no such file", "remedy")),
    Bad(id="inputs without a channel", command="simulate runs/first/bundle a.csv --out o.csv", files={"a.csv": rows().replace("valve", "valbe")}, says=("a.csv", "missing channel valve", "--columns valve=valbe")),
    Bad(id="inputs at another sample time", command="simulate runs/first/bundle a.csv --out o.csv", files={"a.csv": rows().replace("[s]", "[min]")}, says=("a.csv", "0.05 s", "3 s", "remedy")),
    Bad(id="an output of an unknown ending", command="simulate runs/first/bundle a.csv --out o.xlsx", files={"a.csv": rows()}, says=("o.xlsx", ".csv", "remedy")),
    Bad(id="an output into a file's inside", command="simulate runs/first/bundle a.csv --out pipelines/first.yaml/o.csv", files={"a.csv": rows()}, says=("o.csv", "remedy")),
    Bad(id="a word for an initial value", command="simulate runs/first/bundle a.csv --out o.csv --initial low", files={"a.csv": rows()}, says=("--initial", "finite number", "low", "--initial 3.4")),
    Bad(id="an infinite initial value", command="simulate runs/first/bundle a.csv --out o.csv --initial inf", files={"a.csv": rows()}, says=("--initial", "inf", "remedy")),
]  # fmt: skip

CATALOGUE = [*RECORDS, *FILES, *DATASETS, *PIPELINES, *COMMANDS]
