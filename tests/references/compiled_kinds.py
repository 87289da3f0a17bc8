"""Plants of thirteen kinds for ``sysid surrogate``; searches of motor, exchanger and battery have led to changes of it.

Each is a function of times, inputs and parameters, compiled, so that hundreds of its runs can be had. :data:`TABLE` has
the ranges of its inputs, its outputs, the sample time in seconds, and how long an experiment lasts.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
jit = njit(cache=True)


@jit
def _motor(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 2))
    i = 0.0
    w = 0.0
    T = 25.0
    n = 400
    h = dt / n
    for k in range(len(u)):
        for _ in range(n):
            R = 0.8 * (1 + 0.0039 * (T - 25.0))
            i += h * (u[k, 0] - R * i - 0.05 * w) / 2e-3
            drive = 0.05 * i - 2e-4 * w
            load = u[k, 1] * np.tanh(w / 2.0)
            w += h * (drive - load) / 4e-4
            T += h * (R * i * i - (T - 25.0) / 1.5) / 40.0
        out[k, 0] = w
        out[k, 1] = T
    return out


@jit
def _exchanger(dt: float, u: Array) -> Array:
    n = 20
    h = np.full(n, 50.0)
    c = np.full(n, 50.0)
    wl = np.full(n, 50.0)
    out = np.empty((len(u), 2))
    m = 40
    s = dt / m
    first = True
    for k in range(len(u)):
        mh, mc, th = u[k, 0], u[k, 1], u[k, 2]
        reps = 200 if first else 1
        for _ in range(reps):
            for _ in range(m):
                ah = 60.0 * (mh / 0.2) ** 0.8
                ac = 60.0 * (mc / 0.2) ** 0.8
                nh = h.copy()
                nc = c.copy()
                for j in range(n):
                    up = th if j == 0 else h[j - 1]
                    dn = 20.0 if j == n - 1 else c[j + 1]
                    nh[j] = h[j] + s * (mh * 4180 * (up - h[j]) - ah * (h[j] - wl[j])) / 400.0
                    nc[j] = c[j] + s * (mc * 4180 * (dn - c[j]) - ac * (c[j] - wl[j])) / 400.0
                    wl[j] += s * (ah * (h[j] - wl[j]) + ac * (c[j] - wl[j])) / 300.0
                h = nh
                c = nc
        first = False
        out[k, 0] = h[n - 1]
        out[k, 1] = c[0]
    return out


@jit
def _pendulum(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 1))
    a = 0.0
    v = 0.0
    n = 50
    h = dt / n
    for k in range(len(u)):
        for _ in range(n):
            v += h * (u[k, 0] - 9.81 * np.sin(a) - 0.8 * v)
            a += h * v
        out[k, 0] = a
    return out


@jit
def _tanks(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 2))
    a = 0.0
    b = 0.0
    n = 50
    h = dt / n
    for k in range(len(u)):
        for _ in range(n):
            q = 0.35 * np.sqrt(max(a, 0.0))
            spill = 0.0
            a += h * (u[k, 0] - q) / 1.5
            if a > 1.0:
                spill = (a - 1.0) * 1.5 / h
                a = 1.0
            b += h * (q + 0.4 * spill - (0.1 + 0.3 * u[k, 1]) * np.sqrt(max(b, 0.0))) / 2.5
            b = min(max(b, 0.0), 1.6)
        out[k, 0] = a
        out[k, 1] = b
    return out


@jit
def _quad(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 2))
    x = np.array([12.0, 12.0, 1.6, 1.6])
    n = 50
    h = dt / n
    A = (28.0, 32.0, 28.0, 32.0)
    o = (0.071, 0.057, 0.071, 0.057)
    for k in range(len(u)):
        for _ in range(n):
            r = np.sqrt(np.maximum(2 * 981.0 * x, 0.0))
            q1, q2 = 3.33 * u[k, 0], 3.35 * u[k, 1]
            x[0] += h * (-o[0] * r[0] + o[2] * r[2] + 0.7 * q1) / A[0]
            x[1] += h * (-o[1] * r[1] + o[3] * r[3] + 0.6 * q2) / A[1]
            x[2] += h * (-o[2] * r[2] + 0.4 * q2) / A[2]
            x[3] += h * (-o[3] * r[3] + 0.3 * q1) / A[3]
            x = np.maximum(x, 0.0)
        out[k, 0] = x[0]
        out[k, 1] = x[1]
    return out


@jit
def _rod(dt: float, u: Array) -> Array:
    n = 200
    T = np.full(n, 293.15)
    out = np.empty((len(u), 2))
    m = 20
    h = dt / m
    new = T.copy()
    for k in range(len(u)):
        for _ in range(m):
            for j in range(n):
                left = T[j - 1] if j else T[0]
                right = T[j + 1] if j < n - 1 else T[j]
                g = 4.0 * (left - 2 * T[j] + right) * (1 - 0.0008 * (T[j] - 293.15)) - 6e-11 * (
                    T[j] ** 4 - u[k, 1] ** 4
                )
                if j == 0:
                    g += u[k, 0] * 0.6
                new[j] = T[j] + h * g / 10.0
            T, new = new, T
        out[k, 0] = T[0]
        out[k, 1] = T[40]
    return out


@jit
def _cstr(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 2))
    C = 0.9
    T = 320.0
    n = 200
    h = dt / n
    for k in range(len(u)):
        for _ in range(n if k else 100 * n):
            r = 7.2e10 * np.exp(-8750.0 / T) * C
            dC = u[k, 0] / 100.0 * (1 - C) - r
            dT = u[k, 0] / 100.0 * (350 - T) + 209.2 * r + 2.092 * (u[k, 1] - T)
            C += h * dC
            T += h * dT
        out[k, 0] = C
        out[k, 1] = T
    return out


@jit
def _stops(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 1))
    x = 0.0
    v = 0.0
    n = 200
    h = dt / n
    for k in range(len(u)):
        for _ in range(n):
            v += h * (u[k, 0] - 3.0 * x - 0.6 * v)
            x += h * v
            if x > 1.0:
                x = 1.0
                v = -0.3 * v if v > 0.02 else min(v, 0.0)
            if x < -0.8:
                x = -0.8
                v = -0.3 * v if v < -0.02 else max(v, 0.0)
        out[k, 0] = x
    return out


@jit
def _relay(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 1))
    T = 15.0
    w = 15.0
    on = False
    n = 60
    h = dt / n
    for k in range(len(u)):
        for _ in range(n):
            if u[k, 0] - 0.5 > T:
                on = True
            if u[k, 0] + 0.5 < T:
                on = False
            w += h * (0.02 * on * (60.0 - w) - 0.01 * (w - T))
            T += h * (0.004 * (w - T) - 0.0015 * (T - u[k, 1]))
        out[k, 0] = T
    return out


@jit
def _battery(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 2))
    s = 0.5
    a = 0.0
    b = 0.0
    T = 25.0
    n = 20
    h = dt / n
    for k in range(len(u)):
        i = u[k, 0]
        for _ in range(n):
            R = 0.02 * np.exp(-0.02 * (T - 25.0)) * (1 + 0.5 * (1 - s) ** 4)
            if (s <= 0.05 and i > 0) or (s >= 0.95 and i < 0):
                i = 0.0
            s -= h * i / 7200.0
            a += h * (i * 0.015 - a) / 10.0
            b += h * (i * 0.02 - b) / 120.0
            T += h * (i * i * R * 1.5 + i * (a + b) - (T - u[k, 1]) * 0.15) / 60.0
        oc = 3.0 + 1.1 * s - 0.35 * np.exp(-12 * s) + 0.12 * np.tanh(8 * (s - 0.55))
        out[k, 0] = oc - i * R - a - b
        out[k, 1] = T
    return out


@jit
def _cylinder(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 2))
    x = 0.0
    v = 0.0
    p = 0.0
    n = 400
    h = dt / n
    for k in range(len(u)):
        for _ in range(n):
            q = 2e-3 * u[k, 0] * np.sqrt(max(1.0 - 0.8 * p * np.sign(u[k, 0]), 0.0))
            p += h * (q * 1.0 - 0.01 * v - 2e-4 * p) * 2000.0
            f = 400.0 * p - 40.0 * v - 30.0 * np.tanh(v / 0.004)
            v += h * f / 20.0
            x += h * v
            if x > 0.25:
                x = 0.25
                v = min(v, 0.0)
            if x < -0.25:
                x = -0.25
                v = max(v, 0.0)
        out[k, 0] = 1e3 * x
        out[k, 1] = p
    return out


@jit
def _vdp(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 1))
    x = 0.0
    v = 0.0
    n = 50
    h = dt / n
    for k in range(len(u)):
        for _ in range(n):
            v += h * (1.2 * (1 - x * x) * v - x + u[k, 0])
            x += h * v
        out[k, 0] = x
    return out


@jit
def _ph(wa: float, wb: float) -> float:
    lo, hi = 0.0, 14.0
    for _ in range(50):
        p = 0.5 * (lo + hi)
        f = (
            wa
            + 10.0 ** (p - 14)
            - 10.0 ** (-p)
            + wb * (1 + 2 * 10.0 ** (p - 10.25)) / (1 + 10.0 ** (6.35 - p) + 10.0 ** (p - 10.25))
        )
        if f > 0:
            hi = p
        else:
            lo = p
    return 0.5 * (lo + hi)


@jit
def _neutral(dt: float, u: Array) -> Array:
    out = np.empty((len(u), 1))
    V = 2900.0
    wa = -4.32e-4
    wb = 5.28e-4
    n = 20
    h = dt / n
    for k in range(len(u)):
        for _ in range(n if k else 100 * n):
            q1, q2, q3 = 16.6, u[k, 1], u[k, 0]
            wa += h / V * (q1 * (3e-3 - wa) + q2 * (-0.03 - wa) + q3 * (-3.05e-3 - wa))
            wb += h / V * (q1 * (0.0 - wb) + q2 * (0.03 - wb) + q3 * (5e-5 - wb))
        p = _ph(wa, wb)
        out[k, 0] = p
    return out


def dcmotor(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A DC motor whose winding warms and whose resistance grows with that."""
    return _motor(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def exchanger(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A heat exchanger in counterflow, of 20 cells with a wall."""
    return _exchanger(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def pendulum(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A pendulum with a torque."""
    return _pendulum(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def tanks(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Two tanks one below the other; the upper runs over, half into the lower."""
    return _tanks(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def quad(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Four tanks that two pumps fill crosswise."""
    return _quad(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def rod(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A rod of 200 nodes that is heated at one end and radiates."""
    return _rod(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def cstr(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A stirred tank with an exothermic reaction."""
    return _cstr(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def stops(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A mass on a spring between two stops that throw it back."""
    return _stops(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def relay(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A room with a thermostat that nobody sees."""
    return _relay(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def battery(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A cell of two RC pairs with its temperature."""
    return _battery(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def cylinder(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A hydraulic cylinder with friction and end stops."""
    return _cylinder(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def vdp(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Van der Pol's oscillator, driven."""
    return _vdp(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


def neutral(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Neutralisation: the pH of a stirred tank."""
    return _neutral(float(time[1] - time[0]), np.ascontiguousarray(inputs, dtype=np.float64))


TABLE: dict[str, tuple[dict[str, tuple[float, float]], list[str], float, float]] = {
    "dcmotor": ({"volts [V]": (0, 24), "load [N m]": (0, 0.3)}, ["speed", "temp"], 0.1, 80.0),
    "exchanger": ({"hot": (0.05, 0.3), "cold": (0.05, 0.3), "inlet": (60, 90)}, ["hot_out", "cold_out"], 0.5, 150.0),
    "pendulum": ({"torque": (-7, 7)}, ["angle"], 0.05, 40.0),
    "tanks": ({"pump": (0, 0.45), "valve": (0, 1)}, ["upper", "lower"], 0.5, 200.0),
    "quad": ({"v1": (1, 5), "v2": (1, 5)}, ["h1", "h2"], 5.0, 2000.0),
    "rod": ({"heat": (0, 150), "air": (273, 313)}, ["face", "inside"], 2.0, 800.0),
    "cstr": ({"flow": (90, 110), "coolant": (288, 301)}, ["conc", "temp"], 0.1, 40.0),
    "stops": ({"force": (-5, 5)}, ["place"], 0.05, 30.0),
    "relay": ({"setpoint": (17, 24), "air": (-5, 12)}, ["temp"], 30.0, 12000.0),
    "battery": ({"amps": (-8, 8), "air": (0, 40)}, ["volts", "temp"], 5.0, 2500.0),
    "cylinder": ({"valve": (-1, 1)}, ["place", "pressure"], 0.05, 30.0),
    "vdp": ({"force": (-2, 2)}, ["x"], 0.1, 60.0),
    "neutral": ({"base": (12, 19), "buffer": (0.2, 1.0)}, ["ph"], 10.0, 4000.0),
}
