"""FMUs as references: both versions, and what is refused."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.errors import ChannelError, ConfigError
from sysid.references.config import ReferenceConfig
from sysid.references.described import Wish, proposed
from sysid.references.fmu import FmuReference, read_fmu
from sysid.references.runs import Case, ReferenceRuns

pytest.importorskip("fmpy")


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model that we export ourselves: y[k] = 0.8 y[k-1] + 0.4 u[k] from a record without noise."""
    u = np.random.default_rng(0).standard_normal(200)
    y = np.zeros(200)
    for k in range(200):
        y[k] = 0.8 * y[k - 1] + 0.4 * u[k] if k else 0.4 * u[0]
    traces = sysid.data({"u": u, "y": y}, inputs="u", outputs="y", sample_time=0.1)
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=0))
    folder = tmp_path_factory.mktemp("fmu") / "bundle"
    fit.save(folder, formats=("fmi2", "fmi3"))
    return folder


def reference(file: Path, **fields: object) -> ReferenceConfig:
    given = {
        **{"fmu": str(file), "sample_time": 0.1, "inputs": {"u": {"range": [-5, 5]}}, "outputs": {"y": {}}},
        "constants": {"y_at_rest": 0.0},
        **fields,
    }
    return ReferenceConfig.model_validate(given).at(file.parent)


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_gives_the_outputs_at_the_end_of_each_sample(bundle: Path, version: int, tmp_path: Path) -> None:
    (file,) = [one for one in bundle.rglob("*.fmu") if f"fmi{version}" in str(one) or f"fmu{version}" in str(one)]
    u = np.r_[0.0, 0.0, np.random.default_rng(1).standard_normal(40)]
    with ReferenceRuns(config=reference(file), folder=tmp_path, workers=1) as runs:
        (one,) = runs.run([Case(name="a", inputs=u[:, np.newaxis])])
    y = np.zeros(len(u))
    for k in range(1, len(u)):
        y[k] = 0.8 * y[k - 1] + 0.4 * u[k]
    assert one.reason is None
    assert one.trace is not None
    np.testing.assert_allclose(one.trace["y"], y, atol=1e-9)
    assert one.before["y"] == pytest.approx(0.0, abs=1e-9)
    assert one.cpu_s > 0.0


def test_a_parameter_may_set_a_variable_of_another_name(bundle: Path, tmp_path: Path) -> None:
    file, still = next(bundle.rglob("*.fmu")), np.zeros((3, 1))
    given = {"constants": {}, "parameters": {"from": {"range": [1, 2], "variable": "y_at_rest"}}}
    config = reference(file, **given)
    with ReferenceRuns(config=config, folder=tmp_path, workers=1) as runs:
        (one,) = runs.run([Case(name="a", inputs=still, parameters={"from": 2.0})])
    assert one.trace is not None
    np.testing.assert_allclose(one.trace["y"], 2.0 * 0.8 ** np.arange(1, 4), rtol=1e-9)
    np.testing.assert_array_equal(one.trace["from"], 2.0)
    wish = Wish(ranges={"u": (0, 1)}, parameters={"y": (1, 2)}, outputs=("y",), sample_time=0.1, duration=1.0)
    fields, _, _ = proposed(file, wish)
    assert fields["parameters"] == {"y_start": {"unit": "1", "range": [1, 2], "variable": "y"}}
    with pytest.raises(ValueError, match="names a variable"):
        reference(file, fmu=None, python="a:b", **given)


def test_ports_and_interfaces_that_are_not_there_are_named(bundle: Path) -> None:
    file = next(bundle.rglob("*.fmu"))
    with pytest.raises(ChannelError, match="missing channel z"):
        FmuReference(reference(file, outputs={"z": {}}))
    with pytest.raises(ConfigError, match="no interface for model-exchange"):
        FmuReference(reference(file, interface="model-exchange"))


def test_version_1_is_refused_in_words(tmp_path: Path) -> None:
    text = (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="1.0" modelName="a" modelIdentifier="a" '
        'guid="{0}" numberOfContinuousStates="0" numberOfEventIndicators="0"></fmiModelDescription>'
    )
    with zipfile.ZipFile(tmp_path / "old.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
    with pytest.raises(ConfigError, match=r"of version 1\.0") as caught:
        read_fmu(tmp_path / "old.fmu")
    assert "FMI 2.0 or 3.0" in str(caught.value.remedy)


def test_a_file_that_is_no_fmu_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.fmu").write_bytes(b"not a zip")
    with pytest.raises(ConfigError, match="no FMU that can be read"):
        read_fmu(tmp_path / "a.fmu")
