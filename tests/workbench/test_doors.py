"""The contract of the table of estimators: the same request has the same answer at every door.

Doors are Python (``sysid.fit``), a pipeline of kind ``fits``, a sweep of one point and a member of an assembly. A new
structure gets a row in ``FITS``, and what it does not take a row in ``REFUSED``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import sysid
from sysid.composite.stages import fit_member
from sysid.errors import ConfigError
from sysid.estimation import FitResult, StabilityOptions
from sysid.estimation.estimators import ESTIMATORS
from sysid.field_checks import check
from sysid.models import Start, structure_from_dict
from sysid.traces import Role, TraceSet
from sysid.workbench.assembly.member_config import MemberConfig
from sysid.workbench.fits.config import Pipeline
from sysid.workbench.fits.record import read_fit
from sysid.workbench.fits.run import program_of
from sysid.workbench.runner.program import carry_out
from sysid.workbench.runner.store import strict
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.run import Sweep
from sysid.workbench.sweep.run import program_of as program_of_sweep
from sysid.workbench.sweep.workers import InThisProcess
from sysid.yaml_files import yaml_text
from tests.workbench.pipelines import parse_pipeline

MAPPING = "inlet+valve -> outlet"
STABILITY = {"count": 15}
TERMS = {"data": "rig", "mapping": MAPPING, "start": "rest", "rest": {"outlet": 100.0}}
SHARED = {**TERMS, "stability": STABILITY, "export": None}

NARX = {"kind": "NARX", "input_delays": 1, "output_delays": 1, "neurons": 2}
NSS = {"kind": "NSS", "states": 1, "neurons": 2}
ARX = {"kind": "ARX", "na": 1, "nb": [1, 1], "nk": [1, 1]}
VECTOR_SS = {"kind": "VectorSS", "states": 2}
VECTOR_ARX = {"kind": "VectorARX", "na": [[2, 1], [1, 2]], "nb": 2, "nk": [[1, 1], [0, 2]]}
VECTOR_NSS = {"kind": "VectorNSS", "states": 1, "neurons": 1}
VECTOR = {"kind": "VectorNARX", "input_delays": 1, "output_delays": 1, "neurons": 2}
SS = {"kind": "SS", "states": 1}
OE = {"kind": "OE", "nb": [1, 1], "nf": [1, 1], "nk": [1, 1]}
BJ = {"kind": "BJ", "nb": [1, 1], "nc": 1, "nd": 1, "nf": [1, 1], "nk": [1, 1]}
ARMAX = {"kind": "ARMAX", "na": 1, "nb": [1, 1], "nc": 1, "nk": [1, 1]}
GREY = {
    "kind": "GreyBox",
    "equations": "doutlet/dt = (gain*(valve + inlet) - outlet + level)/lag",
    "parameters": {"gain": {"start": 1, "low": 0}, "level": 80, "lag": {"start": 2, "low": 0.1}},
}
OF_A_CASE = {"start": 80, "per": "case"}
GREY_BY_CASE = GREY | {
    "parameters": {**GREY["parameters"], "level": OF_A_CASE},
    "cases": {"monday": ["run-1", "run-2", "run-3"]},
    "intervals": "profile",
}
HW = {"kind": "HammersteinWiener", "states": 1, "input": ["saturation", "none"], "output": "polynomial 2"}
WH = {"kind": "WienerHammerstein", "first": 1, "second": 1, "curve": "network 2"}
POLYNOMIAL_NARX = {"kind": "PolynomialNARX", "input_delays": 1, "output_delays": 1, "terms": 4}
VECTOR_GREY = GREY | {"kind": "VectorGreyBox"}
PROCESS = {"kind": "ProcessModel", "type": "P1", "parameters": {"Tp1(valve)": {"start": 2, "low": 0.1, "high": 20}}}
TF = {"kind": "TransferFunction", "poles": [1, 1], "zeros": [0, 0], "delays": [1, 1]}

EVERYWHERE = ("python", "fits", "sweep", "member")
ALONE = EVERYWHERE[:3]
"""Doors for what is no member of an assembly."""

FITS = [
    pytest.param(ARX, None, ALONE, id="ARX"),
    pytest.param(ARX | {"intercept": False, "na": 4}, None, ALONE, id="ARX of another order"),
    pytest.param(ARX | {"nb": 1, "nk": 1}, None, ALONE, id="ARX, one number for all inputs"),
    pytest.param(TF, {"seed": 7, "scattered_starts": 1}, ALONE, id="TransferFunction"),
    pytest.param(PROCESS, None, ALONE, id="ProcessModel"),
    pytest.param(SS, None, ALONE, id="SS"),
    pytest.param(
        SS | {"noise": False, "nk": "auto"}, {"method": "subspace", "weighting": "CVA"}, ALONE, id="SS by CVA, nk auto"
    ),
    pytest.param(OE, None, ALONE, id="OE"),
    pytest.param(BJ, {"max_iterations": 3}, ALONE, id="BJ"),
    pytest.param(ARMAX, None, ALONE, id="ARMAX"),
    pytest.param(ARMAX | {"nc": 0, "integrated": True}, None, ALONE, id="ARIX"),
    pytest.param(NARX, {"seed": 7, "max_iterations": 4}, EVERYWHERE, id="NARX that runs away"),
    pytest.param(NARX, {"seed": 7, "loop": "open", "max_iterations": 8}, EVERYWHERE, id="NARX one step ahead"),
    pytest.param(NARX, {"seed": 7, "max_iterations": 30, "starts": 3}, EVERYWHERE, id="NARX of several starts"),
    pytest.param(NARX | {"output_delays": []}, {"seed": 7, "max_iterations": 4}, EVERYWHERE, id="NARX of inputs alone"),
    pytest.param(NARX | {"limits": [None, 130]}, {"seed": 7, "max_iterations": 4}, EVERYWHERE, id="NARX with a limit"),
    pytest.param(
        NARX | {"gated": True}, {"seed": 7, "max_iterations": 4, "pretraining": 20, "starts": 3, "ensemble": 2},
        EVERYWHERE, id="NARX gated, an ensemble",
    ),
    pytest.param(NSS, {"seed": 7, "max_iterations": 8, "starts": 2}, ALONE, id="NSS"),
    pytest.param(NSS, {"seed": 7, "max_iterations": 8, "starts": 2, "ensemble": 2}, ALONE, id="NSS, an ensemble"),
    pytest.param(GREY, {"seed": 7, "max_iterations": 12, "starts": 2}, ALONE, id="GreyBox"),
    pytest.param(GREY, {"seed": 7, "starts": 1, "shooting": "multiple"}, ALONE, id="GreyBox, multiple shooting"),
    pytest.param(GREY_BY_CASE, {"seed": 7, "max_iterations": 6, "starts": 1}, ALONE, id="GreyBox by case"),
    pytest.param(VECTOR_GREY, {"seed": 7, "max_iterations": 12, "starts": 1}, ALONE, id="VectorGreyBox, of one"),
    pytest.param(HW, {"seed": 7, "max_iterations": 4, "starts": 2}, ALONE, id="HammersteinWiener"),
    pytest.param(WH, {"seed": 7, "max_iterations": 4, "starts": 2}, ALONE, id="WienerHammerstein"),
    pytest.param(POLYNOMIAL_NARX, {"seed": 7, "max_iterations": 4}, ALONE, id="PolynomialNARX"),
    pytest.param(
        POLYNOMIAL_NARX | {"output_delays": []}, {"seed": 7, "max_iterations": 4}, ALONE, id="polynomial, inputs alone"
    ),
    pytest.param(VECTOR_SS, None, ALONE, id="VectorSS, of one"),
    pytest.param(VECTOR_ARX | {"na": 2, "nk": [1, 0]}, None, ALONE, id="VectorARX, of one"),
    pytest.param(VECTOR_NSS, {"seed": 7, "max_iterations": 4, "starts": 1}, ALONE, id="VectorNSS, of one"),
    pytest.param(VECTOR, {"seed": 7, "max_iterations": 4, "starts": 2}, ALONE, id="NARX of several outputs, of one"),
    pytest.param(
        VECTOR | {"output_delays": []}, {"seed": 7, "max_iterations": 4, "starts": 1}, ALONE,
        id="NARX of several outputs, of inputs alone",
    ),
]  # fmt: skip


def as_request(structure: dict[str, Any], training: dict[str, Any] | None) -> dict[str, Any]:
    return {"structure": structure, **({} if training is None else {"training": training})}


def options_of(structure: dict[str, Any], training: dict[str, Any] | None) -> Any:
    """Options as Python has them; of the class that suits them where the structure takes none."""
    if training is None:
        return None
    return (ESTIMATORS[structure["kind"]].training or sysid.Training)(**training)


def in_python(
    place: Path, structure: dict[str, Any], training: dict[str, Any] | None, initial: FitResult | None = None
) -> FitResult:
    return sysid.fit(
        sysid.load(place / "datasets" / "rig" / "dataset.yaml"), MAPPING, structure_from_dict(structure),
        options_of(structure, training), start=Start(), rest_output=100.0, initial=initial,
        stability=StabilityOptions(**STABILITY),
    )  # fmt: skip


def in_a_pipeline(place: Path, *fits: dict[str, Any], shared: dict[str, Any] = SHARED) -> FitResult:
    """The last of some fits."""
    named = [{"name": f"fit {number}", **fit} for number, fit in enumerate(fits)]
    text = yaml_text({"name": "doors", **shared, "fits": named})
    pipeline = Pipeline(config=parse_pipeline(text), text=text, path=place / "pipelines" / "doors.yaml")
    carry_out(program_of(pipeline), place / "runs" / "doors", command="")
    return read_fit(place / "runs" / "doors" / "fits" / pipeline.config.fits[-1].slug)


def in_a_sweep(place: Path, structure: dict[str, Any], training: dict[str, Any] | None, **more: Any) -> FitResult:
    fields = {"kind": "sweep", "name": "swept", **SHARED, "structure": structure, "training": training or {}, **more}
    config = check(SweepConfig, fields, where="here")
    sweep = Sweep(config=config, text=yaml_text(fields), path=place / "pipelines" / "swept.yaml")
    carry_out(
        program_of_sweep(sweep, find_workers=lambda bench, _: InThisProcess(bench)),
        place / "runs" / "swept",
        command="",
    )
    return read_fit(place / "runs" / "swept" / "fits" / "sweep-winner")


def as_a_member(place: Path, structure: dict[str, Any], training: dict[str, Any] | None) -> FitResult:
    fields = {"mapping": MAPPING, "rest": 100.0, **as_request(structure, training)}
    member = check(MemberConfig, fields, where="here").member(0, StabilityOptions(**STABILITY))
    traces: TraceSet = sysid.load(place / "datasets" / "rig" / "dataset.yaml")
    return fit_member(member, traces.with_role(Role.ESTIMATION), traces.with_role(Role.SELECTION))


DOORS: dict[str, Callable[[Path, dict[str, Any], dict[str, Any] | None], FitResult]] = {
    "python": in_python,
    "fits": lambda place, structure, training: in_a_pipeline(place, as_request(structure, training)),
    "sweep": in_a_sweep,
    "member": as_a_member,
}


def said(fit: FitResult) -> dict[str, Any]:
    """All that a fit says of itself but the time that it took; numbers to the last bit."""
    found = fit.to_dict()
    del found["train_time_s"]
    found["history"].pop("elapsed_s", None)
    for attempt in found["attempts"]:
        del attempt["elapsed_s"]
    if fit.posterior is not None:
        found["posterior"] = {name: values.tolist() for name, values in fit.posterior.to_arrays().items()}
    told: dict[str, Any] = strict(found)  # so that what is not a number is the same as itself
    return told


@pytest.fixture
def place(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A workspace in which no report is written, nor many first blocks are tried: it is not what is compared."""

    def no_report(folder: Path) -> Path:
        (folder / "page").touch()
        return folder / "page"

    monkeypatch.setattr("sysid.reporting.report.write_report", no_report)
    monkeypatch.setattr("sysid.estimation.blocks.first_block.DRAWN", 20)
    monkeypatch.setattr("sysid.estimation.blocks.first_block.EVALUATIONS", 6)
    return workspace


@pytest.mark.parametrize(("structure", "training", "doors"), FITS)
def test_a_fit_is_the_same_at_every_door(
    place: Path, structure: dict[str, Any], training: dict[str, Any] | None, doors: tuple[str, ...]
) -> None:
    first, *others = (said(DOORS[door](place, structure, training)) for door in doors)
    for door, other in zip(doors[1:], others, strict=True):
        assert {name: other[name] for name in first if other[name] != first[name]} == {}, door
    assert (first["stability"] is None) == (ESTIMATORS[structure["kind"]].stability.by_poles)


def test_every_kind_of_structure_goes_through_the_doors() -> None:
    assert {one.values[0]["kind"] for one in FITS} == set(ESTIMATORS)


TWO = {"data": "rig", "mapping": "inlet+valve -> outlet+valve2", "start": "rest", "rest": {"outlet": 100.0}}
TWO |= {"stability": STABILITY, "export": None}


@pytest.mark.parametrize(
    ("structure", "training"),
    [
        pytest.param(VECTOR, {"seed": 7, "max_iterations": 3}, id="VectorNARX"),
        pytest.param(SS | {"kind": "VectorSS"}, None, id="VectorSS"),
        pytest.param(VECTOR_ARX, None, id="VectorARX"),
        pytest.param(VECTOR_NSS, {"seed": 7, "max_iterations": 3, "starts": 2}, id="VectorNSS"),
    ],
)
def test_several_outputs_are_the_same_at_every_door(
    place: Path, structure: dict[str, Any], training: dict[str, Any] | None
) -> None:
    folder = place / "datasets" / "rig"
    described = (folder / "dataset.yaml").read_text(encoding="utf-8")
    second = "  - {name: valve2, unit: V}\nsource: {files: {references: gauge, columns: {valve2: valve}}}"
    (folder / "dataset.yaml").write_text(
        described.replace("source: {files: {references: gauge}}", second), encoding="utf-8"
    )
    python = sysid.fit(
        sysid.load(folder / "dataset.yaml"), str(TWO["mapping"]), structure_from_dict(structure),
        options_of(structure, training), start=Start(), rest_output={"outlet": 100.0},
        stability=StabilityOptions(**STABILITY),
    )  # fmt: skip
    assert isinstance(python, sysid.Fit)
    fits = in_a_pipeline(place, as_request(structure, training), shared=TWO)
    swept = in_a_sweep(place, structure, training, **TWO)
    assert said(python) == said(fits) == said(swept)


@pytest.mark.parametrize(
    "first", [ARX, NARX | {"neurons": 1}, NARX], ids=["an ARX model", "a smaller network", "the same network"]
)
def test_a_network_begins_at_an_earlier_fit_in_python_and_in_yaml(place: Path, first: dict[str, Any]) -> None:
    training = {"seed": 3, "max_iterations": 6}
    begun = None if first is ARX else {**training, "loop": "open"}
    python = in_python(place, NARX, training, initial=in_python(place, first, begun))
    yaml = in_a_pipeline(place, as_request(first, begun), as_request(NARX, training) | {"initial": "fit 0"})
    assert said(python) == said(yaml)


def test_a_sweep_begins_a_network_at_the_next_smaller_one_as_python_does(place: Path) -> None:
    training = {"seed": 3, "max_iterations": 20}
    swept = in_a_sweep(
        place, NARX | {"neurons": {"from": 1, "to": 2}}, training, warm_start="smaller", stability={"count": 0}
    )
    smaller = in_python(place, NARX | {"neurons": 1}, training)
    larger = in_python(place, NARX, training, initial=smaller)
    assert swept.model.to_dict() in [smaller.model.to_dict(), larger.model.to_dict()]


WRONG = {
    "a training for an ARX model": (ARX, {"starts": 5}, "an ARX model takes no training", EVERYWHERE),
    "lagged options for hidden states": (
        NSS,
        {"pretraining": 100},
        "state space is not trained with pretraining",
        EVERYWHERE,
    ),
    "an open loop of hidden states": (NSS, {"loop": "open"}, "a neural state space has no open loop", EVERYWHERE),
    "an open loop of equations": (GREY, {"loop": "open"}, "a grey box has no open loop", ALONE),
    "a parameter that is not there": (
        GREY | {"parameters": {"gain": 1, "level": 80}},
        None,
        "nothing says what lag is",
        ALONE[:2],
    ),
    "a record of a case that is not fitted, at rest": (
        GREY_BY_CASE | {"cases": {}},
        None,
        "run-2 is none of those that are fitted",
        ALONE[:2],
    ),
    "an unknown choice": (NARX, {"choose_by": "dice"}, "unknown value of choose_by", EVERYWHERE),
    "shooting without equations": (NARX, {"shooting": "multiple"}, "has no equations to shoot with", EVERYWHERE),
    "no iterations": (NARX, {"max_iterations": 0}, "max_iterations is too small", EVERYWHERE),
    "negative starts": (TF, {"scattered_starts": -1}, "scattered_starts is negative", EVERYWHERE),
    "orders for three inputs of two": (
        ARX | {"nb": [1, 1, 1], "nk": 1},
        None,
        "the orders do not match the inputs",
        ALONE,
    ),
    "poles for three inputs of two": (TF | {"poles": [1, 1, 1], "zeros": 0, "delays": 1}, None, "do not match", ALONE),
    "delays for three inputs": (NARX | {"input_delays": [[1], [1], [1]]}, None, "do not match", EVERYWHERE),
}


@pytest.mark.parametrize(("structure", "training", "words", "doors"), WRONG.values(), ids=list(WRONG))
def test_what_does_not_apply_is_refused_in_the_same_words_at_every_door(
    place: Path, structure: dict[str, Any], training: dict[str, Any] | None, words: str, doors: tuple[str, ...]
) -> None:
    remedies = set()
    for door in doors:
        with pytest.raises(ConfigError, match=words) as caught:
            DOORS[door](place, structure, training)
        remedies.add(caught.value.remedy or "correct the value")
    assert len(remedies) == 1, remedies


@pytest.mark.parametrize(
    ("structure", "first", "words"),
    [
        (ARX, NARX, "an ARX model takes no initial fit"),
        (TF, ARX, "a transfer function takes no initial fit"),
        (NSS, NARX, "the initial fit has other hidden states"),
        (NARX, NARX | {"neurons": 3}, "the initial fit is not contained"),
        (NARX, ARX | {"na": 2}, "the initial fit is not contained"),
        (NARX, TF, "the initial fit is not contained"),
    ],
    ids=["ARX", "transfer function", "state space", "larger network", "longer lags", "no lags"],
)
def test_an_initial_fit_that_cannot_be_is_refused_in_the_same_words(
    place: Path, structure: dict[str, Any], first: dict[str, Any], words: str
) -> None:
    begun = {"max_iterations": 1} if first["kind"] == "NARX" else None
    with pytest.raises(ConfigError, match=words) as python:
        in_python(place, structure, None, initial=in_python(place, first, begun))
    with pytest.raises(ConfigError, match=words) as yaml:
        in_a_pipeline(place, as_request(first, begun), as_request(structure, None) | {"initial": "fit 0"})
    assert yaml.value.remedy == python.value.remedy


@pytest.mark.parametrize(
    ("structure", "training", "words"),
    [
        (NARX, {"ensemble": 2, "starts": 1}, "an ensemble of a single start"),
        (GREY, {"regularisation": 0.1}, "nothing to regularise"),
        (POLYNOMIAL_NARX, {"regularisation": 0.1}, "nothing to regularise"),
        (HW, {"regularisation": 0.1}, "nothing to regularise"),
        (TF, {"max_delay": 3}, "no dead time is searched"),
        (SS, {"max_delay": 3}, "no dead time is searched"),
    ],
    ids=["ensemble of one", "equations", "polynomial", "blocks", "transfer function", "state space"],
)
def test_an_option_that_changes_nothing_is_refused_and_not_ignored(
    place: Path, structure: dict[str, Any], training: dict[str, Any], words: str
) -> None:
    with pytest.raises(ConfigError, match=words) as python:
        in_python(place, structure, training)
    with pytest.raises(ConfigError, match=words) as yaml:
        in_a_pipeline(place, as_request(structure, training))
    assert yaml.value.remedy == python.value.remedy


@pytest.mark.parametrize(
    ("structure", "training"),
    [
        (NARX, {"max_iterations": True}),
        (NARX, {"tolerance": True}),
        (NARX, {"seed": True}),
        (TF, {"stable": 0}),
        (SS, {"max_time_s": True}),
        (VECTOR, {"starts": True}),
    ],
)
def test_a_truth_is_no_number_at_any_door(structure: dict[str, Any], training: dict[str, Any]) -> None:
    """``max_iterations: true`` was one iteration in YAML, and is refused in Python."""
    with pytest.raises(ConfigError):
        options_of(structure, training)
    text = yaml_text({"name": "doors", **SHARED, "fits": [{"name": "one", **as_request(structure, training)}]})
    with pytest.raises(ConfigError, match="cannot be used as it is"):
        parse_pipeline(text)


def test_an_initial_fit_of_other_channels_is_refused(place: Path) -> None:
    traces = sysid.load(place / "datasets" / "rig" / "dataset.yaml")
    other = sysid.fit(traces, "valve+inlet -> outlet", structure_from_dict(ARX))
    with pytest.raises(ConfigError, match="of another mapping"):
        in_python(place, NARX, None, initial=other)


def test_options_of_another_structure_are_refused(place: Path) -> None:
    traces = sysid.load(place / "datasets" / "rig" / "dataset.yaml")
    with pytest.raises(ConfigError, match="a transfer function takes other options"):
        sysid.fit(traces, MAPPING, structure_from_dict(TF), sysid.Training())
    lags = sysid.VectorNARX(input_delays=1, output_delays=1, neurons=1)
    with pytest.raises(ConfigError, match=r"Training\(max_iterations=7\), which has no robust_scale"):
        sysid.fit(traces, MAPPING, lags, sysid.JointTraining(max_iterations=7, robust_scale=2.0))
