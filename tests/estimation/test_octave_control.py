"""A second implementation agrees: GNU Octave's control package, run on the same numbers, to 1e-6.

Its conversions and simulations are those of SLICOT, its ``arx`` is least squares; ``n4sid`` and ``moen4`` (SLICOT IB01)
weigh noise in their own way, so that they define the same estimate as ours where there is none. Octave has no other
estimators of linear models: OE, ARMAX, BJ and the prediction error of state spaces are held to SciPy's least squares
in ``test_second_implementation.py``. Skipped where Octave or the package is missing (``apt install octave-control``).
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from numpy.typing import NDArray

from sysid.errors import UserError
from sysid.estimation import StateSpaceTraining, fit_arx
from sysid.estimation.fitting import fit
from sysid.export.languages import octave as octave_program
from sysid.models import ARX, Mapping, Start, VectorStateSpace
from sysid.models.conversions import c2d, d2c, d2d, reduced, transfer_function
from sysid.traces import Channel, Trace
from tests.estimation.linear_systems import trace_of

T, N = 0.1, 400
A, B, C, D = np.array([[0.8, 0.3], [-0.3, 0.6]]), np.array([[1.0, 0.0], [0.2, 0.7]]), np.array([[1, 0], [0.5, 1]]), 0.0
PLANT = control.ss(
    [[-0.3, 2.0, 0.0], [-2.0, -0.4, 0.1], [0.0, 0.0, -8.0]],
    [[1.0, 0.0], [0.5, 1.0], [1.0, 1.0]],
    [[1.0, 2.0, 0.0], [0.0, 1.0, 1.0]],
    0.1 * np.eye(2),
)
SCRIPT = """
pkg load control
z = dlmread('record.csv'); u = z(:, 1:2); y = z(:, 3:4); r = struct();
r.y = lsim(ss([0.8 0.3; -0.3 0.6], [1 0; 0.2 0.7], [1 0; 0.5 1], zeros(2), 0.1), u);
for f = {@n4sid, @moen4}
  r.(func2str(f{1})) = response(f{1}(iddata(y, u, 0.1), 2, 's', 8));
end
s = arx(iddata(z(:, 5), u(:, 1), 0.1), 'na', 2, 'nb', 2);
[r.b, r.a] = tfdata(s(1, 1), 'vector');  % a second input is the noise
s = arx({EXPERIMENTS}, 'na', 2, 'nb', 2);
[r.b2, r.a2] = tfdata(s(1, 1), 'vector');
G = ss([-0.3 2 0; -2 -0.4 0.1; 0 0 -8], [1 0; 0.5 1; 1 1], [1 2 0; 0 1 1], 0.1 * eye(2), 0);
S = c2d(G, 0.1); t = 0:0.1:2;
[r.zoh.A, r.zoh.B, r.zoh.C, r.zoh.D] = ssdata(S);
r.tustin = response(c2d(G, 0.1, 'tustin'));
[r.d2c.A, r.d2c.B, r.d2c.C, r.d2c.D] = ssdata(d2c(S));
[r.d2d.A, r.d2d.B, r.d2d.C, r.d2d.D] = ssdata(d2d(S, 0.2));
r.hankel = hsvd(G); r.hankel_sampled = hsvd(S);
r.small = response(btamodred(S, 2));
[r.num, r.den] = tfdata(tf(S(1, 1)), 'vector');
puts(jsonencode(r));
""".replace("{EXPERIMENTS}", "iddata({z(1:150, 5), z(151:end, 5)}, {u(1:150, 1), u(151:end, 1)}, 0.1)")
RESPONSE = """
function r = response(s)
  H = freqresp(s, [0.1 1 3 10]); r.re = real(H); r.im = imag(H);
end
"""
FREQUENCIES = np.array([0.1, 1.0, 3.0, 10.0])
Array = NDArray[np.float64]


def record() -> Array:
    """Two inputs, two outputs without noise, and a noisy one of the first input; from formulas."""
    t = np.arange(N)
    u = np.sign([np.sin(0.37 * t) + np.sin(0.11 * t + 1.0) + 0.3 * np.sin(1.7 * t),
                 np.sin(0.23 * t + 0.5) + 0.4 * np.sin(1.3 * t)]).T  # fmt: skip
    x, y, one = np.zeros(2), np.zeros((N, 2)), np.zeros(N)
    for k in range(N):
        y[k], x = C @ x, A @ x + B @ u[k]
        past = [one[k - i] if k >= i else 0.0 for i in (1, 2)]
        before = [u[k - i, 0] if k >= i else 0.0 for i in (1, 2)]
        one[k] = 1.5 * past[0] - 0.7 * past[1] + before[0] + 0.5 * before[1] + 0.1 * np.sin(37.0 * t[k] ** 1.5)
    return np.column_stack([u, y, one])


@pytest.fixture(scope="module")
def octave(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Everything that Octave finds, in one run of it."""
    try:
        program = octave_program.octave()
    except UserError:
        pytest.skip("GNU Octave is not there")
    folder: Path = tmp_path_factory.mktemp("octave")
    np.savetxt(folder / "record.csv", record(), delimiter=",", fmt="%.17g")
    (folder / "response.m").write_text(RESPONSE)
    (folder / "main.m").write_text(SCRIPT)
    ran = subprocess.run(
        [program, "--norc", "--quiet", "--no-history", "main.m"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    if "package" in ran.stderr and "control" in ran.stderr and not ran.stdout:
        pytest.skip("Octave's control package is not there")
    assert ran.stdout, ran.stderr
    return {
        key: {k: np.array(v) for k, v in value.items()} if isinstance(value, dict) else np.array(value)
        for key, value in json.loads(ran.stdout).items()
    }


def frequency_response(system: Any) -> NDArray[np.complex128]:
    """At the frequencies that Octave was asked for."""
    x = np.exp(1j * FREQUENCIES * system.dt) if system.dt else 1j * FREQUENCIES
    return np.asarray(system(x))


def same_response(system: Any, theirs: dict[str, Array]) -> None:
    np.testing.assert_allclose(frequency_response(system), theirs["re"] + 1j * theirs["im"], rtol=1e-6, atol=1e-8)


def same_matrices(system: Any, theirs: dict[str, Array]) -> None:
    for name, values in theirs.items():
        np.testing.assert_allclose(getattr(system, name), values, rtol=1e-6, atol=1e-9)


def test_a_free_run(octave: dict[str, Any]) -> None:
    np.testing.assert_allclose(octave["y"], record()[:, 2:4], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("name", ["n4sid", "moen4"])
def test_subspace_of_a_record_without_noise(name: str, octave: dict[str, Any]) -> None:
    channels = tuple(Channel(name=one, unit="1") for one in ("u", "v", "y", "z"))
    trace = Trace(name="t", sample_time=T, channels=channels, values=record()[:, :4])
    training = StateSpaceTraining(method="subspace", weighting="N4SID", horizon=8)
    structure = VectorStateSpace(states=2, feedthrough=True, intercept=False)
    found = fit([trace], Mapping.parse("u+v -> y+z"), structure, training, start=Start(kind="estimated"))
    same_response(found.model.to_control(), octave[name])


def test_arx_of_one_record_and_of_two(octave: dict[str, Any]) -> None:
    values = record()
    spans = [slice(None)], [slice(0, 150), slice(150, None)]
    for parts, (b, a) in zip(spans, (("b", "a"), ("b2", "a2")), strict=True):
        traces = [trace_of(values[part, :1], values[part, 4], name=str(part), sample_time=T) for part in parts]
        orders = ARX(na=2, nb=(2,), nk=(1,), intercept=False)
        start = Start(kind="measured", n_measured=2)
        model = fit_arx(traces, Mapping.parse("u1 -> y"), orders, start=start).model
        np.testing.assert_allclose(-model.a, octave[a][1:], rtol=1e-6)
        np.testing.assert_allclose(model.b[0], octave[b], rtol=1e-6)


def test_conversions(octave: dict[str, Any]) -> None:
    sampled = c2d(PLANT, T)
    same_matrices(sampled, octave["zoh"])
    same_response(c2d(PLANT, T, "tustin"), octave["tustin"])
    same_matrices(d2c(sampled), octave["d2c"])
    same_matrices(d2d(sampled, 2 * T), octave["d2d"])
    ours = transfer_function(sampled[0, 0])
    np.testing.assert_allclose(ours.num[0][0], octave["num"], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(ours.den[0][0], octave["den"], rtol=1e-6)


def test_balanced_truncation(octave: dict[str, Any]) -> None:
    np.testing.assert_allclose(reduced(PLANT, 2).singular_values, octave["hankel"], rtol=1e-6)
    small = reduced(c2d(PLANT, T), 2)
    np.testing.assert_allclose(small.singular_values, octave["hankel_sampled"], rtol=1e-6)
    same_response(small.system, octave["small"])
