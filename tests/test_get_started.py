"""The way of a newcomer with three files of their own, from the page alone."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from tests import test_readme
from tests.test_readme import BLOCK, ROOT, Command, check, commands, execute

pytestmark = pytest.mark.usefixtures("undrawn")
"""Of what a page shows, these tests look at the words."""

PAGE = ROOT / "docs" / "get-started.md"
MOST_LINES, MOST_COMMANDS = 10, 3


def steps(rng: np.random.Generator, low: float, high: float, shape: tuple[int, int]) -> np.ndarray:
    """So many levels of so many inputs, 20 samples each."""
    return np.repeat(rng.uniform(low, high, shape), 20, axis=0)


def own_files(folder: Path) -> None:
    """Two tanks as a German logger writes them, a motor that MATLAB saved, a heater with a clock."""
    rng = np.random.default_rng(7)
    u, h = steps(rng, 0.0, 4.0, (15, 2)), np.zeros((300, 2))
    h[0] = (10.0, 8.0)
    for k in range(299):
        out = np.sqrt(np.maximum(h[k], 0.0))
        h[k + 1] = h[k] + 0.5 * np.array([u[k, 0] - 0.5 * out[0], 0.4 * u[k, 1] + 0.5 * out[0] - 0.6 * out[1]])
    h += 0.02 * rng.standard_normal(h.shape)
    rows = (";".join([f"{0.5 * k:.1f}", *(f"{x:.3f}" for x in (*u[k], *h[k]))]) for k in range(300))
    text = "\n".join(
        ["time [s];pump [V];valve [V];level_1 [cm];level_2 [cm]", *(row.replace(".", ",") for row in rows)]
    )
    (folder / "rig.csv").write_text(text, encoding="utf-8")

    v, x = steps(rng, 1.0, 3.0, (25, 1))[:, 0], np.zeros(500)
    for k in range(499):
        x[k + 1] = 0.93 * x[k] + 0.1 * np.tanh(v[k] - 1.5) + 0.05 * v[k]
    x += 0.005 * rng.standard_normal(500)
    savemat(folder / "motor.mat", {"uEst": v[:300], "yEst": x[:300], "uVal": v[300:], "yVal": x[300:], "Ts": 0.02})

    p, t = steps(rng, 0.0, 800.0, (15, 1))[:, 0], np.full(300, 20.0)
    for k in range(299):
        t[k + 1] = t[k] + 0.05 * (0.1 * p[k] - (t[k] - 20.0))
    t += 0.05 * rng.standard_normal(300)
    index = pd.date_range("2026-03-01 08:00", periods=300, freq="10s", name="time")
    pd.DataFrame({"power [W]": p.round(1), "temperature [degC]": t.round(2)}, index=index).to_csv(folder / "heater.csv")


def sections() -> list[tuple[str, list[tuple[str, str, str]]]]:
    """Each of the three ways: its title and its blocks."""
    parts = re.split(r"^## (.*)\n", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return [
        (title, BLOCK.findall(text)) for title, text in zip(parts[1::2], parts[2::2], strict=True) if BLOCK.search(text)
    ]


@pytest.mark.parametrize(("title", "blocks"), sections(), ids=[title for title, _ in sections()])
def test_a_newcomer_s_way_is_as_the_page_tells_it(
    title: str,
    blocks: list[tuple[str, str, str]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(test_readme, "DATA", None)  # a network's digits are the machine's: words are compared
    own_files(tmp_path)
    typed = 0
    said = ""
    for language, name, text in blocks:
        if language == "text":
            check(Command(words="the example", printed=text), said)
        elif name:
            assert len([line for line in text.splitlines() if line.strip()]) <= MOST_LINES
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (tmp_path / name).write_text(text, encoding="utf-8")
            if language == "python":
                said = execute(f"python {name}", capsys, monkeypatch)
        else:
            for command in commands(text):
                check(command, execute(command.words, capsys, monkeypatch))
                typed += 1
    assert typed <= MOST_COMMANDS
    assert len(sections()) == 3
