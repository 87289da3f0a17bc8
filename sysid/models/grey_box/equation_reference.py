"""The slow, obviously right twin of compiled equations: their tree walked through, one Python step at a time."""

from __future__ import annotations

import cmath
import operator
from collections.abc import Callable
from collections.abc import Mapping as Dict
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sysid.equations import RUNGE_KUTTA, implicit
from sysid.equations.syntax import Call, Delayed, Name, Node, Number, Operation
from sysid.models.grey_box.grey_box_model import GreyBoxModel


class EquationTwin:
    """Equations walked through as a tree, in plain Python: of real numbers, or of complex ones for derivatives.

    It has one network at most, and one of each function that remembers.

    Args:
        model: A grey box, for its equations and terms; parameters are given.
        theta: Parameters and weights, as the model's; complex for a derivative by the complex step.
    """

    def __init__(self, model: GreyBoxModel, theta: NDArray[np.complex128]) -> None:
        self.model, self.theta = model, theta
        self.system = model.grey.system
        free = model.grey.free
        self.values = {one.name: one.start for one in model.grey.fixed} | {"pi": np.pi}
        self.values |= dict(zip((one.name for one in free), theta.tolist(), strict=False))  # Python's own are quicker
        self.weights = theta[len(free) :]

    def run(self, inputs: NDArray[np.float64], begin: Dict[str, complex]) -> NDArray[np.complex128]:
        """The free run.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``; before the first they stand.
            begin: Every state before the first sample, by name.

        Returns:
            Shape ``(n_samples, n_outputs)``.
        """
        system, model = self.system, self.model
        ahead, self.way = model.lowered.ahead, 0.0
        # Where inputs move, the state is that of one sample before the first, at which they stand.
        self.inputs = np.concatenate([inputs[:1], inputs]) if ahead else inputs
        self.past: list[dict[str, complex]] = []
        self.begin = dict(begin)
        states = {name: begin[name] for name in system.states}
        self.memory = {name: begin[name] for name in model.lowered.states if name.split()[0] in _REMEMBERING}
        found, steps = [], model.substeps
        h = model.sample_time / steps
        for _ in self.inputs:
            now = self._all(states)
            found.append([now[name] for name in model.mapping.outputs])
            later = {name: self.right[name] for name in system.discrete}
            remembered = dict(self.remembered)
            moving = np.array([states[n] for n in system.continuous], dtype=np.complex128)

            def rates(
                x: NDArray[np.complex128], behind: float, part: int, held: Dict[str, complex] = states
            ) -> NDArray[np.complex128]:
                self.way = (part + behind) / steps
                self._all({**held, **dict(zip(system.continuous, x.tolist(), strict=True))})
                self.way = 0.0
                return np.array([self.right[n] for n in system.continuous], dtype=np.complex128)

            for part in range(steps if system.continuous else 0):
                method = _explicit if model.solver == RUNGE_KUTTA else _implicit
                moving = moving + h * method(partial(rates, part=part), moving, h)
            self.past.append(now)
            states = dict(zip(system.continuous, moving, strict=True)) | later
            self.memory = remembered
        return np.array(found[int(ahead) :])

    def _input(self, name: str, at: int) -> complex:
        """An input at a sample, or on the way from there to the next."""
        channels = self.model.mapping.inputs
        values = self.inputs[:, channels.index(name)]
        way = self.way * self.model.grey.moving(channels)[channels.index(name)]
        now, later = (values[min(max(k, 0), len(values) - 1)] for k in (at, at + 1))
        return complex(now + way * (later - now))

    def _all(self, states: Dict[str, complex]) -> dict[str, complex]:
        """Everything that has a name, at some states; aside, what each state moves to, or how fast."""
        self.remembered: dict[str, complex] = {}
        now = {**self.values, **states}
        now |= {name: self._input(name, len(self.past)) for name in self.model.mapping.inputs}
        for name in self.system.order:
            now[name] = self._of(self.system.definitions[name].right, now)
        moves = (one for one in self.system.equations if one.name not in self.system.definitions)
        self.right = {one.name: self._of(one.right, now) for one in moves}
        return now

    def _of(self, node: Node, now: Dict[str, complex]) -> complex:
        if isinstance(node, Number):
            return node.value
        if isinstance(node, Name):
            return now[node.name]
        if isinstance(node, Delayed):
            lag = node.lag / self.model.sample_time if node.seconds else node.lag
            whole = int(lag + 1e-9)
            rest = max(lag - whole, 0.0)
            newer, older = self._ago(node.name, whole, now), self._ago(node.name, whole + (rest > 1e-9), now)
            return newer + rest * (older - newer)
        if isinstance(node, Operation):
            return _operated(node.operator, [self._of(one, now) for one in node.operands])
        assert isinstance(node, Call)  # noqa: S101 - there is no other node
        return self._called(node, now)

    def _ago(self, name: str, lag: int, now: Dict[str, complex]) -> complex:
        t = len(self.past)
        if lag == 0:
            return now[name]
        if name in self.model.mapping.inputs:
            return self._input(name, t - lag)
        if lag <= t:
            return self.past[t - lag][name]
        return self.begin[f"{name}[k-{lag - t}]"]

    def _called(self, node: Call, now: Dict[str, complex]) -> complex:
        a = [self._of(one, now) for one in node.parts]
        name = node.function
        if name in self.model.grey.points:
            x, y = np.array(self.model.grey.points[name]).T
            place = int(np.clip(np.searchsorted(x, a[0].real, side="right") - 1, 0, len(x) - 2))
            slope = (y[place + 1] - y[place]) / (x[place + 1] - x[place])
            inside = x[0] < a[0].real < x[-1]
            return complex(y[place] + slope * (a[0] - x[place]) if inside else np.interp(a[0].real, x, y))
        if name == "net":
            return self._net(a[: len(node.arguments)])
        before = self.memory.get(f"{name} 1", 0.0)
        if name == "relay":
            self.remembered["relay 1"] = 1.0 if a[0].real > a[1].real else before if a[0].real >= a[2].real else 0.0
        elif name == "latch":
            self.remembered["latch 1"] = 1.0 if a[0].real > 0 else 0.0 if a[1].real > 0 else before
        elif name == "hold":
            self.remembered["hold 1"] = a[0] if a[1].real > 0 else before
        else:
            return _FUNCTIONS[name](*a)
        return self.remembered[f"{name} 1"]

    def _net(self, a: list[complex]) -> complex:
        (net,) = self.model.lowered.nets
        norms, n = self.model.norms, len(a)
        z = np.array([(value - norms[2 * i]) * norms[2 * i + 1] for i, value in enumerate(a)])
        hidden = self.weights[net.hidden].reshape(net.neurons, n + 1)
        linear = self.weights[net.linear]
        total = self.weights[net.readout] @ np.tanh(hidden[:, :n] @ z + hidden[:, n]) + linear[:n] @ z + linear[n]
        return complex(norms[2 * n] * total)


class MemberTwin(EquationTwin):
    """An equation of a cascade at one sample, of what every channel was before."""

    def __init__(self, model: GreyBoxModel, seen: dict[str, list[float]]) -> None:
        super().__init__(model, model.theta.astype(np.complex128))
        self.seen = seen
        self.memory = {}

    def value(self) -> float:
        """What it gives."""
        now = self.values | {name: self.seen[name][-1] for name in self.model.mapping.inputs}
        return _real(self._of(self.system.definitions[self.model.mapping.output].right, now))

    def _ago(self, name: str, lag: int, now: Dict[str, complex]) -> complex:  # noqa: ARG002 - of one sample only
        return self.seen[name][-1 - lag]


_REMEMBERING = ("relay", "latch", "hold")

_Rates = Callable[[NDArray[np.complex128], float], NDArray[np.complex128]]
"""Of states, and how much of a step lies behind."""


def _explicit(rates: _Rates, x: NDArray[np.complex128], h: float) -> NDArray[np.complex128]:
    """The mean slope over a step of the classical Runge-Kutta method."""
    first = rates(x, 0.0)
    second = rates(x + h / 2.0 * first, 0.5)
    third = rates(x + h / 2.0 * second, 0.5)
    return (first + 2.0 * second + 2.0 * third + rates(x + h * third, 1.0)) / 6.0


def _implicit(rates: _Rates, x: NDArray[np.complex128], h: float) -> NDArray[np.complex128]:
    """The mean slope over a Rosenbrock step as its authors write it: ``k_i = f(x + h a k) + h J (gamma k)``."""
    weights, apart = (1 / 280, -4 / 105, 1 / 5, -4 / 5), 0.01  # central differences of order 8
    J, drift = np.zeros((len(x), len(x)), dtype=np.complex128), np.zeros(len(x), dtype=np.complex128)
    for reach, weight in zip((4, 3, 2, 1), weights, strict=True):
        drift += weight * (rates(x, -reach * apart) - rates(x, reach * apart)) / apart
    for j in range(len(x)):
        for reach, weight in zip((4, 3, 2, 1), weights, strict=True):
            away = reach * apart * np.eye(len(x))[j]
            J[:, j] += weight * (rates(x - away, 0.0) - rates(x + away, 0.0)) / apart
    k: list[NDArray[np.complex128]] = []
    for i in range(4):
        ahead = sum((implicit.ALPHAS[i, j] * k[j] for j in range(i)), np.zeros_like(x))
        coupled = sum((implicit.GAMMAS[i, j] * k[j] for j in range(i)), np.zeros_like(x))
        right = rates(x + h * ahead, implicit.ALPHAS[i].sum()) + h * J @ coupled + implicit.GAMMAS[i].sum() * drift
        k.append(np.asarray(np.linalg.solve(np.eye(len(x)) - h * implicit.GAMMA * J, right), dtype=np.complex128))
    return np.asarray(implicit.WEIGHTS @ np.array(k))


def _by_real(choose: Callable[..., complex]) -> Callable[..., complex]:
    return lambda *a: choose(a, key=lambda value: complex(value).real)


def _clamped(x: complex, low: complex, high: complex) -> complex:
    return min(max(x, low, key=_real), high, key=_real)


def _real(value: complex) -> float:
    return complex(value).real


_FUNCTIONS: dict[str, Callable[..., complex]] = {
    "abs": lambda x: x if x.real >= 0 else -x,
    "sqrt": lambda x: cmath.sqrt(x) if x.real > 0 else 0.0,
    "sign": lambda x: float(np.sign(x.real)),
    "log10": lambda x: cmath.log(x) / np.log(10.0),
    "min": _by_real(min),
    "max": _by_real(max),
    "clamp": _clamped,
    "saturate": _clamped,
    "deadzone": lambda x, low, high: x - _clamped(x, low, high),
    "where": lambda c, yes, no: yes if c.real > 0 else no,
    **{name: getattr(cmath, name) for name in ("exp", "log", "tanh", "sinh", "cosh", "sin", "cos", "tan", "atan")},
}


def _operated(sign: str, a: list[complex]) -> complex:
    if len(a) == 1:
        return -a[0] if sign == "-" else 1.0 - a[0]
    return _OPERATIONS[sign](*a)


_OPERATIONS: dict[str, Callable[[complex, complex], complex]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "^": operator.pow,
    "<": lambda x, y: float(x.real < y.real),
    "<=": lambda x, y: float(x.real <= y.real),
    ">": lambda x, y: float(x.real > y.real),
    ">=": lambda x, y: float(x.real >= y.real),
    "and": _by_real(min),
    "or": _by_real(max),
}
