r"""The free run of a grey box, and its exact sensitivities, from sample to sample.

Three programs make a model: the slopes :math:`f = dx_c/dt` of the continuous states, the updates :math:`x_d(k+1)` of
the others, and the outputs. Continuous states go from sample to sample in ``substeps`` equal steps, other states being
held, inputs held or on a straight way from the sample before: by the classical Runge-Kutta method, or by one stage
whose slope is that over a whole implicit step (:mod:`sysid.equations.implicit`). The step itself is a parameter, the
last but one; the last is the share of the way that lies behind. Held inputs say at a sample how to go on to the next;
of those that move it is known at the next sample how they came there, so that each sample begins with the way to it
(``ahead``).

The sensitivities are those of what is computed, steps and all, not of the differential equation. Each instruction
leaves its partial derivatives; one pass back over them per result gives a row of :math:`\partial f/\partial x` and
:math:`\partial f/\partial p` (reverse mode, Griewank and Walther 2008, "Evaluating derivatives", chapter 3); and with
:math:`S = dx/d(p, x_0)` a stage at :math:`x_i`, where :math:`S_i` is a combination of the stages before, has

.. math:: K_i = \frac{\partial f}{\partial x} S_i + \frac{\partial f}{\partial p},

so that the method is applied to :math:`(x, S)` as to :math:`x`.

Limits: states are dense, a step costs some :math:`n^2 p` multiply-adds for the sensitivities.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sysid.kernels.arrays import copy_numbers, copy_rows
from sysid.kernels.register_machine import evaluate, fill, moves_of, partials, registers


@njit(cache=True, nogil=True, error_model="numpy")
def _finite(x):
    total = 0.0
    for i in range(len(x)):
        total += x[i]
    return math.isfinite(total)


@njit(cache=True, nogil=True, error_model="numpy")
def free_run(programs, theta, x, u, method, substeps, step, ahead, widths, places, table, y, path):
    """Run a model, writing ``y`` and leaving in ``x`` the state after the last sample.

    Args:
        programs: Slopes, updates and outputs, each a tuple of code, results and constants.
        theta: Parameters, those that are not fitted behind those that are.
        x: Continuous states, then the others, before the first sample, shape ``(n,)``; overwritten.
        u: Inputs, shape ``(n_samples, m)``.
        method: Stages of a step: how much each counts, how much of a step ahead the next is, and how much lies behind,
            shape ``(n, 3)``.
        substeps: Steps from sample to sample.
        step: Seconds of one of them.
        ahead: Whether a sample begins with the way to it; otherwise it ends with the way from it.
        widths: Of each switch; 0 is exact.
        places: Of each table its first row and its rows.
        table: Rows of all tables.
        y: Shape ``(n_samples, n_outputs)``, written; not a number from where the state is none.
        path: States before each sample, shape ``(n_samples, n)``, written; without rows nobody asks.
    """
    rates, updates, outputs = programs
    n, m, n_c = len(x), u.shape[1], len(rates[1])
    vf = registers(rates[2], theta, n, m, len(rates[0]))
    vg = registers(updates[2], theta, n, m, len(updates[0]))
    vh = registers(outputs[2], theta, n, m, len(outputs[0]))
    af, ag, ah = len(rates[2]) + len(theta), len(updates[2]) + len(theta), len(outputs[2]) + len(theta)
    later = np.empty(n - n_c)
    slope, total = np.empty(n_c), np.empty(n_c)
    stage = x.copy()
    counted = method[:, 0].sum()
    for t in range(len(u) + (not ahead)):
        way = t if ahead else t - 1
        if n > n_c and way >= 0:
            fill(vg, ag, x, u[way])
            evaluate(updates[0], 0, len(updates[0]), vg, ag + n + m, widths, places, table)
            for i in range(n - n_c):
                later[i] = vg[updates[1][i]]
        if n_c > 0 and way >= 0:
            fill(vf, af, x, u[way])
            for part in range(substeps):
                copy_numbers(x, stage)
                total[:] = 0.0
                for s in range(len(method)):
                    vf[af - 1] = (part + method[s, 2]) / substeps
                    for i in range(n_c):
                        vf[af + i] = stage[i]
                    evaluate(rates[0], 0, len(rates[0]), vf, af + n + m, widths, places, table)
                    weight, on = method[s, 0], method[s, 1] * step
                    for i in range(n_c):
                        slope[i] = vf[rates[1][i]]
                        total[i] += weight * slope[i]
                        stage[i] = x[i] + on * slope[i]
                for i in range(n_c):
                    x[i] += step / counted * total[i]
        if way >= 0:
            for i in range(n - n_c):
                x[n_c + i] = later[i]
        if t == len(u):
            return
        if not _finite(x):
            y[t:] = math.nan
            path[t:] = math.nan
            return
        if len(path) > 0:
            copy_numbers(x, path[t])
        fill(vh, ah, x, u[t])
        evaluate(outputs[0], 0, len(outputs[0]), vh, ah + n + m, widths, places, table)
        for j in range(len(outputs[1])):
            y[t, j] = vh[outputs[1][j]]


@njit(cache=True, nogil=True, error_model="numpy")
def _moves(bar, begin, states, S, p, moved, place):
    """How one result moves: its row ``bar`` against the states' sensitivities, and its own with the parameters.

    What is called for every sample calls nothing itself, and writes from a place of a flat array on: numba counts who
    holds an array that is handed on, or that is a piece of another, which took a third of the time.
    """
    columns = S.shape[1]
    for q in range(columns):
        moved[place + q] = bar[begin + q] if q < p else 0.0
    for j in range(len(S)):
        g = bar[states + j]
        if g != 0.0:
            for q in range(columns):
                moved[place + q] += g * S[j, q]


@njit(cache=True, nogil=True, error_model="numpy")
def sensitivities(programs, theta, p, x, S, u, method, substeps, step, ahead, widths, places, table, y, J):
    """Run a model with the derivatives of its outputs.

    Args:
        programs: As in :func:`free_run`.
        theta: Parameters.
        p: How many of them have columns of their own, the first of all columns; 0 for the initial state's alone.
        x: State before the first sample, shape ``(n,)``; overwritten.
        S: Its derivatives, shape ``(n, n_columns)``; overwritten.
        u: Inputs, shape ``(n_samples, m)``.
        method: Stages of a step: how much each counts, how much of a step ahead the next is, and how much lies behind,
            shape ``(n, 3)``.
        substeps: Steps from sample to sample.
        step: Seconds of one of them.
        ahead: Whether a sample begins with the way to it; otherwise it ends with the way from it.
        widths: Of each switch; 0 is exact.
        places: Of each table.
        table: Rows of all tables.
        y: Shape ``(n_samples, n_outputs)``, written.
        J: Shape ``(n_samples, n_outputs, n_columns)``, written.
    """
    rates, updates, outputs = programs
    n, m, n_c, columns = len(x), u.shape[1], len(rates[1]), S.shape[1]
    vf = registers(rates[2], theta, n, m, len(rates[0]))
    vg = registers(updates[2], theta, n, m, len(updates[0]))
    vh = registers(outputs[2], theta, n, m, len(outputs[0]))
    af, ag, ah = len(rates[2]) + len(theta), len(updates[2]) + len(theta), len(outputs[2]) + len(theta)
    df, dg, dh = np.zeros((len(rates[0]), 3)), np.zeros((len(updates[0]), 3)), np.zeros((len(outputs[0]), 3))
    bf, bg, bh = np.zeros(len(vf)), np.zeros(len(vg)), np.zeros(len(vh))
    later, S_later = np.empty(n - n_c), np.empty((n - n_c, columns))
    total, S_total = np.empty(n_c), np.empty((n_c, columns))
    slope, S_slope = np.empty(n_c), np.empty((n_c, columns))
    stage, S_stage = x.copy(), S.copy()
    flat_J, later_S, slope_S = J.reshape(-1), S_later.reshape(-1), S_slope.reshape(-1)
    counted = method[:, 0].sum()
    for t in range(len(u) + (not ahead)):
        way = t if ahead else t - 1
        if n > n_c and way >= 0:
            fill(vg, ag, x, u[way])
            evaluate(updates[0], 0, len(updates[0]), vg, ag + n + m, widths, places, table)
            partials(updates[0], 0, len(updates[0]), vg, ag + n + m, widths, places, table, dg)
            for i in range(n - n_c):
                later[i] = vg[updates[1][i]]
                moves_of(updates[0], 0, len(updates[0]), dg, updates[1][i], 0, ag + n + m, bg)
                _moves(bg, len(updates[2]), ag, S, p, later_S, i * columns)
        if n_c > 0 and way >= 0:
            fill(vf, af, x, u[way])
            copy_rows(S[n_c:], S_stage[n_c:])
            for part in range(substeps):
                copy_numbers(x, stage)
                copy_rows(S[:n_c], S_stage)
                total[:] = 0.0
                S_total[:] = 0.0
                for s in range(len(method)):
                    vf[af - 1] = (part + method[s, 2]) / substeps
                    for i in range(n_c):
                        vf[af + i] = stage[i]
                    evaluate(rates[0], 0, len(rates[0]), vf, af + n + m, widths, places, table)
                    partials(rates[0], 0, len(rates[0]), vf, af + n + m, widths, places, table, df)
                    weight, on = method[s, 0], method[s, 1] * step
                    for i in range(n_c):
                        slope[i] = vf[rates[1][i]]
                        total[i] += weight * slope[i]
                        moves_of(rates[0], 0, len(rates[0]), df, rates[1][i], 0, af + n + m, bf)
                        _moves(bf, len(rates[2]), af, S_stage, p, slope_S, i * columns)
                    for i in range(n_c):
                        stage[i] = x[i] + on * slope[i]
                        for q in range(columns):
                            S_total[i, q] += weight * S_slope[i, q]
                            S_stage[i, q] = S[i, q] + on * S_slope[i, q]
                for i in range(n_c):
                    x[i] += step / counted * total[i]
                    for q in range(columns):
                        S[i, q] += step / counted * S_total[i, q]
        if way >= 0:
            for i in range(n - n_c):
                x[n_c + i] = later[i]
                for q in range(columns):
                    S[n_c + i, q] = S_later[i, q]
        if t == len(u):
            return
        if not _finite(x):
            y[t:] = math.nan
            J[t:] = math.nan
            return
        fill(vh, ah, x, u[t])
        evaluate(outputs[0], 0, len(outputs[0]), vh, ah + n + m, widths, places, table)
        partials(outputs[0], 0, len(outputs[0]), vh, ah + n + m, widths, places, table, dh)
        for j in range(len(outputs[1])):
            y[t, j] = vh[outputs[1][j]]
            moves_of(outputs[0], 0, len(outputs[0]), dh, outputs[1][j], 0, ah + n + m, bh)
            _moves(bh, len(outputs[2]), ah, S, p, flat_J, (t * len(outputs[1]) + j) * columns)
