r"""The compiled step of a train: point masses, couplers with slack and friction, resistances, brakes, traction.

The scheme is an implicit midpoint rule with discrete gradients (Gonzalez 1996, J. Nonlinear Sci. 6:449): with
:math:`x_1 = x_0 + \tfrac{h}{2}(v_0 + v_1)` and :math:`m (v_1 - v_0) = h F`, the elastic force of a coupler is
:math:`(U(\delta_1) - U(\delta_0)) / (\delta_1 - \delta_0)` and that of a grade
:math:`-m g (z(x_1) - z(x_0)) / (x_1 - x_0)`. Kinetic plus stored energy then changes by exactly the work of the
other forces, at any step and across every kink, and momentum by exactly the impulse of the external ones. The sign
of a friction is taken at the end of the step, so that what is stuck stays stuck. The equations are solved by Newton's
method; their matrix is symmetric, tridiagonal and positive definite. A step that does not converge is halved.

``sysid.rail.dynamics.reference`` is the same step written plainly; tests hold the two together.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from sysid.own_folders import keep_kernels_where_it_is_allowed

keep_kernels_where_it_is_allowed()
Array = NDArray[np.float64]
Integers = NDArray[np.int64]

TOLERANCE = 1e-11
"""Speed in m/s by which a step's equations may miss."""
NEWTON_STEPS, MOST_STEPS = 8, 60
"""Iterations with the tangent of the frictions, then with their secant, which converges from anywhere."""
SMALLEST_SHARE = 1.0 / 4096.0
"""Smallest share of a step that is tried before the run is given up."""

WORKS = ("traction", "dynamic_brake", "resistance", "air_brake", "gravity", "coupler_friction")
"""Whose work is added up, in the order of ``State.work``."""


class Fleet(NamedTuple):
    """What does not change: one value per vehicle, or per coupler. SI."""

    mass: Array
    davis: Array  # (n, 3)
    gain: Array  # shoe force per Pa
    spring: Array  # Pa gauge
    shoe: Array  # (n, 3): base, reference, slope
    curves: Integers  # which set of notch curves, -1 for none
    spacing: Array  # (n - 1,): distance of the centres at rest
    coupler: Array  # (n - 1, 8): Coupler.row
    forces: Array  # (sets, notches, speeds): signed force, from the deepest notch up
    zero_notch: Integers  # (sets,): row of notch 0
    speed_step: Array  # (sets,)


class Track(NamedTuple):
    """Piecewise constant grade and curve resistance."""

    starts: Array
    grade: Array
    elevation: Array
    curve: Array  # curve resistance in N per kg


class State(NamedTuple):
    """Everything that has a memory, in place."""

    position: Array
    speed: Array
    rate: Array  # the last acceleration, from which a step begins to search
    segment: Integers
    work: Array  # J done on the train, in the order of WORKS
    impulse: Array  # (1,): N s of all external forces
    peak: Array  # (n - 1, 4): largest draft force and its time, largest buff force (negative) and its time
    clock: Array  # (1,): s


class Work(NamedTuple):
    """Scratch space."""

    end: Array
    at: Integers
    residual: Array
    diagonal: Array
    off: Array
    pull: Array  # force of each coupler
    rub: Array  # friction part of it
    parts: Array  # (n, 5): traction, dynamic brake, resistance, air brake, gravity


class Drive(NamedTuple):
    """What is done to the train, held within a sample."""

    pressure: Array  # (samples, n): Pa gauge
    notch: Integers  # (samples, n)


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _elastic(d, row):
    """Force, stored energy, stiffness and number of the branch at an extension."""
    a = abs(d) - row[0]
    if a <= 0.0:
        return 0.0, 0.0, 0.0, 0
    sign = 1.0 if d > 0.0 else -1.0
    side = 1 if d > 0.0 else -1
    preload, toe, k, travel, stop = row[1], row[2], row[3], row[4], row[5]
    if a < toe:
        steep = preload / toe
        return sign * steep * a, 0.5 * steep * a * a, steep, side
    low = 0.5 * preload * toe
    if a < travel:
        b = a - toe
        return sign * (preload + k * b), low + b * (preload + 0.5 * k * b), k, 2 * side
    run = travel - toe
    closed = preload + k * run
    past = a - travel
    energy = low + run * (preload + 0.5 * k * run) + past * (closed + 0.5 * stop * past)
    return sign * (closed + stop * past), energy, stop, 3 * side


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _gradient(d0, d1, row):
    """Discrete gradient of the stored energy between two extensions, and its slope in the second."""
    f0, u0, _, branch0 = _elastic(d0, row)
    f1, u1, k1, branch1 = _elastic(d1, row)
    change = d1 - d0
    if branch0 == branch1 or abs(change) < 1e-12:
        return 0.5 * (f0 + f1), 0.5 * k1
    mean = (u1 - u0) / change
    return mean, max(0.0, (f1 - mean) / change)


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _friction_size(d, row):
    """Largest friction of a coupler at an extension."""
    f, _, _, _ = _elastic(d, row)
    closed = row[1] + row[3] * (row[4] - row[2])
    return row[6] * min(abs(f), closed)


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _sign(v, width, secant):
    """Smoothed sign of a speed, and the slope that the search uses."""
    x = v / width
    root = sqrt(1.0 + x * x)
    slope = 1.0 / (root * width) if secant else 1.0 / (root * root * root * width)
    return x / root, slope


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _segment(x, guess, starts):
    """Segment of the track that a position lies in."""
    while guess > 0 and x < starts[guess]:
        guess -= 1
    while guess + 1 < len(starts) and x >= starts[guess + 1]:
        guess += 1
    return guess


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _notch_force(v, family, notch, forces, zero_notch, speed_step):
    """Force of a set of curves in a notch at a speed, signed by the notch."""
    row = zero_notch[family] + notch
    place = v / speed_step[family]
    last = forces.shape[2] - 1
    if place >= last:
        return forces[family, row, last]
    index = int(place)
    low = forces[family, row, index]
    return low + (place - index) * (forces[family, row, index + 1] - low)


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _outside(
    i, h, width, secant, pressure, notch, position, speed, segment, end, at, parts, residual, diagonal,
    mass, davis, gain, spring, shoe, curves, forces, zero_notch, speed_step,
    starts, grade, elevation, curve, gravity,
):  # fmt: skip
    """External forces on vehicle i, into its row of the equations."""
    m, v0, v1, x0 = mass[i], speed[i], end[i], position[i]
    mid = 0.5 * (v0 + v1)
    size = abs(mid)
    x1 = x0 + h * mid
    s0 = segment[i]
    s1 = _segment(x1, s0, starts)
    at[i] = s1
    if s0 == s1 or abs(x1 - x0) < 1e-9:
        slope = grade[s1]
    else:
        z0 = elevation[s0] + grade[s0] * (x0 - starts[s0])
        z1 = elevation[s1] + grade[s1] * (x1 - starts[s1])
        slope = (z1 - z0) / (x1 - x0)
    sign, steep = _sign(v1, width, secant)
    resistance = davis[i, 0] + size * (davis[i, 1] + size * davis[i, 2]) + m * curve[s1]
    brake = 0.0
    if gain[i] > 0.0 and pressure > spring[i]:
        friction = shoe[i, 0] * (size + shoe[i, 1]) / (shoe[i, 2] * size + shoe[i, 1])
        brake = gain[i] * (pressure - spring[i]) * friction
    pull = 0.0
    electric = 0.0
    if curves[i] >= 0 and notch != 0:
        force = _notch_force(size, curves[i], notch, forces, zero_notch, speed_step)
        if force > 0.0:
            pull = force
        else:
            electric = -force
    parts[i, 0] = pull
    parts[i, 1] = -electric * sign
    parts[i, 2] = -resistance * sign
    parts[i, 3] = -brake * sign
    parts[i, 4] = -m * gravity * slope
    total = pull - (electric + resistance + brake) * sign + parts[i, 4]
    residual[i] = h * total - m * (v1 - v0)
    diagonal[i] = m + h * (electric + resistance + brake) * steep


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _couple(j, h, secant, position, speed, end, spacing, coupler, pull, rub, residual, diagonal, off):
    """Coupler j between vehicles j and j + 1, into their rows of the equations."""
    row = coupler[j]
    d0 = position[j] - position[j + 1] - spacing[j]
    relative = end[j] - end[j + 1]
    d1 = d0 + 0.5 * h * (speed[j] - speed[j + 1] + relative)
    mean, stiffness = _gradient(d0, d1, row)
    size = _friction_size(0.5 * (d0 + d1), row)
    rubbing, slope = 0.0, 0.0
    if size > 0.0:
        sign, steep = _sign(relative, row[7], secant)
        rubbing, slope = size * sign, size * steep
    pull[j], rub[j] = mean + rubbing, rubbing
    residual[j] -= h * pull[j]
    residual[j + 1] += h * pull[j]
    c = h * (0.5 * h * stiffness + slope)
    off[j] = -c
    diagonal[j] += c
    diagonal[j + 1] += c


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _solve(diagonal, off, residual, end):
    """Add the solution of the symmetric tridiagonal system to the speeds (Thomas's algorithm)."""
    n = len(diagonal)
    for i in range(1, n):
        factor = off[i - 1] / diagonal[i - 1]
        diagonal[i] -= factor * off[i - 1]
        residual[i] -= factor * residual[i - 1]
    change = residual[n - 1] / diagonal[n - 1]
    end[n - 1] += change
    for i in range(n - 2, -1, -1):
        change = (residual[i] - off[i] * change) / diagonal[i]
        end[i] += change


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _commit(h, position, speed, rate, segment, work, impulse, peak, clock, end, at, residual, pull, rub, parts, mass):
    """Take a step over into the state and add up its works and impulses."""
    n = len(mass)
    clock[0] += h
    for i in range(n):
        # The equations' last remainder goes into the speed: momentum then closes to rounding.
        v1 = end[i] + residual[i] / mass[i]
        way = 0.5 * h * (speed[i] + v1)
        for p in range(5):
            work[p] += parts[i, p] * way
            impulse[0] += parts[i, p] * h
        rate[i] = (v1 - speed[i]) / h
        end[i] = v1
        at[i], segment[i] = segment[i], at[i]
    for j in range(n - 1):
        work[5] -= rub[j] * 0.5 * h * (speed[j] - speed[j + 1] + end[j] - end[j + 1])
        if pull[j] > peak[j, 0]:
            peak[j, 0], peak[j, 1] = pull[j], clock[0]
        if pull[j] < peak[j, 2]:
            peak[j, 2], peak[j, 3] = pull[j], clock[0]
    for i in range(n):
        position[i] += 0.5 * h * (speed[i] + end[i])
        speed[i] = end[i]


@numba.njit(cache=True, error_model="numpy", _nrt=False)
def advance(
    state: State,
    drive: Drive,
    fleet: Fleet,
    track: Track,
    work: Work,
    steps: int,
    time_step: float,
    width: float,
    gravity: float,
    trail: Array,
    tension: Array,
    totals: Array,
) -> int:
    """Advance over all samples of a drive.

    Args:
        state: Changed in place.
        drive: Cylinder pressures and notches, held within each sample.
        fleet: The train.
        track: The line.
        work: Scratch space.
        steps: Steps per sample.
        time_step: In s.
        width: Speed in m/s over which a friction turns round.
        gravity: In m/s2.
        trail: Receives position and speed of every vehicle at the end of each sample, shape ``(samples, 2, n)``.
        tension: Receives the force of every coupler in the last step of each sample, N, shape ``(samples, n - 1)``.
        totals: Receives ``work`` after each sample, J, shape ``(samples, 6)``.

    Returns:
        Number of samples done; fewer than asked for if a step could not be solved.
    """
    # Arrays are taken out of their tuples once: see sysid.airbrake.kernel.
    position, speed, rate, segment = state.position, state.speed, state.rate, state.segment
    done, impulse, peak, clock = state.work, state.impulse, state.peak, state.clock
    pressures, notches = drive.pressure, drive.notch
    mass, davis, gain, spring, shoe, curves = (
        fleet.mass, fleet.davis, fleet.gain, fleet.spring, fleet.shoe, fleet.curves,
    )  # fmt: skip
    spacing, coupler, forces, zero_notch, speed_step = (
        fleet.spacing, fleet.coupler, fleet.forces, fleet.zero_notch, fleet.speed_step,
    )  # fmt: skip
    starts, grade, elevation, curve = track.starts, track.grade, track.elevation, track.curve
    end, at, residual, diagonal, off = work.end, work.at, work.residual, work.diagonal, work.off
    pull, rub, parts = work.pull, work.rub, work.parts
    n = len(mass)
    for k in range(len(pressures)):
        for _ in range(steps):
            left, h = time_step, time_step
            while left > 0.0:
                h = min(h, left)
                for i in range(n):
                    end[i] = speed[i] + h * rate[i]
                solved = False
                for iteration in range(MOST_STEPS):
                    secant = iteration >= NEWTON_STEPS
                    for i in range(n):
                        _outside(
                            i, h, width, secant, pressures[k, i], notches[k, i], position, speed, segment, end, at,
                            parts, residual, diagonal, mass, davis, gain, spring, shoe, curves, forces, zero_notch,
                            speed_step, starts, grade, elevation, curve, gravity,
                        )  # fmt: skip
                    for j in range(n - 1):
                        _couple(
                            j, h, secant, position, speed, end, spacing, coupler, pull, rub, residual, diagonal, off
                        )
                    worst = 0.0
                    for i in range(n):
                        worst = max(worst, abs(residual[i]) / mass[i])
                    if worst <= TOLERANCE:
                        solved = True
                        break
                    _solve(diagonal, off, residual, end)
                if solved:
                    _commit(
                        h, position, speed, rate, segment, done, impulse, peak, clock, end, at, residual, pull, rub,
                        parts, mass,
                    )  # fmt: skip
                    left -= h
                else:
                    h *= 0.5
                    for i in range(n):
                        rate[i] = 0.0
                    if h < SMALLEST_SHARE * time_step:
                        return k
        for i in range(n):
            trail[k, 0, i] = position[i]
            trail[k, 1, i] = speed[i]
        for j in range(n - 1):
            tension[k, j] = pull[j]
        for p in range(len(done)):
            totals[k, p] = done[p]
    return len(pressures)
