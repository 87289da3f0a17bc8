"""Runs in the peers' environment: SIPPY's estimates of the records for comparison, one line of JSON each."""

from __future__ import annotations

import contextlib
import io
import json
import warnings

import numpy as np
from _linear_systems import impulse_response, same_estimate

warnings.simplefilter("ignore")
POLYNOMIAL = {
    "ARX": {"ARX_orders": [2, 2, 0]},
    "OE": {"OE_orders": [2, 2, 0], "OE_mod": "OPT"},
    "ARMAX": {"ARMAX_orders": [2, 2, 1, 0], "ARMAX_mod": "OPT"},
}
"""Orders, with SIPPY's count of the dead time; ``OPT`` minimises the error itself."""
SUBSPACE = ("N4SID", "MOESP", "CVA", "PARSIM-K", "PARSIM-S", "PARSIM-P")


def main() -> None:
    """Polynomials in ascending powers of the delay; of state spaces the impulse response."""
    from sippy_unipi import system_identification as identify

    records = same_estimate()
    for name, orders in POLYNOMIAL.items():
        u, y = records[name]
        with contextlib.redirect_stdout(io.StringIO()):
            m = identify(y.T, u.T, name, max_iterations=1_000, **orders)
        line = [*np.ravel(m.NUMERATOR), *np.ravel(m.DENOMINATOR)[1:]]
        line += [np.ravel(m.NUMERATOR_H)[1]] if name == "ARMAX" else []
        print(json.dumps([name, "SIPPY", [float(value) for value in line]]), flush=True)
    u, y = records["2x2"]
    for method in SUBSPACE:
        with contextlib.redirect_stdout(io.StringIO()):
            m = identify(y.T, u.T, method, SS_fixed_order=3)
        print(json.dumps(["2x2", f"SIPPY {method}", impulse_response(m.A, m.B, m.C).tolist()]), flush=True)


if __name__ == "__main__":
    main()
