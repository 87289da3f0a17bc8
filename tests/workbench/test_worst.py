"""``sysid worst``: new sequences, the surrogate beside the reference, and what it is worst at as a data set."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.export import Bundle, export_bundle
from sysid.ingest import DatasetDescription, find_dataset, load_dataset, read_description
from sysid.models import ARX, ARXModel, Cascade, Mapping
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.workbench.cli import run_cli
from sysid.workbench.worst import Kept, drawn, errors_of

LIKE = """
name: short
sample_time: 0.1
channels:
  - {name: STP, unit: psi, reference: gauge, description: "The handle; 0 is the emergency"}
  - {name: BC, unit: psi, reference: gauge, decimals: 3}
source: {generator: abdx, options: {pairs: 1}}
cases:
  FULL: {role: estimation, recipe: {command: [[0, 90], [5, 64.2], [20, 64.2]]}}
  RANDOM: {role: estimation, recipe: {random: {seed: 1, duration: 30, hold: [2, 10], recharge: [5, 10]}}}
licence: MIT
"""


@pytest.fixture
def like(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "short" / "dataset.yaml"
    path.parent.mkdir()
    path.write_text(LIKE)
    return path


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    """A cylinder that is always empty: its error is what the reference's does."""
    model = ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.zeros(2), intercept=0.0, mapping=Mapping.parse("STP -> BC"),
        sample_time=0.1, input_units=("psi",), output_unit="psi", rest_output=0.0,
    )  # fmt: skip
    record = Trace(
        name="EST", sample_time=0.1, channels=(Channel(name="STP", unit="psi"), Channel(name="BC", unit="psi")),
        values=np.zeros((20, 2)),
    )  # fmt: skip
    traces = TraceSet(name="t", traces=(record,), roles={"EST": Role.ESTIMATION})
    return export_bundle(Cascade(models=(model,)), traces, tmp_path_factory.mktemp("w") / "bundle", formats=[])


def described(path: Path) -> DatasetDescription:
    return read_description(find_dataset(path))


def words(bundle: Bundle, like: Path, into: Path, **changed: str) -> list[str]:
    options = {"like": str(like), "case": "RANDOM", "seeds": "10:16", "output": "BC", "keep": "6", "into": str(into)}
    return [
        "worst",
        str(bundle.folder),
        *(word for name, one in (options | changed).items() for word in (f"--{name}", one)),
    ]


def test_the_worst_are_kept_as_a_data_set_that_loads(bundle, like, tmp_path, capsys):
    into = tmp_path / "datasets" / "found"
    assert run_cli(words(bundle, like, into)) == 0
    found = load_dataset(into)
    sequences = drawn(described(like), "RANDOM", range(10, 17), where=like)
    errors = dict(zip(sequences.cases, errors_of(bundle, sequences, "BC", where=like), strict=True))
    worst = sorted(errors, key=lambda name: -errors[name])[:6]
    # Of each five the middle one chooses, so that both hold some of the worst.
    assert found.roles == {
        **{name: Role.ESTIMATION for name in worst if name != worst[2]},
        worst[2]: Role.SELECTION,
    }
    for trace in found:
        assert np.sqrt(np.mean(trace["BC"] ** 2)) == pytest.approx(errors[trace.name])
    assert found.name == "found"
    text = (into / "dataset.yaml").read_text()
    assert text.startswith("# Made by:  sysid worst ")
    assert "5 for training, 1 that choose" in text.replace("\n ", "")
    assert f"the worst {max(errors.values()):.3g} psi" in capsys.readouterr().out


def test_a_sequence_is_the_reference_at_another_seed(like):
    given = described(like).cases["RANDOM"].recipe
    sequences = drawn(described(like), "RANDOM", [1, 2], where=like)
    assert sequences.cases["N1"].recipe == given
    assert sequences.cases["N2"].recipe == {"random": {**given["random"], "seed": 2}}


def test_a_run_that_leaves_all_numbers_is_the_worst_of_all():
    names, errors = ["a", "b", "c"], np.array([1.0, np.inf, 2.0])
    assert Kept.of(names, errors, 2) == Kept(training=("b", "c"), choosing=())


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"seeds": "16:10"}, "these are no seeds.*130000:132999"),
        ({"keep": "8"}, "so many cannot be kept.*1 to 7"),
        ({"output": "BP"}, "no such output.*one of BC"),
        ({"case": "FULL"}, "no other sequences can be drawn.*a recipe without a seed"),
        ({"case": "HALF"}, "no such case.*FULL, RANDOM"),
    ],
)
def test_what_cannot_be_searched_is_refused(bundle, like, tmp_path, capsys, *, changed: dict[str, Any], said: str):
    assert run_cli(words(bundle, like, tmp_path / "found", **changed)) == 2
    assert re.search(said, capsys.readouterr().err, flags=re.DOTALL)
    assert not (tmp_path / "found").exists()


def test_a_data_set_that_is_there_is_kept(bundle, like, capsys):
    before = like.read_text()
    assert run_cli(words(bundle, like, like.parent)) == 2
    assert "there is a data set already" in capsys.readouterr().err
    assert like.read_text() == before


def test_a_data_set_out_of_files_has_no_seeds(like):
    files = described(like).model_copy(
        update={"cases": {"A": described(like).cases["FULL"].model_copy(update={"recipe": None})}}
    )
    with pytest.raises(ConfigError, match="a case out of a file"):
        drawn(files, None, [1], where=like)
