"""Fits the three systems with Octave's control package (SLICOT IB01), where it is there, in one run of Octave."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy

from sysid.errors import UserError
from sysid.export.languages.octave import octave
from tests.benchmarks._linear_systems import ORDERS, SAMPLES, fit_percent, systems

SCRIPT = """% moesp of control 3.4.0 ends with an error of SLICOT's
pkg load control
warning('off', 'all');
for f = glob('*.mat')'
  z = load(f{1});
  for method = {'n4sid', 'moen4'}
    try
      began = cputime; s = feval(method{1}, iddata(z.y, z.u, 1), z.n, 's', 20); spent = cputime - began;
      [r.A, r.B, r.C, r.D] = ssdata(s); r.file = f{1}; r.method = method{1}; r.seconds = spent;
      disp(jsonencode(r));
    end
  end
end
"""


def octave_fits(seeds: range) -> Iterator[tuple[str, str, float, float]]:
    """System, method, fit in percent and processor time of every fit; nothing where Octave or its package is missing.

    Args:
        seeds: Of the systems.
    """
    try:
        program = octave()
    except UserError:
        return
    folder, known = Path(tempfile.mkdtemp()), {}
    try:
        for seed in seeds:
            for name, (u, y, clean) in systems(seed).items():
                file = f"{name}-{seed}.mat"
                known[file] = (name, u, clean)
                scipy.io.savemat(folder / file, {"u": u[:SAMPLES], "y": y[:SAMPLES], "n": float(ORDERS[name])})
        (folder / "main.m").write_text(SCRIPT)
        command = [program, "--norc", "--quiet", "main.m"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # 1 as it ends
        for line in done.stdout.splitlines():
            found = json.loads(line)
            name, u, clean = known[found["file"]]
            m, p, n = u.shape[1], clean.shape[1], ORDERS[name]
            A, B, C, D = (
                np.array(found[part], dtype=np.float64).reshape(shape)
                for part, shape in zip("ABCD", ((n, n), (n, m), (p, n), (p, m)), strict=True)
            )
            run = scipy.signal.dlsim((A, B, C, D, 1.0), u)[1]
            yield name, f"Octave {found['method']}", fit_percent(clean, run), found["seconds"]
    finally:
        shutil.rmtree(folder)
