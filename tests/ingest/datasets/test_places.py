"""Where the files of a data set lie, and whether they are the ones that it means."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.ingest import load_dataset

CSV = "u [V],y [V]\n" + "".join(f"{k},{k + 1}\n" for k in range(12))
TEXT = """
name: away
sample_time: 0.5
channels: [{{name: u, unit: V}}, {{name: y, unit: V}}]
source:
  folder_from: RECORDS
  sha256: {{rig/one.csv: {digest}}}
  files: {{time: {{step: 0.5}}}}
cases:
  a: {{role: estimation, file: rig/one.csv}}
provenance: the owner's page
"""


@pytest.fixture
def described(tmp_path: Path) -> Path:
    """A description in one folder; its record lies in another, which nothing names yet."""
    (tmp_path / "records" / "rig").mkdir(parents=True)
    (tmp_path / "records" / "rig" / "one.csv").write_text(CSV, encoding="utf-8")
    file = tmp_path / "away" / "dataset.yaml"
    file.parent.mkdir()
    file.write_text(TEXT.format(digest=hashlib.sha256(CSV.encode()).hexdigest()), encoding="utf-8")
    return file


def test_files_are_read_from_the_folder_that_the_variable_names(
    described: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RECORDS", str(tmp_path / "records"))
    assert load_dataset(described)["a"]["y"].tolist() == [float(k) for k in range(1, 13)]


@pytest.mark.parametrize("folder", [None, "nowhere"])
def test_without_the_folder_it_says_what_to_fetch_and_how_to_name_it(
    described: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str | None
) -> None:
    monkeypatch.delenv("RECORDS", raising=False)
    if folder is not None:
        monkeypatch.setenv("RECORDS", str(tmp_path / folder))
    with pytest.raises(ConfigError, match="not part of this package") as caught:
        load_dataset(described)
    assert "rig/one.csv" in str(caught.value)
    assert "the owner's page" in str(caught.value)
    assert "RECORDS=FOLDER" in str(caught.value)


def test_another_content_than_the_one_described_is_refused(
    described: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RECORDS", str(tmp_path / "records"))
    (tmp_path / "records" / "rig" / "one.csv").write_text(CSV.replace("11,12", "11,13"), encoding="utf-8")
    with pytest.raises(ConfigError, match="not the one that the data set was described for"):
        load_dataset(described)


def test_a_generator_has_no_folder(described: Path) -> None:
    described.write_text(
        described.read_text("utf-8")
        .replace("  files: {time: {step: 0.5}}", "  generator: abdx")
        .replace("file: rig/one.csv", "recipe: {}"),
        encoding="utf-8",
    )
    with pytest.raises(ConfigError, match="means nothing here"):
        load_dataset(described)
