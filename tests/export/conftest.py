"""The table of models that every exporter is held to, and traces to run them on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from sysid.estimation.result import FitResult, Loop, Status
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
from sysid.models import (
    ARX,
    NARX,
    AbstractModel,
    ARXModel,
    Cascade,
    Domain,
    History,
    Limit,
    Mapping,
    NARXModel,
    Scaling,
    Start,
    TransferFunction,
    VectorMapping,
    VectorNARX,
    VectorNARXModel,
    VectorScaling,
    parameter_count,
)
from sysid.models.transfer_function import TransferFunctionModel
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.units import Reference
from sysid.validation import evaluate_cascade

MAPPINGS = {1: "BP -> BC", 2: "BP+AR -> BC"}


def build_arx(*, na: int, nb: tuple[int, ...], nk: tuple[int, ...], seed: int = 1) -> ARXModel:
    """A stable ARX model: the moduli of its ``a`` add up to 0.9."""
    rng = np.random.default_rng(seed)
    b, a = rng.normal(size=sum(nb)), rng.uniform(0.1, 1.0, na) * rng.choice([-1.0, 1.0], na)
    a *= 0.9 / max(np.abs(a).sum(), 1e-3)
    return ARXModel(
        orders=ARX(na=na, nb=nb, nk=nk),
        coefficients=np.concatenate([b, a]),
        intercept=1.5,
        mapping=Mapping.parse(MAPPINGS[len(nb)]),
        sample_time=0.1,
        input_units=("psi",) * len(nb),
        output_unit="psi",
        rest_output=2.0,
    )


def build_narx(
    structure: NARX, *, n_inputs: int = 2, clamp: float = 3.0, gain: float = 0.4, seed: int = 2
) -> NARXModel:
    """A NARX network with random weights, shrunk until its free run forgets where it started."""
    rng = np.random.default_rng(seed)
    lags = structure.lags(n_inputs)
    count = parameter_count(lags, structure.neurons, linear=structure.feedthrough, gated=structure.gated)
    theta = rng.normal(size=count)
    theta *= gain / np.sqrt(len(theta))
    theta[structure.neurons * lags.n_regressors :] *= 2.0
    return NARXModel(
        network=structure,
        theta=theta,
        scaling=Scaling(
            input_offset=(45.0, 70.0)[:n_inputs],
            input_scale=(45.0, 20.0)[:n_inputs],
            output_offset=38.0,
            output_scale=40.0,
        ),
        mapping=Mapping.parse(MAPPINGS[n_inputs]),
        sample_time=0.1,
        input_units=("psi",) * n_inputs,
        output_unit="psi",
        rest_output=0.0,
        clamp=clamp,
    )


MODELS: dict[str, Callable[[], AbstractModel]] = {
    "ARX": lambda: build_arx(na=2, nb=(2,), nk=(1,)),
    "ARX, two inputs, dead times": lambda: build_arx(na=3, nb=(2, 3), nk=(0, 5)),
    "ARX, finite impulse response": lambda: build_arx(na=0, nb=(4,), nk=(1,)),
    "ARX, direct input only": lambda: build_arx(na=0, nb=(1,), nk=(0,)),
    "ARX, one input unused": lambda: build_arx(na=1, nb=(0, 2), nk=(0, 1)),
    "ARX, no input used": lambda: build_arx(na=2, nb=(0,), nk=(0,)),
    "NARX 4/4/20": lambda: build_narx(NARX(input_delays=4, output_delays=4, neurons=20)),
    "NARX, one input": lambda: build_narx(NARX(input_delays=2, output_delays=3, neurons=5), n_inputs=1),
    "NARX without feed-through": lambda: build_narx(
        NARX(input_delays=2, output_delays=2, neurons=6, feedthrough=False)
    ),
    "NARX, linear part alone": lambda: build_narx(NARX(input_delays=2, output_delays=2, neurons=0)),
    "NARX, direct input": lambda: build_narx(NARX(input_delays="0:3", output_delays=2, neurons=5)),
    "NARX, direct input only": lambda: build_narx(NARX(input_delays="0:0", output_delays=1, neurons=5)),
    "NARX, sparse lags": lambda: build_narx(NARX(input_delays=[1, 2, 4, 8], output_delays=[2, 5], neurons=5)),
    "NARX, delays per input": lambda: build_narx(NARX(input_delays=[[0], [1, 2, 4]], output_delays="1:2", neurons=5)),
    "NARX against its bounds": lambda: build_narx(
        NARX(input_delays=2, output_delays=2, neurons=8), clamp=0.1, gain=3.0, seed=5
    ),
    "NARX, gates": lambda: build_narx(NARX(input_delays="0:1", output_delays=1, neurons=6, gated=True)),
    "NARX, gates, sparse lags": lambda: build_narx(
        NARX(input_delays=[[0], [1, 2, 5]], output_delays=[2, 3], neurons=4, gated=True)
    ),
    "NARX without bounds": lambda: build_narx(NARX(input_delays=2, output_delays=2, neurons=5), clamp=float("inf")),
}


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
}
"""Every file of every format: the table of the contract."""
FORMATS = tuple(dict.fromkeys(row.format for row in ROWS.values()))


@pytest.fixture(scope="session")
def rows() -> dict[str, Row]:
    return ROWS


@pytest.fixture(params=FORMATS, scope="session")
def format_name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(params=ROWS, scope="session")
def row(request: pytest.FixtureRequest) -> Row:
    return ROWS[request.param]


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


def open_file(row: Row, surrogate: Surrogate, folder: Path) -> Exported:
    """Write a surrogate and load one of its files."""
    exporter: AbstractExporter = EXPORTERS[row.format]
    written = exporter.write(surrogate, folder)
    (file,) = [file for file in written if (matches(row, file, surrogate))]
    run = exporter.load(file, folder)
    return Exported(surrogate=surrogate, file=file, folder=folder, run=run, tolerance=row.tolerance)


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
    "NARX, gates",
    "NARX against its bounds",
)
WRAPPED = ("fmi2", "fmi3", "torch-export")
"""Formats around one that meets every model: an FMU holds the C source, torch.export traces TorchScript's module."""
PAIRS = [(m, r) for m in MODELS for r, row in ROWS.items() if row.format not in WRAPPED or m in FEW_MODELS]


@pytest.fixture(params=PAIRS, ids=[" - ".join(pair) for pair in PAIRS], scope="session")
def exported(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Exported:
    name, row = request.param
    return open_file(ROWS[row], surrogate_of(MODELS[name]()), tmp_path_factory.mktemp("exported"))


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


def wired_narx(mapping: str, structure: NARX, seed: int, *, clamp: float = 3.0) -> NARXModel:
    """A network of a cascade, all of whose channels lie between 0 and 90 psi."""
    rng = np.random.default_rng(seed)
    parsed = Mapping.parse(mapping)
    n_inputs = len(parsed.inputs)
    count = parameter_count(structure.lags(n_inputs), structure.neurons, linear=True, gated=structure.gated)
    theta = rng.normal(size=count)
    return NARXModel(
        network=structure,
        theta=theta * 0.4 / np.sqrt(len(theta)),
        scaling=Scaling(
            input_offset=(45.0,) * n_inputs, input_scale=(45.0,) * n_inputs, output_offset=40.0, output_scale=38.0
        ),
        mapping=parsed,
        sample_time=0.1,
        input_units=("psi",) * n_inputs,
        output_unit="psi",
        rest_output=3.0,
        clamp=clamp,
    )


def wired_vector(mapping: str, structure: VectorNARX, seed: int) -> VectorNARXModel:
    """A network of several outputs in a cascade."""
    parsed = VectorMapping.parse(mapping)
    n, m = len(parsed.inputs), len(parsed.outputs)
    theta = np.random.default_rng(seed).normal(size=structure.parameter_count(n, m))
    return VectorNARXModel(
        network=structure,
        theta=theta * 0.4 / np.sqrt(len(theta)),
        scaling=VectorScaling(
            input_offset=(45.0,) * n, input_scale=(45.0,) * n, output_offset=(40.0,) * m, output_scale=(38.0,) * m
        ),
        mapping=parsed,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_units=("psi",) * m,
        rest_outputs=(5.0,) * m,
    )


def wired_transfer_function(mapping: str) -> TransferFunctionModel:
    """A slow linear model of one input in a cascade."""
    return TransferFunctionModel(
        orders=TransferFunction(poles=(2,), zeros=(1,), delays=(2,), domain=Domain.DISCRETE),
        sections=((np.array([1.0, -1.9, 0.905]),),),
        taps=(np.array([0.004, 0.001]),),
        constant=0.1,
        scaling=Scaling(input_offset=(45.0,), input_scale=(45.0,), output_offset=38.0, output_scale=40.0),
        mapping=Mapping.parse(mapping),
        sample_time=0.1,
        input_units=("psi",),
        output_unit="psi",
        rest_output=0.0,
    )


def build_cascade() -> Cascade:
    """Three models: the first computes BP, the second reads it, the third reads both outputs and the command."""
    return Cascade(
        models=(
            wired_narx("STP+FLOW -> BP", NARX(input_delays="0:3", output_delays=[1, 2, 5], neurons=6), 1),
            wired_narx("BP -> AR", NARX(input_delays=2, output_delays=3, neurons=4, gated=True), 2),
            wired_narx(
                "BP+AR+STP -> BC", NARX(input_delays=[[0], [1, 3], [2]], output_delays=2, neurons=5), 3, clamp=0.05
            ),
        )
    )


def build_limited() -> Cascade:
    """Every kind of model, levels that follow an input, and limits of every kind, all of which are reached."""
    return Cascade(
        models=(
            wired_narx("STP+FLOW -> BP", NARX(input_delays="0:1", output_delays=1, neurons=6), 1),
            wired_vector(
                "BP+STP -> AR+ER", VectorNARX(input_delays="0:1", output_delays=[[1, 2], [1, 4]], neurons=5), 2
            ),
            wired_vector("STP -> V+W", VectorNARX(input_delays=1, output_delays=[[2], [1]], neurons=3), 4),
            wired_narx("BP+AR -> BC", NARX(input_delays=1, output_delays=2, neurons=5), 3),
            wired_transfer_function("BP -> X"),
        ),
        rest={"BP": "STP", "AR": "STP", "ER": 60.0, "FLOW": 10.0},
        limits={
            "BP": Limit(low=0.0, high="STP"),
            "AR": Limit(low=12.0, high="BP"),
            "ER": Limit(low=41.0, high=50.0),
            "W": Limit(low="FLOW", high=37.0),
            "BC": Limit(low=37.6, high=37.9),
            "X": Limit(low=36.0, high="STP"),
        },
    )


def build_circle() -> Cascade:
    """Models that read each other through the past, one of them with two outputs and one with gates, and limits."""
    return Cascade(
        models=(
            wired_narx("STP+AR+ER -> BP", NARX(input_delays=[[0, 1], [1, 3], [1]], output_delays=2, neurons=5), 1),
            wired_vector(
                "BP+BC -> AR+ER", VectorNARX(input_delays=[[0], [2]], output_delays=[[1, 2], [1]], neurons=4), 2
            ),
            wired_narx("AR -> BC", NARX(input_delays="0:1", output_delays=1, neurons=3, gated=True), 3, clamp=0.05),
        ),
        rest={"BP": "STP", "AR": 30.0},
        limits={"AR": Limit(low=12.0, high="BP"), "ER": Limit(low=38.0)},
    )


CASCADES: dict[str, tuple[Callable[[], Cascade], tuple[str, ...] | None]] = {
    "three models": (build_cascade, None),
    "every kind, limits and levels": (build_limited, None),
    "in a circle": (build_circle, None),
    "some outputs, in another order": (build_limited, ("BC", "AR")),
    "one output of a circle": (build_circle, ("ER",)),
}
"""Models wired, and which outputs leave them."""


@pytest.fixture(scope="session")
def cascade() -> Surrogate:
    return Surrogate.of(build_cascade(), {"STP": (0.0, 80.0)})


@pytest.fixture(params=CASCADES, scope="session")
def any_cascade(request: pytest.FixtureRequest) -> Surrogate:
    build, outputs = CASCADES[request.param]
    return Surrogate.of(build(), {"STP": (0.0, 80.0)}, outputs=outputs)


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
    """A whole cascade in every format but torch's, which take long; read-only."""
    formats = [name for name in EXPORTERS if not name.startswith("torch")]
    folder = tmp_path_factory.mktemp("cascade") / "b"
    return export_bundle(
        limited, command, folder, formats=formats, metrics=evaluate_cascade(limited, command, repeats=1)
    )
