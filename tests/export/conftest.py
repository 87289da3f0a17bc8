"""The table of files that every exporter is held to, written and opened; and traces to run models on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

from sysid.estimation.results.result import FitResult, Loop, Status
from sysid.export import (
    EXPORTERS,
    AbstractExporter,
    Bundle,
    ExportedFile,
    Run,
    StateLayout,
    Surrogate,
    export_bundle,
)
from sysid.export.expected_runs import RANDOM_SEQUENCES, random_cases
from sysid.models import NARX, AbstractModel, Cascade, History, NARXModel, Start
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.units import Reference
from sysid.validation import evaluate_cascade
from tests.export.cascades import CASCADES, build_cascade, build_circle, build_limited
from tests.export.single_models import MODELS, build_narx


@pytest.fixture(params=MODELS, scope="session")
def model(request: pytest.FixtureRequest) -> AbstractModel:
    return MODELS[request.param]()


@pytest.fixture(scope="session")
def models() -> dict[str, Callable[[], AbstractModel]]:
    return MODELS


@pytest.fixture(scope="session")
def narx() -> Callable[..., NARXModel]:
    return build_narx


RANGES = {"BP": (0.0, 95.0), "AR": (0.0, 95.0)}
"""Declared in every test: what :func:`random_inputs` keeps to."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """A file that a format writes for a model, by what sets it apart."""

    format: str
    name: str
    dtype: str = "float64"
    tolerance: float = 1e-9


ROWS = {
    "ONNX, step": Row(format="onnx", name="step.onnx"),
    "ONNX, sequence": Row(format="onnx", name="sequence.onnx"),
    "ONNX float32, step": Row(format="onnx-float32", name="step.float32.onnx", dtype="float32", tolerance=1e-3),
    "ONNX float32, sequence": Row(format="onnx-float32", name="sequence.float32.onnx", dtype="float32", tolerance=1e-3),
    "TorchScript, step": Row(format="torchscript", name="step.torchscript.pt"),
    "TorchScript, sequence": Row(format="torchscript", name="sequence.torchscript.pt"),
    "torch.export, step": Row(format="torch-export", name="step.pt2"),
    "C": Row(format="c", name="{name}.c"),
    "C, float": Row(format="c-float32", name="{name}.c", dtype="float32", tolerance=1e-3),
    "FMI 2.0": Row(format="fmi2", name="{name}.fmi2.fmu"),
    "FMI 3.0": Row(format="fmi3", name="{name}.fmi3.fmu"),
    "CasADi, step": Row(format="casadi", name="step.casadi"),
    "JAX, step": Row(format="jax", name="step.jax"),
    "C++": Row(format="cpp", name="{name}.hpp"),
    "WebAssembly": Row(format="wasm", name="{name}.wasm"),
    "MATLAB": Row(format="matlab", name="{name}_run.m"),
    "Structured Text": Row(format="st", name="{name}.st"),
    "Arduino": Row(format="arduino", name="{name}_arduino.zip", dtype="float32", tolerance=1e-3),
}
"""Every file of every format: the table of the contract."""
OPTIONAL = ("wasm", "matlab", "st")
"""Formats whose compiler or judge is large, and is not among what the tests must have."""
FORMATS = tuple(dict.fromkeys(row.format for row in ROWS.values()))


@pytest.fixture(scope="session")
def rows() -> dict[str, Row]:
    return ROWS


@pytest.fixture(params=FORMATS, scope="session")
def format_name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@dataclass(frozen=True, kw_only=True)
class Exported:
    """A surrogate and a file of it, ready to run."""

    surrogate: Surrogate
    file: ExportedFile
    folder: Path
    run: Callable[[np.ndarray, np.ndarray], Run]
    tolerance: float

    @property
    def model(self) -> AbstractModel:
        return self.surrogate.stages[0].model

    @property
    def layout(self) -> StateLayout:
        return StateLayout.of(self.model)

    @property
    def path(self) -> Path:
        return self.folder / self.file.name


def surrogate_of(model: AbstractModel) -> Surrogate:
    return Surrogate.of(model, RANGES)


@pytest.fixture(scope="session")
def declared() -> Callable[[AbstractModel], Surrogate]:
    return surrogate_of


def usable(name: str) -> AbstractExporter:
    """The exporter of a format; skips where a package that no test has to have is not there."""
    found = EXPORTERS[name]
    problem = found.lacks() if name in OPTIONAL else None
    if problem:
        pytest.skip(str(problem))
    return found


def open_file(row: Row, surrogate: Surrogate, folder: Path, written: Sequence[ExportedFile] | None = None) -> Exported:
    """Write a surrogate, unless it is written already, and load one of its files."""
    exporter = usable(row.format)
    files = exporter.write(surrogate, folder) if written is None else written
    (file,) = [file for file in files if matches(row, file, surrogate)]
    run = exporter.load(file, folder)
    return Exported(surrogate=surrogate, file=file, folder=folder, run=run, tolerance=row.tolerance)


@pytest.fixture(scope="session")
def opened_of_a_format(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Exported]:
    """Opens a file by the name of what is exported and its row; all files of a format are written at once."""

    @cache
    def written(build: Callable[[], Surrogate], name: str) -> tuple[Surrogate, Path, tuple[ExportedFile, ...]]:
        surrogate, folder = build(), tmp_path_factory.mktemp("exported")
        return surrogate, folder, usable(name).write(surrogate, folder)

    def opened(build: Callable[[], Surrogate], row: Row) -> Exported:
        return open_file(row, *written(build, row.format))

    return opened


def matches(row: Row, file: ExportedFile, surrogate: Surrogate) -> bool:
    return (file.name, file.dtype) == (row.name.format(name=surrogate.identifier), row.dtype)


@pytest.fixture(scope="session")
def opened() -> Callable[..., Exported]:
    return open_file


FEW_MODELS = (
    "ARX, two inputs, dead times",
    "ARX, no input used",
    "NARX 4/4/20",
    "NARX, linear part alone",
    "NARX, gates of tanh",
    "NARX against its limits",
    "NARX against its bounds",
)
WRAPPED = ("fmi2", "fmi3", "torch-export", "cpp", "arduino", "wasm", "jax")
"""Formats that meet one model of a kind and fewer cascades: those around the C source or TorchScript's module, and what
compiles long."""
INTERPRETED = ("matlab", "st")
"""Formats that start or run slowly here, and meet what differs in them: sizes and bounds, every kind of stage."""
MET = dict.fromkeys(WRAPPED, FEW_MODELS) | dict.fromkeys(INTERPRETED, FEW_MODELS[-1:])
PAIRS = [(m, r) for m in MODELS for r, row in ROWS.items() if m in MET.get(row.format, MODELS)]
FEW_CASCADES = ("every kind, limits and levels", "one output of a circle")
WIRED_MET = (
    dict.fromkeys(WRAPPED, FEW_CASCADES)
    | {"fmi2": (*FEW_CASCADES, "a committee of four")}
    | dict.fromkeys(INTERPRETED, FEW_CASCADES[:1])
)
WIRED = [(c, r) for c in CASCADES for r, row in ROWS.items() if c in WIRED_MET.get(row.format, CASCADES)]


@pytest.fixture(params=PAIRS, ids=[" - ".join(pair) for pair in PAIRS], scope="session")
def exported(request: pytest.FixtureRequest, opened_of_a_format: Callable[..., Exported]) -> Exported:
    name, row = request.param
    return opened_of_a_format(declared_model(name), ROWS[row])


@cache
def declared_model(name: str) -> Callable[[], Surrogate]:
    return lambda: surrogate_of(MODELS[name]())


@cache
def declared_cascade(name: str) -> Callable[[], Surrogate]:
    build, outputs = CASCADES[name]
    return lambda: Surrogate.of(build(), {"STP": (0.0, 80.0)}, outputs=outputs)


@pytest.fixture(params=WIRED, ids=[" - ".join(pair) for pair in WIRED], scope="session")
def wired(request: pytest.FixtureRequest, opened_of_a_format: Callable[..., Exported]) -> Exported:
    """Models wired, and a file of them."""
    name, row = request.param
    return opened_of_a_format(declared_cascade(name), ROWS[row])


def random_inputs(n_samples: int, n_inputs: int, *, seed: int = 3) -> np.ndarray:
    """Steps and noise, between 0 and 95 psi."""
    rng = np.random.default_rng(seed)
    steps = np.repeat(rng.uniform(0.0, 90.0, (n_samples // 20 + 1, n_inputs)), 20, axis=0)[:n_samples]
    return steps + rng.uniform(0.0, 5.0, steps.shape)


@pytest.fixture(scope="session")
def inputs() -> Callable[..., np.ndarray]:
    return random_inputs


def random_history(model: AbstractModel, *, seed: int = 4) -> History:
    """A past that is not at rest, longer than any lag."""
    rng = np.random.default_rng(seed)
    n_past = model.recursion.lags.depth + 3
    return History(
        inputs=rng.uniform(0.0, 90.0, (n_past, len(model.mapping.inputs))), output=rng.uniform(0.0, 60.0, n_past)
    )


@pytest.fixture(scope="session")
def past() -> Callable[..., History]:
    return random_history


@pytest.fixture(scope="session")
def fit() -> FitResult:
    return FitResult(
        model=build_narx(NARX(input_delays=4, output_delays=4, neurons=20)),
        status=Status.CONVERGED,
        loop=Loop.CLOSED,
        history={"iteration": np.arange(2.0), "mse": np.array([2.0, 1.0])},
        train_time_s=1.25,
        seed=7,
        notes=("Started from the open-loop fit.",),
    )


@pytest.fixture(scope="session")
def traces(fit: FitResult) -> TraceSet:
    """Three short records: what the model itself computes, with noise."""
    channels = (
        Channel(name="BP", unit="psi", reference=Reference.GAUGE, description="brake pipe"),
        Channel(name="AR", unit="psi", reference=Reference.GAUGE),
        Channel(name="BC", unit="psi", reference=Reference.GAUGE),
    )
    records = []
    for i, name in enumerate(["EST01", "VAL01", "VAL02"]):
        columns = random_inputs(300 + 50 * i, 2, seed=20 + i)
        output = fit.model.simulate(columns) + np.random.default_rng(i).normal(size=len(columns))
        records.append(Trace(name=name, sample_time=0.1, channels=channels, values=np.column_stack([columns, output])))
    return TraceSet(
        name="synthetic", traces=tuple(records), roles={"EST01": Role.ESTIMATION}, source="Made for a test."
    )


@pytest.fixture(scope="session")
def start() -> Start:
    return Start()


@pytest.fixture(scope="session")
def cascade() -> Surrogate:
    return Surrogate.of(build_cascade(), {"STP": (0.0, 80.0)})


@pytest.fixture(scope="session")
def circle() -> Surrogate:
    return Surrogate.of(build_circle(), {"STP": (0.0, 80.0)})


@pytest.fixture(scope="session")
def limited() -> Cascade:
    return build_limited()


@pytest.fixture(scope="session")
def command() -> TraceSet:
    """Cases of a cascade: its inputs, and one of its outputs."""
    channels = tuple(Channel(name=name, unit="psi", reference=Reference.GAUGE) for name in ("STP", "FLOW", "BC"))
    records = []
    for i, name in enumerate(["EST01", "VAL01"]):
        columns = random_inputs(250, 2, seed=30 + i)
        output = build_limited().simulate(columns)["BC"]
        records.append(Trace(name=name, sample_time=0.1, channels=channels, values=np.column_stack([columns, output])))
    return TraceSet(name="commands", traces=tuple(records), roles={"EST01": Role.ESTIMATION}, source="Made for a test.")


@pytest.fixture(scope="session")
def cascade_bundle(limited: Cascade, command: TraceSet, tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    """A whole cascade in every format but those of torch, which take long, and what lacks here; read-only.

    Each is run on the cases and on the first tenth of the random sequences that a user's bundle is: Octave needs half
    a minute for all of them, and what makes and counts them is looked at in ``test_parity`` and ``test_bundle``.
    """
    few = partial(random_cases, sequences=RANDOM_SEQUENCES // 10)
    formats = [name for name, one in EXPORTERS.items() if not name.startswith("torch") and not one.lacks()]
    folder = tmp_path_factory.mktemp("cascade") / "b"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sysid.export.writing.random_cases", few)
        return export_bundle(
            limited, command, folder, formats=formats, metrics=evaluate_cascade(limited, command, repeats=1)
        )
