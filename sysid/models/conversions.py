"""Linear systems in other forms: sampled, continuous, slower, smaller, canonical; on objects of python-control.

A model becomes such an object by its ``to_control()``, or with its states by
:func:`sysid.models.converting.to_control.state_space`. The package is imported when a function is called.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.models.converting.continuous import rates
from sysid.models.converting.realisation import Ratios, observer_row
from sysid.models.linear.innovations import root_of

Array = NDArray[np.float64]


def c2d(system: Any, sample_time: float, method: str = "zoh") -> Any:
    """A continuous system sampled.

    Args:
        system: A ``control.StateSpace`` or ``control.TransferFunction`` in continuous time.
        sample_time: Seconds.
        method: ``zoh``, inputs held between samples, or another one of ``control.sample_system``, such as ``tustin``.

    Returns:
        The system in discrete time, in the form of the given one.

    Example:
        >>> import control
        >>> float(c2d(control.tf([1.0], [1.0, 1.0]), 0.1).poles()[0].real.round(6))
        0.904837
    """
    import control

    _check_time(system, discrete=False)
    return control.sample_system(system, _positive(sample_time), method=method)


def d2c(system: Any) -> Any:
    """The continuous system that gives a discrete one when its inputs are held between samples.

    Args:
        system: A ``control.StateSpace`` or ``control.TransferFunction`` in discrete time.

    Returns:
        A ``control.StateSpace``.

    Raises:
        ConfigError: If a pole is zero or negative: no continuous system of the same order gives it.

    Example:
        >>> import control
        >>> float(d2c(c2d(control.tf([1.0], [1.0, 1.0]), 0.1)).poles()[0].real.round(6))
        -1.0
    """
    import control

    _check_time(system, discrete=True)
    given = state_space(system)
    remedy = (
        "take model.continuous(), of a cascade that of each member, which keeps dead times beside the system; where "
        "that is refused too, fit fewer coefficients, or a transfer function with domain: continuous"
    )
    A, B = rates(given.A, given.B, given.dt, remedy=remedy)
    return control.StateSpace(A, B, given.C, given.D, 0, **_names(given))


def d2d(system: Any, sample_time: float) -> Any:
    """A discrete system at another sample time, inputs held between samples.

    Args:
        system: In discrete time.
        sample_time: The other one in seconds. A whole multiple of the given one always works; any other one goes
            through continuous time.

    Returns:
        A ``control.StateSpace``.

    Raises:
        ConfigError: If the discrete system has no continuous one; see :func:`d2c`.

    Example:
        >>> import control
        >>> float(d2d(control.tf([1.0], [1.0, 0.5], 0.1), 0.2).poles()[0].real)
        0.25
    """
    import control

    _check_time(system, discrete=True)
    times = _positive(sample_time) / system.dt
    if not (times >= 1.0 and abs(times - round(times)) < 1e-9 * times):
        return c2d(d2c(system), sample_time)
    given = state_space(system)
    A, B = np.eye(given.nstates), np.zeros_like(given.B)
    for _ in range(round(times)):
        A, B = given.A @ A, given.A @ B + given.B
    return control.StateSpace(A, B, given.C, given.D, float(sample_time), **_names(given))


def state_space(system: Any) -> Any:
    """A system as ``control.StateSpace``.

    Args:
        system: An object of python-control. Transfer functions become one block in observer form for each denominator
            of an output, or in controller form for each of an input where that takes fewer states, in balanced scales:
            what shares its poles shares its states, and nothing else is joined.

    Returns:
        The state space.

    Raises:
        ConfigError: If a transfer function has more zeros than poles.

    Example:
        >>> import control
        >>> shared = [1.0, -1.5, 0.7]
        >>> state_space(control.tf([[[1.0], [0.5]]], [[shared, shared]], 0.1)).nstates
        2
    """
    import control

    if not isinstance(system, control.TransferFunction):
        return control.ss(system)
    rows, columns = _observer(system.num, system.den), _observer(*(_across(x) for x in (system.num, system.den)))
    if len(columns[0]) < len(rows[0]):
        A, B, C, D = columns[0].T, columns[2].T, columns[1].T, columns[3].T
    else:
        A, B, C, D = rows
    return control.StateSpace(*_scaled(A, B, C), D, system.dt, **_names(system))


def _scaled(A: Array, B: Array, C: Array) -> tuple[Array, Array, Array]:
    """The same system with states of a like size; scaling by powers of two, which rounds nothing."""
    if not len(A):
        return A, B, C
    found, (scale, _) = scipy.linalg.matrix_balance(A, permute=False, separate=True)
    return found, B / scale[:, np.newaxis], C * scale


def _across(of: Any) -> list[list[Array]]:
    """What stands in rows by columns."""
    return [list(column) for column in zip(*of, strict=True)]


def _observer(nums: Any, dens: Any) -> tuple[Array, Array, Array, Array]:
    """Output below output, each with states of its own."""
    rows = []
    for num, den in zip(nums, dens, strict=True):
        parts: list[Ratios] = []
        for j, pair in enumerate(zip(num, den, strict=True)):
            up, down = (np.trim_zeros(np.asarray(one, dtype=np.float64), "f") for one in pair)
            if len(up) > len(down):
                raise ConfigError(
                    "the transfer function has no state space",
                    expected="at most as many zeros as poles",
                    got=f"{len(up) - 1} zeros and {len(down) - 1} poles",
                    remedy="add poles that are fast enough not to matter",
                )
            top, bottom = np.pad(up, (len(down) - len(up), 0)) / down[0], down / down[0]
            same = next((part for part in parts if np.array_equal(part[0], bottom)), None)
            if same is None:
                parts.append((bottom, {j: top}))
            else:
                same[1][j] = top
        rows.append(observer_row(parts, len(num)))
    return (
        np.asarray(scipy.linalg.block_diag(*(A for A, *_ in rows))).reshape(2 * (sum(len(A) for A, *_ in rows),)),
        np.concatenate([B for _, B, *_ in rows]),
        np.asarray(scipy.linalg.block_diag(*(C for *_, C, _ in rows))),
        np.concatenate([D for *_, D in rows]),
    )


def transfer_function(system: Any) -> Any:
    """A system as ``control.TransferFunction``; with many states its coefficients carry fewer digits.

    Args:
        system: An object of python-control.

    Returns:
        One row of transfer functions an output, one column an input.
    """
    import control

    return control.tf(system)


WELL_CONDITIONED = 1e-12
"""Least ratio of singular values of a change of coordinates whose result has digits left."""


def canonical(system: Any, form: str) -> Any:
    """The same system in coordinates of the state that have a name.

    Args:
        system: An object of python-control, in either time.
        form: ``modal``: the poles stand on the diagonal, pairs as blocks ``[[re, im], [-im, re]]``, those of largest
            magnitude first. ``companion``: the denominator stands in the last column and the input enters the first
            state, as of MATLAB's ``canon``. ``observable``: the denominator stands in the first column and the output
            is the first state. The latter two are of one input, and of one output.

    Returns:
        A ``control.StateSpace``.

    Raises:
        ConfigError: If there is no such form, or the system has none: poles that are equal, states that are not reached
            or not seen, several inputs or outputs.

    Example:
        >>> import control
        >>> canonical(control.tf([1.0], [1.0, 3.0, 2.0]), "companion").A.round(9).tolist()
        [[0.0, -2.0], [1.0, -3.0]]
    """
    import control

    given = state_space(system)
    A, B, C = (np.asarray(part, dtype=np.float64) for part in (given.A, given.B, given.C))
    if form == "modal":
        T = _eigenvectors(A)
    elif form == "companion" and B.shape[1] == 1:
        T = _krylov(A, B[:, 0])
    elif form == "observable" and C.shape[0] == 1:
        seen = _krylov(A.T, C[0]).T
        denominator = np.poly(A)
        # From the observability matrix of the form itself, which is triangular.
        own = np.array([[denominator[i - j] if i >= j else 0.0 for j in range(len(A))] for i in range(len(A))])
        T = scipy.linalg.pinv(own @ seen)
    else:
        raise ConfigError(
            "no such form of this system",
            where="form",
            expected="modal; of one input companion, of one output observable",
            got=f"{form}, {B.shape[1]} inputs and {C.shape[0]} outputs",
            remedy="write modal, or take one input and one output",
        )
    sizes = scipy.linalg.svdvals(T)
    if len(T) and not sizes[-1] > WELL_CONDITIONED * sizes[0]:
        raise ConfigError(
            f"the system has no {form} form",
            expected="poles that differ, and states that are reached and seen",
            got=f"coordinates that are singular to {sizes[-1] / sizes[0]:.1e}",
            remedy="reduce the system first (reduced), or leave its coordinates as they are",
        )
    inverse = scipy.linalg.inv(T)
    return control.StateSpace(inverse @ A @ T, inverse @ B, C @ T, given.D, given.dt, **_names(given))


def _krylov(A: Array, b: Array) -> Array:
    """``b, A b, A^2 b, ...`` side by side."""
    columns = [b]
    for _ in range(len(A) - 1):
        columns.append(A @ columns[-1])
    return np.column_stack(columns)


def _eigenvectors(A: Array) -> Array:
    """Real eigenvectors, of a pair the real and the imaginary part; by falling magnitude of the pole."""
    poles, vectors = scipy.linalg.eig(A)
    columns: list[Array] = []
    for i in np.lexsort((-poles.imag, -poles.real, -np.abs(poles).round(12))):
        if poles[i].imag == 0.0:
            columns.append(vectors[:, i].real)
        elif poles[i].imag > 0.0:
            columns += [vectors[:, i].real, vectors[:, i].imag]
    return np.column_stack(columns) if columns else np.zeros((0, 0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Reduction:
    """A smaller system, and how far off it can be.

    Args:
        system: A ``control.StateSpace`` with fewer states.
        singular_values: Hankel singular values of the given one, descending.
        bound: What the gain between the two is at most at any frequency: twice the sum of the singular values left out.
    """

    system: Any
    singular_values: Array
    bound: float


def reduced(system: Any, states: int) -> Reduction:
    """A system with fewer states, by balanced truncation (Moore 1981; the bound of Enns and Glover).

    Args:
        system: A stable system of python-control.
        states: How many states are kept.

    Returns:
        The reduction.

    Raises:
        ConfigError: If the system is not stable, or the number is not between 0 and that of its states.

    Example:
        >>> import control
        >>> found = reduced(control.tf([1.0, 10.1], [1.0, 11.0, 10.0]), 1)
        >>> found.system.nstates, bool(found.bound < 0.02)
        (1, True)
    """
    import control

    given = state_space(system)
    discrete = given.isdtime(strict=True)
    poles = given.poles()
    if len(poles) and not (np.abs(poles).max() < 1.0 if discrete else poles.real.max() < 0.0):
        raise ConfigError(
            "only a stable system can be balanced",
            expected="all poles inside the unit circle" if discrete else "all poles left of the imaginary axis",
            got=f"the slowest at {max(poles, key=abs if discrete else np.real):.6g}",
            remedy="reduce its stable part, or fit a smaller model with stable: true",
        )
    if not 0 <= states <= given.nstates:
        raise ConfigError(
            "not a number of states to keep",
            where="states",
            expected=f"0 to {given.nstates}",
            got=states,
            remedy="keep as many as there are large singular values",
        )
    solve = (
        scipy.linalg.solve_discrete_lyapunov
        if discrete
        else (lambda A, Q: scipy.linalg.solve_continuous_lyapunov(A, -Q))
    )
    A, B, C = _scaled(given.A, given.B, given.C)
    P, Q = root_of(solve(A, B @ B.T)), root_of(solve(A.T, C.T @ C))
    U, sizes, Vt = scipy.linalg.svd(Q.T @ P)
    # Projections of the square-root method: nothing is inverted but the singular values that are kept.
    scale = 1.0 / np.sqrt(sizes[:states])
    left, right = (U[:, :states] * scale).T @ Q.T, P @ Vt[:states].T * scale
    small = control.StateSpace(left @ A @ right, left @ B, C @ right, given.D, given.dt, **_names(given))
    return Reduction(system=small, singular_values=sizes, bound=float(2.0 * sizes[states:].sum()))


def _names(system: Any) -> dict[str, list[str]]:
    return {"inputs": list(system.input_labels), "outputs": list(system.output_labels)}


def _positive(sample_time: float) -> float:
    if not np.isfinite(sample_time) or sample_time <= 0.0:
        raise ConfigError(
            "not a sample time", where="sample_time", expected="seconds above 0", got=sample_time, remedy="correct it"
        )
    return float(sample_time)


def _check_time(system: Any, *, discrete: bool) -> None:
    if system.isdtime(strict=True) is not discrete:
        known = "discrete" if discrete else "continuous"
        raise ConfigError(
            f"the system is not in {known} time",
            expected=f"a system in {known} time",
            got=f"dt = {system.dt}",
            remedy="use d2d from one sample time to another, c2d from continuous time, d2c into it",
        )
