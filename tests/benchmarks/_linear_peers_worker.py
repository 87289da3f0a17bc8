"""Runs in the peers' environment: fits the three systems with their subspace methods, one line of JSON a fit."""

from __future__ import annotations

import contextlib
import io
import json
import sys
import time
import warnings
from collections.abc import Callable

import numpy as np
from _linear_systems import ORDERS, SAMPLES, fit_percent, systems

warnings.simplefilter("ignore")


def sippy(method: str, u: np.ndarray, y: np.ndarray, n: int) -> Callable[[], np.ndarray]:
    from sippy_unipi import functionsetSIM
    from sippy_unipi import system_identification as identify

    m = identify(y[:SAMPLES].T, u[:SAMPLES].T, method, SS_fixed_order=n)
    return lambda: functionsetSIM.SS_lsim_process_form(m.A, m.B, m.C, m.D, u.T)[1].T


def nfoursid(u: np.ndarray, y: np.ndarray, n: int) -> Callable[[], np.ndarray]:
    import pandas as pd
    from nfoursid.nfoursid import NFourSID

    ins, outs = [f"u{i}" for i in range(u.shape[1])], [f"y{i}" for i in range(y.shape[1])]
    table = pd.DataFrame(np.column_stack([y[:SAMPLES], u[:SAMPLES]]), columns=[*outs, *ins])
    problem = NFourSID(table, output_columns=outs, input_columns=ins, num_block_rows=20)
    problem.subspace_identification()
    ss, _ = problem.system_identification(rank=n)

    def run() -> np.ndarray:
        x, found = np.zeros((n, 1)), []
        for row in u:
            found.append((ss.c @ x + ss.d @ row[:, None])[:, 0])
            x = ss.a @ x + ss.b @ row[:, None]
        return np.array(found)

    return run


def tools() -> dict[str, Callable[..., Callable[[], np.ndarray]]]:
    named = {f"SIPPY {method}": method for method in ("N4SID", "MOESP", "CVA", "PARSIM-K")}
    found = {name: (lambda u, y, n, method=method: sippy(method, u, y, n)) for name, method in named.items()}
    return found | {"nfoursid": nfoursid}


def main() -> None:
    for seed in map(int, sys.argv[1:]):
        for system, (u, y, clean) in systems(seed).items():
            for name, tool in tools().items():
                with contextlib.redirect_stdout(io.StringIO()):
                    try:
                        began = time.process_time()
                        model = tool(u, y, ORDERS[system])
                        seconds = time.process_time() - began
                        fit = fit_percent(clean, np.asarray(model()).reshape(len(u), -1))
                    except Exception as error:  # noqa: BLE001 - a peer may fail in any way, and then has no figure
                        sys.stderr.write(f"{system}, {name}: {error}\n")
                        continue
                print(json.dumps([system, name, fit, seconds]), flush=True)


if __name__ == "__main__":
    main()
