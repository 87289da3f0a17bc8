r"""A register machine, compiled once: it runs the equations of any grey box, and their exact sensitivities.

A program is a list of instructions over numbered registers, ``[constants | parameters | states | inputs | results]``;
each has an operation, up to three registers that it reads, and a number of its own (a switch, a table). Nothing is
compiled for a new set of equations, and no text ever becomes code: equations are data here.

Each instruction leaves its partial derivatives; one pass back over them per result gives how it moves with every
register that is none (reverse mode, Griewank and Walther 2008, "Evaluating derivatives", chapter 3).

A switch (``>``, ``>=``, ``sign``) of width 0 is exact and has no derivative; of a width :math:`w` it is the logistic
function of its argument over :math:`w`, that fits are trained through. A root of width 0 is exact, and its derivative
knows no bound near 0, where a step of finite length makes nonsense of it; of a width :math:`w` it is
:math:`x/(x^2+w^2)^{1/4}`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sysid.kernels.arrays import copy_numbers, stands_apart

ADD, SUB, MUL, DIV, NEG, POW, FMA, ABS, MIN, MAX = range(10)
SQRT, EXP, LOG, TANH, SIN, COS, ATAN, SIGN, GREATER, NOT_LESS, SELECT, TABLE = range(10, 22)


@njit(cache=True, nogil=True, error_model="numpy")
def _table(x, begin, n, table):
    """Value and slope of a piecewise linear function, its ends held."""
    if not x > table[begin, 0]:
        return (table[begin, 1] if x <= table[begin, 0] else math.nan), 0.0
    if x >= table[begin + n - 1, 0]:
        return table[begin + n - 1, 1], 0.0
    low, high = begin, begin + n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle, 0] <= x:
            low = middle
        else:
            high = middle
    slope = (table[high, 1] - table[low, 1]) / (table[high, 0] - table[low, 0])
    return table[low, 1] + slope * (x - table[low, 0]), slope


@njit(cache=True, nogil=True, error_model="numpy")
def _logistic(x):
    return 0.5 + 0.5 * math.tanh(0.5 * x)


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate(code, begin, end, v, first, widths, places, table):
    """Run a program: the registers from ``first`` on are written.

    What is called for every sample takes whole arrays and where in them something begins: to cut a piece out is to
    count who holds it.

    Args:
        code: Instructions ``(operation, a, b, c, own)``, shape ``(n, 5)``, of one program or of several.
        begin: The program's first.
        end: One more than its last.
        v: Registers.
        first: The first result.
        widths: Of each switch.
        places: Of each table its first row and its rows, shape ``(n_tables, 2)``.
        table: Rows ``(x, y)`` of all tables.
    """
    stands_apart()
    for i in range(begin, end):
        op = code[i, 0]
        a = v[code[i, 1]]
        if op == FMA:
            r = a * v[code[i, 2]] + v[code[i, 3]]
        elif op == MUL:
            r = a * v[code[i, 2]]
        elif op == ADD:
            r = a + v[code[i, 2]]
        elif op == SUB:
            r = a - v[code[i, 2]]
        elif op == DIV:
            r = a / v[code[i, 2]]
        elif op == NEG:
            r = -a
        elif op == TANH:
            r = math.tanh(a)
        elif op == SQRT:
            w = widths[code[i, 4]]
            if a <= 0.0:
                r = 0.0
            elif w > 0.0:
                r = a / math.sqrt(math.sqrt(a * a + w * w))
            else:
                r = math.sqrt(a)
        elif op == ABS:
            r = abs(a)
        elif op == MIN:
            b = v[code[i, 2]]
            r = a if a <= b or math.isnan(a) else b
        elif op == MAX:
            b = v[code[i, 2]]
            r = a if a >= b or math.isnan(a) else b
        elif op == SELECT:
            if a >= 1.0:
                r = v[code[i, 2]]
            elif a <= 0.0:
                r = v[code[i, 3]]
            else:
                r = v[code[i, 3]] + a * (v[code[i, 2]] - v[code[i, 3]])
        elif op in (GREATER, NOT_LESS):
            w = widths[code[i, 4]]
            if w > 0.0:
                r = _logistic(a / w)
            elif op == GREATER:
                r = 1.0 if a > 0.0 else 0.0
            else:
                r = 1.0 if a >= 0.0 else 0.0
        elif op == SIGN:
            w = widths[code[i, 4]]
            hard = 1.0 if a > 0.0 else (-1.0 if a < 0.0 else 0.0)
            r = math.tanh(0.5 * a / w) if w > 0.0 else hard
        elif op == TABLE:
            r = _table(a, places[code[i, 4], 0], places[code[i, 4], 1], table)[0]
        elif op == POW:
            r = a ** v[code[i, 2]]
        elif op == EXP:
            r = math.inf if a >= 709.0 else math.exp(a)
        elif op == LOG:
            r = math.log(a) if a > 0.0 else (-math.inf if a == 0.0 else math.nan)
        elif op == SIN:
            r = math.sin(a) if abs(a) < math.inf else math.nan
        elif op == COS:
            r = math.cos(a) if abs(a) < math.inf else math.nan
        else:
            r = math.atan(a)
        v[first + i - begin] = r


@njit(cache=True, nogil=True, error_model="numpy")
def partials(code, begin, end, v, first, widths, places, table, d):
    """Partial derivatives of every instruction with respect to what it reads, shape ``(n, 3)``.

    Args:
        code: As for :func:`evaluate`, which has run.
        begin: As there.
        end: As there.
        v: As there.
        first: As there.
        widths: As there.
        places: As there.
        table: As there.
        d: A row an instruction of ``code``, of which those of this program are written.
    """
    stands_apart()
    for i in range(begin, end):
        op = code[i, 0]
        a, r = v[code[i, 1]], v[first + i - begin]
        d[i, 0] = d[i, 1] = d[i, 2] = 0.0
        if op == FMA:
            d[i, 0], d[i, 1], d[i, 2] = v[code[i, 2]], a, 1.0
        elif op == MUL:
            d[i, 0], d[i, 1] = v[code[i, 2]], a
        elif op == ADD:
            d[i, 0] = d[i, 1] = 1.0
        elif op == SUB:
            d[i, 0], d[i, 1] = 1.0, -1.0
        elif op == DIV:
            d[i, 0], d[i, 1] = 1.0 / v[code[i, 2]], -r / v[code[i, 2]]
        elif op == NEG:
            d[i, 0] = -1.0
        elif op == TANH:
            d[i, 0] = 1.0 - r * r
        elif op == SQRT:
            w = widths[code[i, 4]]
            if w > 0.0 and a >= 0.0:
                q = a * a + w * w
                d[i, 0] = (1.0 - 0.5 * a * a / q) / math.sqrt(math.sqrt(q))
            else:
                d[i, 0] = 0.5 / r if r > 0.0 else 0.0
        elif op == ABS:
            d[i, 0] = 1.0 if a > 0.0 else (-1.0 if a < 0.0 else 0.0)
        elif op == MIN:
            d[i, 0 if a <= v[code[i, 2]] else 1] = 1.0
        elif op == MAX:
            d[i, 0 if a >= v[code[i, 2]] else 1] = 1.0
        elif op == SELECT:
            if a >= 1.0:
                d[i, 1] = 1.0
            elif a <= 0.0:
                d[i, 2] = 1.0
            else:
                d[i, 0] = v[code[i, 2]] - v[code[i, 3]]
                d[i, 1], d[i, 2] = a, 1.0 - a
        elif op in (GREATER, NOT_LESS):
            w = widths[code[i, 4]]
            if w > 0.0:
                d[i, 0] = r * (1.0 - r) / w
        elif op == SIGN:
            w = widths[code[i, 4]]
            if w > 0.0:
                d[i, 0] = 0.5 * (1.0 - r * r) / w
        elif op == TABLE:
            d[i, 0] = _table(a, places[code[i, 4], 0], places[code[i, 4], 1], table)[1]
        elif op == POW:
            b = v[code[i, 2]]
            d[i, 0] = b * a ** (b - 1.0) if b != 0.0 else 0.0
            d[i, 1] = r * math.log(a) if a > 0.0 else 0.0
        elif op == EXP:
            d[i, 0] = r
        elif op == LOG:
            d[i, 0] = 1.0 / a
        elif op == SIN:
            d[i, 0] = math.cos(a) if abs(a) < math.inf else math.nan
        elif op == COS:
            d[i, 0] = -math.sin(a) if abs(a) < math.inf else math.nan
        else:
            d[i, 0] = 1.0 / (1.0 + a * a)


@njit(cache=True, nogil=True, error_model="numpy")
def moves_of(code, begin, end, d, result, low, first, bar):
    """What one result moves by with every register that is no result, left in ``bar``.

    Args:
        code: As for :func:`evaluate`.
        begin: As there.
        end: As there.
        d: As :func:`partials` leaves it.
        result: The register asked for.
        low: The program's first register.
        first: As for :func:`evaluate`.
        bar: A number a register; those of this program are written.
    """
    stands_apart()
    for i in range(low, first + end - begin):
        bar[i] = 0.0
    bar[result] = 1.0
    for i in range(end - 1, begin - 1, -1):
        g = bar[first + i - begin]
        if g != 0.0:
            if d[i, 0] != 0.0:
                bar[code[i, 1]] += g * d[i, 0]
            if d[i, 1] != 0.0:
                bar[code[i, 2]] += g * d[i, 1]
            if d[i, 2] != 0.0:
                bar[code[i, 3]] += g * d[i, 2]


@njit(cache=True, nogil=True, error_model="numpy")
def registers(constants, theta, n, m, n_code):
    """Registers with constants and parameters in place."""
    v = np.zeros(len(constants) + len(theta) + n + m + n_code)
    copy_numbers(constants, v)
    copy_numbers(theta, v[len(constants) :])
    return v


@njit(cache=True, nogil=True, error_model="numpy")
def fill(v, at, x, u):
    """Put states and inputs into registers, from ``at`` on."""
    for i in range(len(x)):
        v[at + i] = x[i]
    for i in range(len(u)):
        v[at + len(x) + i] = u[i]


@njit(cache=True, nogil=True, error_model="numpy")
def values(program, theta, path, u, widths, places, table, y):
    """The results of one program along a path of states, written to ``y``.

    Args:
        program: Code, results and constants.
        theta: Parameters.
        path: States, shape ``(n_samples, n)``.
        u: Inputs, shape ``(n_samples, m)``.
        widths: Of each switch.
        places: Of each table.
        table: Rows of all tables.
        y: Shape ``(n_samples, n_results)``, written.
    """
    code, results, constants = program
    n, m = path.shape[1], u.shape[1]
    v = registers(constants, theta, n, m, len(code))
    at = len(constants) + len(theta)
    for t in range(len(u)):
        fill(v, at, path[t], u[t])
        evaluate(code, 0, len(code), v, at + n + m, widths, places, table)
        for j in range(len(results)):
            y[t, j] = v[results[j]]


@njit(cache=True, nogil=True, error_model="numpy")
def derivatives(program, theta, p, x, u, widths, places, table, r, Jx, Jp):
    """The results of one program at one point, with their derivatives.

    Args:
        program: Code, results and constants.
        theta: Parameters.
        p: How many of them are asked for.
        x: State, shape ``(n,)``.
        u: Inputs, shape ``(m,)``.
        widths: Of each switch.
        places: Of each table.
        table: Rows of all tables.
        r: Shape ``(n_results,)``, written.
        Jx: Shape ``(n_results, n)``, written.
        Jp: Shape ``(n_results, p)``, written.
    """
    code, results, constants = program
    n, m = len(x), len(u)
    v = registers(constants, theta, n, m, len(code))
    at = len(constants) + len(theta)
    first = at + n + m
    fill(v, at, x, u)
    evaluate(code, 0, len(code), v, first, widths, places, table)
    d, bar = np.zeros((len(code), 3)), np.zeros(len(v))
    partials(code, 0, len(code), v, first, widths, places, table, d)
    for j in range(len(results)):
        r[j] = v[results[j]]
        moves_of(code, 0, len(code), d, results[j], 0, first, bar)
        copy_numbers(bar[at : at + n], Jx[j])
        copy_numbers(bar[len(constants) : len(constants) + p], Jp[j])
