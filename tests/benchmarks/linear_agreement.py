"""SIPPY as a second implementation: where both define the same estimate, both find it.

    python -m tests.benchmarks linear_agreement

Records begin at rest, so that initial states are no matter of opinion: ARX, OE and ARMAX each in its own noise, and two
inputs and two outputs without noise for the subspace methods, which weigh noise each in its own way. Compared are
polynomials, and impulse responses of state spaces, by their largest difference relative to the largest value; without
noise the truth is known, and it is said how far each of us is from that. BJ is left out: SIPPY's
ends at a noise model without a stable inverse, which is another estimate. Octave's control package is held to the same
in ``tests/estimation/test_octave_control.py``.
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np

from sysid.estimation.fitting import fit
from sysid.models import ARMAX, ARX, OE, AbstractStructure, VectorStateSpace
from tests.benchmarks._findings import found
from tests.benchmarks._linear_systems import THREE_STATES, impulse_response, same_estimate
from tests.benchmarks.linear_noise import FREE, SUBSPACE, python_of_peers, trace_of

WORKER = Path(__file__).with_name("_linear_agreement_worker.py")
WITHIN = 1e-6
STRUCTURES: dict[str, AbstractStructure] = {
    "ARX": ARX(na=2, nb=2, nk=1, intercept=False),
    "OE": OE(nb=2, nf=2, nk=1, intercept=False),
    "ARMAX": ARMAX(na=2, nb=2, nc=1, nk=1, intercept=False),
}
PAST_OUTPUTS = np.array([1.0, 1.0, -1.0, -1.0])
"""ARX writes past outputs on the other side of the equation."""


def ours() -> dict[str, np.ndarray]:
    """Our estimates of the same records, by name."""
    estimates = {}
    for name, (u, y) in same_estimate().items():
        trace, mapping = trace_of(u, y)
        if name in STRUCTURES:
            told = fit([trace], mapping, STRUCTURES[name], stability=None, rest_output=0.0).uncertainty
            if told is None:
                raise RuntimeError(f"{name} tells no parameters")
            estimates[name] = told.values * PAST_OUTPUTS if name == "ARX" else told.values
            continue
        structure = VectorStateSpace(states=3, intercept=False)
        model = fit([trace], mapping, structure, SUBSPACE, start=FREE, stability=None).model
        plant = model.to_control()
        estimates[name] = impulse_response(plant.A, plant.B, plant.C)
    return estimates


def main() -> None:
    """Both, and how far they are apart."""
    done = subprocess.run([str(python_of_peers()), str(WORKER)], capture_output=True, text=True, check=True)
    estimates = ours()
    for line in done.stdout.splitlines():
        record, tool, values = json.loads(line)
        mine, theirs = estimates[record], np.array(values)
        note = ""
        if record not in STRUCTURES:
            true = impulse_response(*THREE_STATES)
            note = f"from the truth: ours {apart(mine, true):.1e}, theirs {apart(theirs, true):.1e}"
        found(f"{record}: {tool} and ours, largest relative difference", apart(theirs, mine), target=WITHIN, note=note)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """The largest difference of two estimates, relative to the largest value."""
    return float(np.abs(one - other).max() / np.abs(other).max())


if __name__ == "__main__":
    main()
