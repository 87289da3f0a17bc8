"""One peer on one problem, run by ``peers.py`` in the peers' own environment; prints its result as a line of JSON.

    python _peers_worker.py <tool> <problem.npz> <cap in seconds> [seed]

The problem holds scaled inputs ``u`` (n, n_inputs) and output ``y`` (n,), the range 2 wide and rest at zero before the
first sample, the number of lags and of neurons; ``u_<name>`` and ``y_<name>`` are records that nothing is fitted to.
The result is a learning curve: pairs of processor time in seconds, imports excluded, and mean squared error of the free
run over the training record in scaled numbers; and by name the same error over the other records, of the parameters
that are best on the training record.
"""
# This file runs where neither the project nor its checks are installed: the peers' types are not known here.
# mypy: ignore-errors

import contextlib
import functools
import io
import json
import sys
import time
from dataclasses import dataclass

import numpy as np


class OutOfTimeError(Exception):
    """The cap was reached."""


@dataclass(frozen=True)
class Task:
    """The problem, and the seconds that there are."""

    u: np.ndarray
    y: np.ndarray
    lags: int
    neurons: int
    unseen: dict
    cap: float
    seed: int


def _jax(task, shape):
    """Adam, then L-BFGS until the cap."""
    import os

    # One thread, as the others have: its threads would count twice in processor time.
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    from jax_sysid import _model as tool
    from jax_sysid.models import Model

    n_state, state, output, params = shape()
    model = Model(n_state, 1, task.u.shape[1], state_fcn=state, output_fcn=output)
    model.init(params=params)
    model.loss(rho_x0=0.0, rho_th=1e-8, train_x0=False)
    model.optimization(adam_eta=0.003, adam_epochs=1000, lbfgs_epochs=1_000_000, memory=100, iprint=-1)
    original, states = tool.lbfgs_callback, []

    def watched(*arguments):
        inner, final = original(*arguments)

        def callback(z, *more):
            states.append((time.process_time() - began, [np.asarray(part) for part in z]))
            if time.process_time() - began > task.cap:
                raise OutOfTimeError
            return None if inner is None else inner(z, *more)

        return callback, final

    tool.lbfgs_callback = watched
    began = time.process_time()
    with contextlib.suppress(OutOfTimeError):
        model.fit(task.y[:, None], task.u)
        states.append((time.process_time() - began, [np.asarray(part) for part in model.params]))

    def error(inputs, target):
        predicted = np.asarray(model.predict(np.zeros(n_state), inputs)[0]).ravel()
        return float(np.mean((predicted - target) ** 2))

    curve = []
    places = np.unique(np.geomspace(1, len(states), 40).astype(int)) - 1
    for place in places:
        seconds, model.params = states[place]
        curve.append((seconds, error(task.u, task.y)))
    model.params = states[places[int(np.argmin([entry[1] for entry in curve]))]][1]
    return curve, {name: error(*record) for name, record in task.unseen.items()}


def jax_sysid(task):
    """NARX written as a state space of past samples."""

    def shape():
        import jax
        import jax.numpy as jnp

        n_in, lags, neurons = task.u.shape[1], task.lags, task.neurons
        n_state = lags * (1 + n_in)

        @jax.jit
        def output(x, u, params):
            W, b, v, c, w = params
            return v @ jnp.tanh(W @ x + b) + c + w @ x

        @jax.jit
        def state(x, u, params):
            past_y, past_u = x[:lags], x[lags:]
            fresh = output(x, u, params)
            return jnp.concatenate([fresh, past_y[:-1], u, past_u[:-n_in]])

        rng = np.random.default_rng(task.seed)
        W = rng.standard_normal((neurons, n_state)) / np.sqrt(n_state)
        w = np.zeros((1, n_state))
        w[0, 0] = 0.9
        params = [W, 0.1 * rng.standard_normal(neurons), 0.01 * rng.standard_normal((1, neurons)), np.zeros(1), w]
        return n_state, state, output, params

    return _jax(task, shape)


def jax_sysid_states(task, n_state=2):
    """A neural state space with free states, its weights drawn as in this tool's examples."""

    def shape():
        import jax
        import jax.numpy as jnp

        n_in, neurons = task.u.shape[1], task.neurons

        @jax.jit
        def state(x, u, params):
            A, B, V, W, b, _ = params
            z = jnp.concatenate([x, u])
            return A @ x + B @ u + V @ jnp.tanh(W @ z + b)

        @jax.jit
        def output(x, u, params):
            return params[5] @ x

        rng = np.random.default_rng(task.seed)
        params = [
            0.9 * np.eye(n_state),
            0.1 * rng.standard_normal((n_state, n_in)),
            0.01 * rng.standard_normal((n_state, neurons)),
            rng.standard_normal((neurons, n_state + n_in)) / np.sqrt(n_state + n_in),
            0.1 * rng.standard_normal(neurons),
            np.eye(1, n_state),
        ]
        return n_state, state, output, params

    return _jax(task, shape)


def _fastcan(task, *, degree, terms, stable_start):
    from fastcan.narx import _base, make_narx

    curve, best = [(0.0, np.inf)], {}
    original = _base.least_squares
    began = time.process_time()

    def watched(fun, x0, **settings):
        def residual(coefficients, *args):
            if time.process_time() - began > task.cap:
                raise OutOfTimeError
            found = fun(coefficients, *args)
            error = float(np.mean(np.square(found)))
            if error < curve[-1][1]:
                curve.append((time.process_time() - began, error))
                best["coefficients"] = np.array(coefficients)
            return found

        return original(residual, x0, **settings)

    _base.least_squares = watched
    narx = make_narx(task.u, task.y, n_terms_to_select=terms, max_delay=task.lags, poly_degree=degree, refine_verbose=0)
    init = "one_step_ahead"
    if stable_start:
        n_terms = len(narx.feat_ids)
        init = np.zeros(n_terms + 1)
        used = narx.delay_ids >= 0
        for term in range(n_terms):
            linear = used[term].sum() == 1
            if (
                linear
                and narx.feat_ids[term][used[term]][0] == task.u.shape[1]
                and narx.delay_ids[term][used[term]][0] == 1
            ):
                init[term] = 0.95
    with contextlib.suppress(OutOfTimeError):
        narx.fit(task.u, task.y, coef_init=init)
    if not best:
        return [], {}
    # The cap ends the fit before it stores what it found: coefficients, then the intercept.
    narx.coef_, narx.intercept_ = best["coefficients"][:-1], best["coefficients"][-1:]
    return curve[1:], {name: float(np.mean((narx.predict(a) - b) ** 2)) for name, (a, b) in task.unseen.items()}


def fastcan_quadratic(task):
    """All terms of degree 2, fitted one step ahead, then in free run."""
    return _fastcan(task, degree=2, terms=14 if task.u.shape[1] == 1 else 27, stable_start=False)


def fastcan_cubic(task):
    """All terms of degree 3, started from a stable first-order lag."""
    return _fastcan(task, degree=3, terms=34 if task.u.shape[1] == 1 else 83, stable_start=True)


def pyrenn(task):
    """Levenberg-Marquardt by real-time recurrent learning."""
    import pyrenn as tool

    delays = list(range(1, task.lags + 1))
    np.random.seed(task.seed)  # noqa: NPY002 - the tool draws from the global generator
    net = tool.CreateNN([task.u.shape[1], task.neurons, 1], dIn=delays, dIntern=[], dOut=delays)
    original, curve, best = tool.calc_error, [(0.0, np.inf)], {}
    began = time.process_time()

    def watched(candidate, data):
        error = original(candidate, data)
        if error < curve[-1][1]:
            curve.append((time.process_time() - began, error))
            best["weights"] = candidate["w"].copy()
        if time.process_time() - began > task.cap:
            raise OutOfTimeError
        return error

    tool.calc_error = watched
    with contextlib.suppress(OutOfTimeError):
        tool.train_LM(task.u.T, task.y[None], net, k_max=1000, E_stop=1e-10)
    if not best:
        return [], {}
    net["w"] = best["weights"]

    def error(inputs, target):
        return float(np.mean((np.asarray(tool.NNOut(inputs.T, net)).ravel() - target) ** 2))

    # The tool's own error is in its own scaling, proportional to the mean square.
    unit = error(task.u, task.y) / curve[-1][1]
    found = [(seconds, value * unit) for seconds, value in curve[1:]]
    return found, {name: error(*record) for name, record in task.unseen.items()}


TOOLS = {
    "jax-sysid": jax_sysid,
    "jax-sysid, state space": jax_sysid_states,
    "jax-sysid, three states": functools.partial(jax_sysid_states, n_state=3),
    "fastcan, degree 2": fastcan_quadratic,
    "fastcan, degree 3": fastcan_cubic,
    "pyrenn": pyrenn,
}


if __name__ == "__main__":
    tool, problem, seconds, *more = sys.argv[1:]
    with np.load(problem, allow_pickle=False) as stored:
        names = [name.removeprefix("u_") for name in stored if name.startswith("u_")]
        given = Task(
            u=stored["u"],
            y=stored["y"],
            lags=int(stored["lags"]),
            neurons=int(stored["neurons"]),
            unseen={name: (stored[f"u_{name}"], stored[f"y_{name}"]) for name in names},
            cap=float(seconds),
            seed=int(more[0]) if more else 0,
        )
    with contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
        learned, elsewhere = TOOLS[tool](given)
    finite = [point for point in learned if np.isfinite(point[1])]
    # A free run that diverges has no error: null.
    unseen = {name: value if np.isfinite(value) else None for name, value in elsewhere.items()}
    print(json.dumps({"curve": finite, "unseen": unseen}))
