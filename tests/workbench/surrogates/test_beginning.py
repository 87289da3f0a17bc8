"""A surrogate begins where its reference does, whatever its inputs are first; where it does not, that is told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import sysid
from sysid.export import Bundle, export_bundle
from sysid.models import Cascade, Start
from sysid.references.config import ReferenceConfig
from sysid.references.design import Design, drawn
from sysid.references.runs import Case
from sysid.workbench.surrogates.beginning import begun_elsewhere, stood_at
from sysid.workbench.surrogates.proof import prove
from sysid.workbench.surrogates.told import elsewhere

SOURCE = '''
import numpy as np


def from_its_own(time, inputs, parameters):
    """Three lags in a row, of which the last two have stood at what an input of 1 makes of them."""
    return _run(inputs, 1.0)


def from_zero(time, inputs, parameters):
    return _run(inputs, 0.0)


def from_its_inputs(time, inputs, parameters):
    return _run(inputs, inputs[0, 0])


def _run(inputs, begun):
    y, x = np.empty((len(inputs), 1)), [begun] * 3
    for k, u in enumerate(inputs[:, 0]):
        x = [0.8 * one + 0.2 * fed for one, fed in zip(x, (u, *x))]
        y[k, 0] = x[-1]
    return y
'''
DESIGN = Design(duration=40.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the references stand."""
    place = tmp_path_factory.mktemp("beginning")
    (place / "begins.py").write_text(SOURCE, encoding="utf-8")
    return place


def reference(folder: Path, function: str, **more: float) -> ReferenceConfig:
    ports = {"inputs": {"u": {"unit": "V", "range": [0, 2]}}, "outputs": {"y": {"unit": "V"}}}
    return ReferenceConfig.model_validate(
        {"python": f"begins.py:{function}", "folder": str(folder), "sample_time": 0.5, **ports, **more}
    )


@pytest.mark.parametrize(
    ("function", "more", "stood"),
    [
        pytest.param("from_its_own", {}, {"u": 1.0}, id="at a state of its own"),
        pytest.param("from_zero", {}, {"u": 1.0}, id="at a state that it would rest at elsewhere"),
        pytest.param("from_its_inputs", {}, {}, id="at rest at its first inputs"),
        pytest.param("from_its_own", {"settling": 60.0}, {}, id="after it has settled at them"),
    ],
)
def test_two_runs_more_tell_where_a_reference_begins(
    folder: Path, function: str, more: dict[str, float], stood: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(folder / "cache"))
    case = Case(name="EST001", inputs=np.ones((80, 1)))
    assert stood_at(reference(folder, function, **more), case, [2.0]) == stood


def test_experiments_that_begin_elsewhere_are_those_from_where_inputs_are_farthest_from_where_they_begin(
    folder: Path,
) -> None:
    config = reference(folder, "from_its_own")
    cases = drawn(config, DESIGN, 8, seed=(5,), prefix="N")
    found = begun_elsewhere(config, cases)
    assert len(found) == 8
    for case, one in zip(cases, found, strict=True):
        half = case.inputs[: len(case.inputs) // 2]
        assert abs(one.inputs[0, 0] - 1.0) == np.abs(half - 1.0).max()
        np.testing.assert_array_equal(one.inputs, case.inputs[-len(one.inputs) :])
    still = [replace(one, inputs=np.ones((80, 1))) for one in cases]
    assert begun_elsewhere(config, still) == []


def test_inputs_that_stood_somewhere_are_in_every_file_and_a_proof_says_what_it_is_without(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(folder / "cache"))
    config = reference(folder, "from_its_own")
    traces = sysid.experiment(config.model_dump(exclude_none=True), DESIGN.model_dump(), workers=1)
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=3, nb=4, nk=0), rest_output=1.0)
    begun = {"without": fit, "with": Cascade(models=(fit.model,), rest={"u": 1.0})}
    exported = {
        name: export_bundle(
            one, traces, tmp_path / name, formats=["c"], start=Start(), fits={str(fit.model.mapping): fit}
        )
        for name, one in begun.items()
    }

    def shown(bundle: Bundle) -> tuple[float, list[str]]:
        proof, _ = prove(bundle, config, DESIGN, traces, count=20, workers=1)
        assert (proof.share, proof.n_elsewhere) == (1.0, 6)
        assert f"Of 6 more that begin at other inputs than those do, {100.0 * proof.share_elsewhere:.1f} % are" in (
            proof.sentences()
        )
        return proof.share_elsewhere, elsewhere(proof, {"u": 1.0})

    assert shown(exported["with"]) == (1.0, [])
    share, told = shown(exported["without"])
    assert share < 0.5
    assert told[0].startswith("begun at other inputs than u 1 only")
    assert exported["with"].metadata["stability"]["stable"]
    assert exported["with"].metadata["fit"]["status"] == fit.status.name


def test_nothing_is_told_of_a_beginning_that_does_as_well() -> None:
    nothing = SimpleNamespace(share_elsewhere=float("nan"), share=0.5, n_elsewhere=0)
    poor = SimpleNamespace(share_elsewhere=0.35, share=0.5, n_elsewhere=20)  # as chance may have it
    assert elsewhere(nothing, {"u": 0.0}) == elsewhere(poor, {"u": 0.0}) == []  # type: ignore[arg-type]
