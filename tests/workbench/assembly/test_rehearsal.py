"""What cannot be wired is said before anything is fitted."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.workbench.commands.run import run_request
from sysid.workbench.kinds import RunRequest

UPPER = "pump+lower -> upper\n    structure: {kind: NARX, input_delays: [[0, 1], [1]]"
DECLARED = "fixed: [{mapping: lower -> near, gains: {lower: 1}, low: 0, high: 9, rest: 0, unit: cm}]\nretrain:"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        pytest.param({UPPER: UPPER.replace("[1]]", "[0]]")}, "lower needs upper", id="two members within a sample"),
        pytest.param(
            {UPPER: UPPER.replace("pump+lower", "pump+near").replace("[1]]", "[0]]"), "retrain:": DECLARED},
            "near needs lower",
            id="through a declared member",
        ),
        pytest.param(
            {"lower: 0.1}\n": "lower: 0.1}\n  again: [{reads: {upper: {lower: 1}}}]\n"},
            "reads some of these lags already",
            id="in a later round",
        ),
    ],
)
def test_it_is_refused_and_nothing_is_fitted(workspace: Path, changes: dict[str, str], said: str) -> None:
    file = workspace / "pipelines" / "tanks.yaml"
    text = file.read_text(encoding="utf-8")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=said):
        run_request(RunRequest(path=file, typed="tanks", fresh=False, tracking=False))
    assert not list((workspace / "runs").glob("tanks/fits/*"))
