"""A picture that cannot be written takes nothing else with it."""

import numpy as np

from sysid.workbench.commands.orders import orders_command
from sysid.workbench.commands.pictures import kept_picture


def test_a_picture_lies_where_it_is_said_to(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert kept_picture(tmp_path / "a.svg", "<svg ></svg>") == "a.svg"
    assert (tmp_path / "a.svg").read_text(encoding="utf-8").startswith("<svg xmlns=")


def test_orders_are_told_where_the_picture_cannot_be_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rng, y = np.random.default_rng(0), np.zeros(200)
    u = rng.choice([-1.0, 1.0], 200)
    for t in range(1, 200):
        y[t] = 0.8 * y[t - 1] + 0.2 * u[t - 1] + 0.01 * rng.standard_normal()
    rows = [f"{0.1 * t:.1f},{u[t]:g},{y[t]:.6f}" for t in range(200)]
    (tmp_path / "rig.csv").write_text("\n".join(["t [s],u [V],y [V]", *rows]) + "\n", encoding="utf-8")
    (tmp_path / "rig.orders.svg").mkdir()  # in the place of the picture
    orders_command("rig.csv", mapping="u -> y", ranges={"max_na": 2, "max_nb": 2, "max_nk": 2})
    told = capsys.readouterr().out
    assert "picture: none, as rig.orders.svg cannot be written" in " ".join(told.split())
    assert "in a pipeline: structure:" in told


def test_orders_of_several_outputs_are_one_table_and_one_picture_an_output(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    u = np.random.default_rng(0).choice([-1.0, 1.0], 200)
    y = np.convolve(u, 0.2 * 0.8 ** np.arange(40))[:200]
    rows = [f"{0.1 * t:.1f},{u[t]:g},{y[t]:.6f},{-y[t]:.6f}" for t in range(200)]
    (tmp_path / "rig.csv").write_text("\n".join(["t [s],u [V],y [V],z [V]", *rows]) + "\n", encoding="utf-8")
    orders_command("rig.csv", mapping="u -> y+z", ranges={"max_na": 1, "max_nb": 1, "max_nk": 1})
    told = " ".join(capsys.readouterr().out.split())
    assert "of u -> y," in told and "of u -> z," in told
    assert (tmp_path / "rig.y.orders.svg").is_file() and (tmp_path / "rig.z.orders.svg").is_file()
