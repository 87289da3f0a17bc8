"""What is optional: the table of extras, and that nothing in the base needs any of them."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from sysid.errors import MissingExtraError
from sysid.export import EXPORTERS, exporters
from sysid.extras import EXTRAS, has, need

ROOT = Path(__file__).resolve().parent.parent
DECLARED = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]

BASE = """
import importlib, importlib.util, pkgutil, sys
blocked = set(sys.argv[1].split(","))
class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in blocked:
            raise ModuleNotFoundError(name, name=name)
sys.meta_path.insert(0, Blocker())
real = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name in blocked else real(name, package)
import sysid
from sysid.errors import MissingExtraError
for module in pkgutil.walk_packages(sysid.__path__, "sysid."):
    try:
        importlib.import_module(module.name)
    except MissingExtraError:
        print(module.name)
    except ModuleNotFoundError as error:
        print(module.name, error.name.partition(".")[0])
import numpy as np
u = np.random.default_rng(0).standard_normal(200)
y = np.convolve(u, 0.5 ** np.arange(20))[:200]
traces = sysid.data({"u": u, "y": y}, inputs="u", outputs="y", sample_time=0.1)
fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=0))
sysid.compare(traces, fit)
try:
    fit.to_frame() if hasattr(fit, "to_frame") else sysid.compare(traces, fit).to_frame()
except MissingExtraError as error:
    print(error.remedy)
import warnings
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    print(",".join(sorted({file.format for file in fit.save(sys.argv[2]).files})))
print(*(entry.message for entry in said))
"""


def lacking(monkeypatch: pytest.MonkeyPatch, *packages: str) -> None:
    """As on a machine without them."""
    monkeypatch.setattr("sysid.extras.has", lambda package: package not in packages)


def test_every_package_stands_in_its_extra_of_the_project():
    assert set(EXTRAS.values()) | {"all"} == set(DECLARED)


def test_every_extra_has_its_row_in_the_docs():
    text = (ROOT / "docs/install.md").read_text(encoding="utf-8")
    assert [extra for extra in DECLARED if f"| `{extra}` |" not in text] == []


def test_what_is_missing_is_told_with_the_command_that_brings_it(monkeypatch):
    lacking(monkeypatch, "torch")
    with pytest.raises(MissingExtraError) as told:
        need("torch", "the format torchscript")
    assert told.value.remedy == 'pip install "sysid-workbench[torch]"'


def test_base_code_needs_no_extra(tmp_path):
    asked = [sys.executable, "-c", BASE, ",".join(EXTRAS), str(tmp_path / "bundle")]
    done = subprocess.run(asked, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        "sysid.export.onnx.blocks onnx",
        "sysid.export.onnx.core onnx",
        "sysid.export.onnx.equations onnx",
        "sysid.export.onnx.flags onnx",
        "sysid.export.onnx.holds onnx",
        "sysid.export.onnx.limits onnx",
        "sysid.export.onnx.nodes onnx",
        "sysid.export.onnx.outputs onnx",
        "sysid.export.onnx.products onnx",
        "sysid.export.onnx.sequence onnx",
        "sysid.export.onnx.step onnx",
        "sysid.export.torch.equations torch",
        "sysid.export.torch.module torch",
        "sysid.sklearn",
        "sysid.workbench.commands.sweep",
        "sysid.workbench.sweep.run",
        "sysid.workbench.sweep.sampler",
        "sysid.workbench.sweep.sweep_steps",
        'pip install "sysid-workbench[frames]"',
        "c",
        'onnx left out: pip install "sysid-workbench[onnx]"',
    ]


@pytest.mark.parametrize("name", [name for name, one in EXPORTERS.items() if one.packages])
def test_a_format_that_lacks_its_package_is_refused_before_anything_is_computed(name, monkeypatch):
    lacking(monkeypatch, *EXPORTERS[name].packages)
    with pytest.raises(MissingExtraError, match=name) as told:
        exporters.wanted_formats([name])
    assert told.value.remedy == f'pip install "sysid-workbench[{EXTRAS[EXPORTERS[name].packages[0]]}]"'


def test_usual_formats_without_compiler_leave_c_out_and_say_so(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    found = exporters.wanted_formats(None)
    assert found.names == ("onnx",)
    assert found.left_out == ("c left out: install gcc or clang, set CC, or leave these formats out",)


def test_without_any_usual_format_the_first_is_asked_for(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    lacking(monkeypatch, "onnx")
    with pytest.raises(MissingExtraError, match="the format onnx"):
        exporters.wanted_formats(None)


def test_installed_packages_are_found_without_being_imported():
    assert has("numpy")
    assert not has("no_such_package_anywhere")


def test_a_run_that_cannot_be_tracked_says_so_and_goes_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    from sysid.workbench import listeners, trackers
    from sysid.workbench.runner.program import Closing

    monkeypatch.setattr(trackers, "has", lambda package: package != "mlflow")
    assert listeners.Listeners.of(tracking=True).end(Closing(compare=True)) == 0
    said = capsys.readouterr().out
    assert 'pip install "sysid-workbench[mlflow]"' in said
    assert "sysid ui" not in said
