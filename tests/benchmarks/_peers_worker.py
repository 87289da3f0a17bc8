"""One peer on one problem, run by ``peers.py`` in the peers' own environment; prints its result as a line of JSON.

    python _peers_worker.py <tool> <problem.npz> <cap in seconds>

The problem holds scaled inputs ``u`` (n, n_inputs) and output ``y`` (n,), the range 2 wide and rest at zero before the
first sample, the number of lags and of neurons. The result is a learning curve: pairs of processor time
in seconds, imports excluded, and mean squared error of the free run over the training record in scaled numbers.
"""
# This file runs where neither the project nor its checks are installed: the peers' types are not known here.
# mypy: ignore-errors

import contextlib
import io
import json
import sys
import time

import numpy as np


class OutOfTimeError(Exception):
    """The cap was reached."""


def jax_sysid(u, y, lags, neurons, cap):
    """NARX written as a state space of past samples; Adam, then L-BFGS until the cap."""
    import os

    # One thread, as the others have: its threads would count twice in processor time.
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    import jax
    import jax.numpy as jnp
    from jax_sysid import _model as tool
    from jax_sysid.models import Model

    n_in = u.shape[1]
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

    rng = np.random.default_rng(0)
    W = rng.standard_normal((neurons, n_state)) / np.sqrt(n_state)
    w = np.zeros((1, n_state))
    w[0, 0] = 0.9
    params = [W, 0.1 * rng.standard_normal(neurons), 0.01 * rng.standard_normal((1, neurons)), np.zeros(1), w]
    model = Model(n_state, 1, n_in, state_fcn=state, output_fcn=output)
    model.init(params=params)
    model.loss(rho_x0=0.0, rho_th=1e-8, train_x0=False)
    model.optimization(adam_eta=0.003, adam_epochs=1000, lbfgs_epochs=1_000_000, memory=100, iprint=-1)
    original, states = tool.lbfgs_callback, []

    def watched(*arguments):
        inner, final = original(*arguments)

        def callback(z, *more):
            states.append((time.process_time() - began, [np.asarray(part) for part in z]))
            if time.process_time() - began > cap:
                raise OutOfTimeError
            return None if inner is None else inner(z, *more)

        return callback, final

    tool.lbfgs_callback = watched
    began = time.process_time()
    with contextlib.suppress(OutOfTimeError):
        model.fit(y[:, None], u)
        states.append((time.process_time() - began, [np.asarray(part) for part in model.params]))
    curve = []
    for place in np.unique(np.geomspace(1, len(states), 40).astype(int)) - 1:
        seconds, model.params = states[place]
        predicted = np.asarray(model.predict(np.zeros(n_state), u)[0]).ravel()
        curve.append((seconds, float(np.mean((predicted - y) ** 2))))
    return curve


def _fastcan(u, y, lags, cap, *, degree, terms, stable_start):
    from fastcan.narx import _base, make_narx

    curve = [(0.0, np.inf)]
    original = _base.least_squares
    began = time.process_time()

    def watched(fun, x0, **settings):
        def residual(coefficients, *args):
            if time.process_time() - began > cap:
                raise OutOfTimeError
            found = fun(coefficients, *args)
            error = float(np.mean(np.square(found)))
            if error < curve[-1][1]:
                curve.append((time.process_time() - began, error))
            return found

        return original(residual, x0, **settings)

    _base.least_squares = watched
    narx = make_narx(u, y, n_terms_to_select=terms, max_delay=lags, poly_degree=degree, refine_verbose=0)
    init = "one_step_ahead"
    if stable_start:
        n_terms = len(narx.feat_ids)
        init = np.zeros(n_terms + 1)
        used = narx.delay_ids >= 0
        for term in range(n_terms):
            linear = used[term].sum() == 1
            if linear and narx.feat_ids[term][used[term]][0] == u.shape[1] and narx.delay_ids[term][used[term]][0] == 1:
                init[term] = 0.95
    with contextlib.suppress(OutOfTimeError):
        narx.fit(u, y, coef_init=init)
    return curve[1:]


def fastcan_quadratic(u, y, lags, neurons, cap):
    """All terms of degree 2, fitted one step ahead, then in free run."""
    return _fastcan(u, y, lags, cap, degree=2, terms=14 if u.shape[1] == 1 else 27, stable_start=False)


def fastcan_cubic(u, y, lags, neurons, cap):
    """All terms of degree 3, started from a stable first-order lag."""
    return _fastcan(u, y, lags, cap, degree=3, terms=34 if u.shape[1] == 1 else 83, stable_start=True)


def pyrenn(u, y, lags, neurons, cap):
    """Levenberg-Marquardt by real-time recurrent learning."""
    import pyrenn as tool

    delays = list(range(1, lags + 1))
    np.random.seed(0)  # noqa: NPY002 - the tool draws from the global generator
    net = tool.CreateNN([u.shape[1], neurons, 1], dIn=delays, dIntern=[], dOut=delays)
    original, curve, best = tool.calc_error, [(0.0, np.inf)], {}
    began = time.process_time()

    def watched(candidate, data):
        error = original(candidate, data)
        if error < curve[-1][1]:
            curve.append((time.process_time() - began, error))
            best["weights"] = candidate["w"].copy()
        if time.process_time() - began > cap:
            raise OutOfTimeError
        return error

    tool.calc_error = watched
    with contextlib.suppress(OutOfTimeError):
        tool.train_LM(u.T, y[None], net, k_max=1000, E_stop=1e-10)
    if not best:
        return []
    net["w"] = best["weights"]
    predicted = np.asarray(tool.NNOut(u.T, net)).ravel()
    # The tool's own error is in its own scaling, proportional to the mean square.
    unit = float(np.mean((predicted - y) ** 2)) / curve[-1][1]
    return [(seconds, error * unit) for seconds, error in curve[1:]]


TOOLS = {
    "jax-sysid": jax_sysid,
    "fastcan, degree 2": fastcan_quadratic,
    "fastcan, degree 3": fastcan_cubic,
    "pyrenn": pyrenn,
}


if __name__ == "__main__":
    tool, problem, cap = sys.argv[1:]
    with np.load(problem, allow_pickle=False) as stored:
        u, y, lags, neurons = stored["u"], stored["y"], int(stored["lags"]), int(stored["neurons"])
    with contextlib.redirect_stdout(io.StringIO()):
        learned = [point for point in TOOLS[tool](u, y, lags, neurons, float(cap)) if np.isfinite(point[1])]
    print(json.dumps(learned))
