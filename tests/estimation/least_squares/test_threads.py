"""Everything that estimates works in one BLAS thread, whoever asks, and leaves the number of threads as it was."""

import json
import os
import subprocess
import sys

SCRIPT = """
import json
import numpy as np
from threadpoolctl import threadpool_info

def threads():
    return {row["filepath"]: row["num_threads"] for row in threadpool_info() if row["user_api"] == "blas"}

import sysid
u = np.repeat(np.random.default_rng(0).normal(size=20), 10)
traces = sysid.data((u, np.convolve(u, 0.1 * 0.9 ** np.arange(200))[:200]), sample_time=0.1)
seen = {}
import scipy.linalg
before = threads()

def spied(name, does):
    def call(*args, **named):
        for file, n in threads().items():
            seen[file] = max(n, seen.get(file, 0))
        return does(*args, **named)
    return call

for name in ("cholesky", "lstsq", "qr", "svd", "eigh", "solve_triangular"):
    setattr(scipy.linalg, name, spied(name, getattr(scipy.linalg, name)))
words = {
    "advise": lambda: sysid.advise(traces, "u -> y"),
    "impulse_response": lambda: sysid.impulse_response(traces, "u -> y"),
    "search_orders": lambda: sysid.search_orders(traces, "u -> y"),
    "fit": lambda: sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=1)),
}
for word, does in words.items():
    seen.clear()
    does()
    print(json.dumps([word, before, dict(seen), threads()]))
"""


def test_words_work_in_one_thread_of_every_blas() -> None:
    found = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env=os.environ | {"OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2"},
        capture_output=True,
        text=True,
        check=True,
    )
    rows = [json.loads(line) for line in found.stdout.splitlines()]
    assert [word for word, *_ in rows] == ["advise", "impulse_response", "search_orders", "fit"]
    for word, before, during, after in rows:
        assert len(before) >= 2 and set(before.values()) == {2}, "NumPy's and SciPy's have two threads each outside"
        assert set(during.values()) == {1}, word
        assert after == before, word
