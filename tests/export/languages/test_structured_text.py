"""Function blocks for programmable controllers: as MATIEC compiles them, at rest by themselves, and with any names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.export import Surrogate
from sysid.export.differences import largest_difference
from sysid.export.languages.structured_text import StructuredTextExporter
from sysid.models import NARX, Mapping
from tests.export.cascades import build_limited, wired_narx
from tests.export.conftest import usable


def test_reset_puts_a_block_to_rest_at_its_inputs(inputs, tmp_path) -> None:
    """A cascade of every kind of stage, with levels that follow inputs, run from a state that is anything else."""
    exporter, surrogate = usable("st"), Surrogate.of(build_limited())
    (file,) = exporter.write(surrogate, tmp_path)
    u, run = inputs(60, len(surrogate.inputs)), exporter.load(file, tmp_path)
    run(u[::-1, np.newaxis], np.full((1, surrogate.state_size), 0.7))  # the block stands anywhere else
    assert largest_difference(run(u[:, np.newaxis], None).output[:, 0], surrogate.simulate(u)) <= 1e-9


def test_a_block_begins_at_rest_at_the_start_values_of_its_inputs(inputs, tmp_path) -> None:
    surrogate = Surrogate.of(build_limited(), starts={"STP": 80.0, "FLOW": 12.0})
    (file,) = StructuredTextExporter().write(surrogate, tmp_path)
    text = (tmp_path / file.name).read_text(encoding="ascii")
    begin = text[text.index("    state : ARRAY") :]
    numbers = begin[begin.index("[\n") + 1 : begin.index("];")].split(",")
    np.testing.assert_array_equal([float(one) for one in numbers], surrogate.at_rest(np.array([80.0, 12.0])))


def test_text_stays_in_its_comment(tmp_path) -> None:
    mapping = Mapping(inputs=("*) END_FUNCTION_BLOCK (*", "Ölstand\nin"), outputs=("T",))
    model = wired_narx("P+u -> x", NARX(input_delays=1, output_delays=1, neurons=1), 1)
    (file,) = StructuredTextExporter().write(Surrogate.of(replace(model, mapping=mapping)), tmp_path)
    text = (tmp_path / file.name).read_text(encoding="ascii")
    assert text.count("END_FUNCTION_BLOCK") == 1 + text.count("* ) END_FUNCTION_BLOCK ( *")
    assert text.count("(*") == text.count("*)")


def test_matiec_that_is_not_there_is_said_with_what_helps(monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setenv("MATIEC", str(tmp_path))
    with pytest.raises(ConfigError, match="MATIEC is not there") as told:
        StructuredTextExporter().check()
    assert "https://github.com/beremiz/matiec" in told.value.remedy
