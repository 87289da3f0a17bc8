"""Functions for MATLAB: as Octave runs them, with a state at rest of their own, and names that MATLAB takes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.export import Surrogate
from sysid.export.differences import largest_difference
from sysid.export.languages.matlab import MatlabExporter, prefix_of
from sysid.export.languages.octave import OctaveError, session
from sysid.models import NARX, Mapping
from tests.export.cascades import build_limited, wired_narx
from tests.export.conftest import usable
from tests.export.grey_boxes import GREY_BOXES


@pytest.fixture(scope="module")
def matlab() -> MatlabExporter:
    found = usable("matlab")
    assert isinstance(found, MatlabExporter)
    return found


def run_from_rest(surrogate: Surrogate, folder: Path, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``<name>_run(u)`` without a state, by a function of ours that calls it so."""
    prefix, n = prefix_of(surrogate), surrogate.state_size
    (folder / "begin.m").write_text(
        f"function [y, state, flags] = begin(u, ~)\n[y, ~, flags] = {prefix}_run(u);\n"
        f"state = {prefix}_rest(u(1, :));\nend\n",
        encoding="utf-8",
    )
    process = session()
    place = process.add(sorted(folder.glob("*.m")))
    y, state, _ = process.run(place, "begin", u, np.zeros(n), len(surrogate.outputs))
    return y, state


@pytest.mark.parametrize("kind", ["a cascade of every kind", "declared states"])
def test_a_run_without_a_state_begins_at_rest(kind, matlab, inputs, tmp_path) -> None:
    source = build_limited() if kind.startswith("a cascade") else GREY_BOXES[kind]()
    surrogate = Surrogate.of(source)
    matlab.write(surrogate, tmp_path)
    u = inputs(60, len(surrogate.inputs))
    y, state = run_from_rest(surrogate, tmp_path, u)
    np.testing.assert_allclose(state, surrogate.at_rest(u[0]), rtol=1e-12, atol=1e-12)
    assert largest_difference(y, surrogate.simulate(u)) <= 1e-9


def test_a_state_that_has_to_be_searched_for_is_asked_for(matlab, inputs, tmp_path) -> None:
    surrogate = Surrogate.of(GREY_BOXES["two outputs"]())
    matlab.write(surrogate, tmp_path)
    with pytest.raises(OctaveError, match=r"initialisation\.state in model\.json"):
        run_from_rest(surrogate, tmp_path, inputs(3, 2))


def test_names_are_short_enough_and_text_stays_in_its_comment(tmp_path) -> None:
    mapping = Mapping(inputs=("P\n%{\nerror('x')\n%}\n" + "long " * 12, "u"), outputs=("x" * 60,))
    model = wired_narx("P+u -> x", NARX(input_delays=1, output_delays=1, neurons=1), 1)
    (file,) = MatlabExporter().write(Surrogate.of(replace(model, mapping=mapping)), tmp_path)
    for name in (file.name, *file.companions):
        assert len(Path(name).stem) <= 63
        lines = (tmp_path / name).read_text(encoding="utf-8").splitlines()
        assert not any(line.strip() in {"%{", "%}"} for line in lines)
        assert all(line.startswith("%") for line in lines if "error('x')" in line)


def test_octave_that_is_not_there_is_said_with_what_helps(monkeypatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("OCTAVE", raising=False)
    with pytest.raises(ConfigError, match="Octave is not there") as told:
        MatlabExporter().check()
    assert "apt-get install octave" in told.value.remedy
