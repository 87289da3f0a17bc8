"""The YAML of members: what cannot be meant is refused, and fixed submodels run in the whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.workbench.assembly.member_config import FixedConfig
from sysid.workbench.assembly.runner import read_assembly
from sysid.workbench.commands.run import run_request
from sysid.workbench.kinds import RunRequest
from sysid.yaml_files import parse_yaml

FIELDS = "{mapping: a+b -> d, gains: {a: 2, b: -1}, constant: 0.5, low: -1, high: 3, rest: 0}"


def known(text: str) -> FixedConfig:
    return check(FixedConfig, parse_yaml(text, where="text"), where="text")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"gains: {a: 2, b: -1}": "gains: {a: 2}"}, "gains of a\\+b -> d"),
        ({"gains: {a: 2, b: -1}": "gains: {a: 2, b: {}}"}, "gains"),
        ({"gains: {a: 2, b: -1}": "gains: {a: 2, b: {-1: 3}}"}, "gains"),
        ({"gains: {a: 2, b: -1}": "gains: {a: 2, b: -1, d: {1: 1}}"}, "weights by lag for its own past"),
        ({"low: -1": "low: 1"}, "bounds of d"),
        ({"low: -1, high: 3": "low: 0, high: 0"}, "bounds of d"),
    ],
    ids=[
        "an input without a gain",
        "no lag",
        "a lag of what is to come",
        "lags of its own",
        "rest below low",
        "no room between the bounds",
    ],
)
def test_what_cannot_be_meant_is_refused(change, said):
    text = FIELDS
    for old, new in change.items():
        text = text.replace(old, new)
    with pytest.raises(ConfigError, match=said):
        known(text)


def test_members_read_it_and_the_whole_runs_it(workspace: Path):
    """Two tanks, the lower of which is told the difference that drives it."""
    file = workspace / "pipelines" / "tanks.yaml"
    text = file.read_text(encoding="utf-8").replace(
        "  - mapping: upper -> lower\n    structure: {kind: NARX, input_delays: [0]",
        "  - mapping: head -> lower\n    structure: {kind: NARX, input_delays: [1]",
    )
    declared = (
        "fixed: [{mapping: upper+lower -> head, gains: {upper: 1, lower: -0.3}, low: 0, high: 9, rest: 0, unit: m}]\n"
    )
    file.write_text(text.replace("retrain:", f"{declared}retrain:"), encoding="utf-8")
    assert run_request(RunRequest(path=file, typed="tanks", fresh=False, tracking=False)) == 0
    whole = read_assembly(workspace / "runs" / "tanks")
    ran = whole.simulate(np.full((60, 1), 1.5))
    assert_allclose(ran["head"], np.maximum(ran["upper"] - 0.3 * ran["lower"], 0.0), atol=1e-12)
    assert ran.activity["head"].lost == 0


def test_what_only_the_training_looked_at_is_no_part_of_the_surrogate(workspace: Path):
    file = workspace / "pipelines" / "tanks.yaml"
    declared = "fixed: [{mapping: upper -> near, gains: {upper: 1}, low: 1, high: 2, rest: 1, unit: cm}]\n"
    text = file.read_text(encoding="utf-8").replace("retrain:", f"{declared}retrain:")
    file.write_text(text.replace("targets: {upper: 0.1", "targets: {near: 0.05, upper: 0.1"), encoding="utf-8")
    assert run_request(RunRequest(path=file, typed="tanks", fresh=False, tracking=False)) == 0
    assert set(read_assembly(workspace / "runs" / "tanks").outputs) == {"upper", "lower"}
