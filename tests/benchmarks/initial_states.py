"""Ways to find where a record begins: the map from one sample, estimates from a few, a linear encoder of a few.

    SYSID_DATA=<folder> python -m tests.benchmarks initial_states

Neural state spaces of Cascaded Tanks (2/12, 50 measured samples) and Coupled Electric Drives (3/4, 10), three starts
of a seed each, seeds 0 to 2; free-run errors on the test records after n of their samples, in V and ticks/s. The first
is that of what the model does; *encoder* is the regression of the states that the training records visit on n samples
of inputs and outputs before them (what Beintema, Toth and Schoukens 2021 train as a network); *best* is that of the
state that the rest of the test record itself shows. *At rest* says how far a run that is begun by one sample leaves the
output at which the model has settled with an input held, over half of the output's range.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.models import History, NeuralForm, NeuralStateSpace
from sysid.traces import Trace
from tests.benchmarks._public import checked
from tests.benchmarks.public_neural import Case, fit, piece, trace

Array = NDArray[np.float64]
RIDGE, LEVELS = 1e-3, 16


def records() -> dict[str, tuple[list[Trace], list[Trace]]]:
    data = np.genfromtxt(checked("cascaded_tanks/dataBenchmark.csv"), delimiter=",", names=True)
    tanks = [trace(of, np.column_stack([data[f"u{of}"], data[f"y{of}"]]), 4.0, "V") for of in ("Est", "Val")]
    data = np.genfromtxt(checked("ced/DATAUNIF.csv"), delimiter=",", names=True)
    drives = [trace(n, np.column_stack([data[f"u1{n}"], data[f"z1{n}"]]), 0.02, "1") for n in "12"]
    return {
        "tanks": (tanks[:1], tanks[1:]),
        "drives": ([piece(one, 0, 400) for one in drives], [piece(one, 400, 500) for one in drives]),
    }


def encoded(form: NeuralForm, training: list[Trace], record: Trace, n: int) -> Array:
    """The state after n samples of a record by the linear encoder."""
    rows, states = [], []
    for one in [*training, record]:
        u, y = form.scaled(one.columns(["u"])), form.scaled_outputs(one["y"])
        seen = np.column_stack([x[i : len(x) - n + i] for x in (u, y) for i in range(n)])
        rows.append(np.column_stack([seen, np.ones(len(seen))]))
        begun = form._begun(History(inputs=one.columns(["u"]), output=one["y"]))
        states.append(form.path(u, begun)[n:])
    R, X = np.concatenate(rows[:-1]), np.concatenate(states[:-1])
    E = np.linalg.solve(R.T @ R + RIDGE * np.eye(R.shape[1]), R.T @ X)
    return np.asarray(rows[-1][0] @ E)


def error(form: NeuralForm, record: Trace, n: int, x: Array) -> float:
    y = form.scaling.unscale_columns(form.run(form.scaled(record.columns(["u"])[n:]), x.copy()))
    return float(np.sqrt(np.mean((np.ravel(y) - record["y"][n:]) ** 2)))


def left(form: NeuralForm, record: Trace) -> float:
    """How far runs leave levels at which the model has settled."""
    found = []
    for u in np.quantile(form.scaled(record.columns(["u"])), np.linspace(0.03, 0.97, LEVELS)):
        held, x = np.full((3000, 1), u), np.zeros(form.sizes.states)
        form.run(held, x)
        y = form.run(held[:1], x.copy())[0]
        found.append(np.abs(form.run(held[:300], form.resting(held[0], y)) - y).max())
    return float(max(found))


def main() -> None:
    every = records()
    rows = (
        ("tanks", NeuralStateSpace(states=2, neurons=12), 0.1, 50, (1, 2, 5, 50)),
        ("drives", NeuralStateSpace(states=3, neurons=4), 0.01, 10, (1, 2, 4, 10)),
        ("drives", NeuralStateSpace(states=3, neurons=4, output="absolute"), 0.01, 10, (1, 2, 4, 10)),
    )
    for name, network, weight, n_initial, samples in rows:
        training, test = every[name]
        case = Case(title=name, training=(), parts=(), n_initial=n_initial, grid=(), seeds=1, iterations=200)
        for seed in range(3):
            form = fit(case, training, (network, weight), seed, starts=3).model.recursion
            assert isinstance(form, NeuralForm)
            print(f"{name}, {network.label}, seed {seed}: at rest {left(form, training[0]):.3f}")
            for record in test:
                u, y = record.columns(["u"]), record["y"]
                for n in samples:
                    estimated = error(form, record, n, form.state(History(inputs=u[:n], output=y[:n])))
                    encoder = error(form, record, n, encoded(form, training, record, n))
                    best = error(form, record, n, form._begun(History(inputs=u[n:], output=y[n:])))
                    print(f"  {record.name}, n = {n}: {estimated:.4f}; encoder {encoder:.4f}, best {best:.4f}")


if __name__ == "__main__":
    main()
