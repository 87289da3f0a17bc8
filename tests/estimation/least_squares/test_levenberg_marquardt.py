"""The engine against SciPy and against problems whose answer is known."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm
from scipy.optimize import least_squares, lsq_linear

from sysid.estimation.least_squares.evidence import Group, Prior, update
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.results.result import Status


@dataclass(eq=False)
class Residuals(AbstractProvider):
    """Any residual function with its Jacobian."""

    function: object
    jacobian: object
    n_samples: int

    def loss(self, theta):
        return 0.5 * float(np.sum(self.function(theta) ** 2))

    def linearise(self, theta, *, correlation=True):  # noqa: ARG002
        e, J = self.function(theta), self.jacobian(theta)
        return Linearisation(loss=0.5 * float(e @ e), gradient=J.T @ e, gauss_newton=J.T @ J)


def flat_prior(n: int, alpha: float = 0.0) -> Prior:
    groups = (Group(name="all", members=np.arange(n)),)
    return Prior(centre=np.zeros(n), groups=groups, alphas=np.array([alpha]), beta=1.0)


ROSENBROCK = Residuals(
    function=lambda x: np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]]),
    jacobian=lambda x: np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]]),
    n_samples=2,
)


def test_rosenbrock_ends_in_its_valley():
    engine = LevenbergMarquardt(termination=Termination(max_iterations=200, patience=200), evidence_after=None)
    solution = engine.minimise(ROSENBROCK, np.array([-1.2, 1.0]), flat_prior(2))
    assert_allclose(solution.theta, [1.0, 1.0], atol=1e-6)


def test_an_exponential_fit_agrees_with_scipy():
    rng = np.random.default_rng(0)
    t = np.linspace(0.0, 3.0, 50)
    y = 2.0 * np.exp(-1.3 * t) + 0.5 + 0.01 * rng.standard_normal(50)

    def residual(p):
        return p[0] * np.exp(-p[1] * t) + p[2] - y

    def jacobian(p):
        e = np.exp(-p[1] * t)
        return np.column_stack([e, -p[0] * t * e, np.ones_like(t)])

    start = np.array([1.0, 0.5, 0.0])
    engine = LevenbergMarquardt(termination=Termination(max_iterations=100, patience=100), evidence_after=None)
    solution = engine.minimise(Residuals(residual, jacobian, 50), start, flat_prior(3))
    assert_allclose(solution.theta, least_squares(residual, start, jacobian, method="lm").x, rtol=1e-6)


def test_the_units_of_the_parameters_do_not_matter():
    scale = np.array([1e6, 1e-6])
    scaled = Residuals(
        function=lambda x: ROSENBROCK.function(x * scale),
        jacobian=lambda x: ROSENBROCK.jacobian(x * scale) * scale,
        n_samples=2,
    )
    engine = LevenbergMarquardt(termination=Termination(max_iterations=30, patience=30), evidence_after=None)
    plain = engine.minimise(ROSENBROCK, np.array([-1.2, 1.0]), flat_prior(2))
    other = engine.minimise(scaled, np.array([-1.2, 1.0]) / scale, flat_prior(2))
    assert_allclose(other.theta * scale, plain.theta, rtol=1e-6)


def test_at_a_minimum_a_fit_stalls_and_is_never_worse_than_its_start():
    engine = LevenbergMarquardt(evidence_after=None)
    solution = engine.minimise(ROSENBROCK, np.array([1.0, 1.0]), flat_prior(2))
    assert solution.status in {Status.NOT_IMPROVED, Status.CONVERGED}
    assert solution.at.loss == 0.0


def test_a_resumed_fit_goes_where_an_undisturbed_one_goes():
    whole = LevenbergMarquardt(termination=Termination(max_iterations=12, patience=99), evidence_after=None)
    half = LevenbergMarquardt(termination=Termination(max_iterations=5, patience=99), evidence_after=None)
    start = np.array([-1.2, 1.0])
    undisturbed = whole.minimise(ROSENBROCK, start, flat_prior(2))
    first = half.minimise(ROSENBROCK, start, flat_prior(2))
    assert first.status is Status.MAX_ITERATIONS
    assert_allclose(whole.resume(ROSENBROCK, first.state).theta, undisturbed.theta, rtol=0.0, atol=0.0)


def linear_problem(n: int, noise: float, seed: int) -> tuple[Residuals, np.ndarray]:
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, 5))
    truth = np.array([1.0, -2.0, 0.5, 0.0, 0.0])
    y = X @ truth + noise * rng.standard_normal(n)
    return Residuals(lambda w: X @ w - y, lambda _: X, n), truth


def test_the_evidence_finds_the_noise():
    problem, truth = linear_problem(400, noise=0.1, seed=1)
    engine = LevenbergMarquardt(termination=Termination(max_iterations=30, patience=30), evidence_after=1)
    solution = engine.minimise(problem, np.zeros(5), flat_prior(5, alpha=1e-2))
    assert solution.evidence is not None
    assert solution.evidence.beta == pytest.approx(1.0 / 0.1**2, rel=0.2)
    assert_allclose(solution.theta, truth, atol=0.03)
    assert solution.evidence.total_effective_parameters == pytest.approx(5.0, abs=0.1)


def test_the_evidence_is_asked_at_a_minimum_however_soon_that_is_reached():
    problem, _ = linear_problem(400, noise=0.1, seed=1)
    solution = LevenbergMarquardt(evidence_after=30).minimise(problem, np.zeros(5), flat_prior(5, alpha=1e-2))
    assert solution.status is Status.CONVERGED
    assert solution.state.iteration < 30
    assert solution.evidence.beta == pytest.approx(1.0 / 0.1**2, rel=0.2)
    assert LevenbergMarquardt(evidence_after=None).minimise(problem, np.zeros(5), flat_prior(5)).evidence is None


def test_the_evidence_of_a_linear_model_is_the_marginal_likelihood():
    rng = np.random.default_rng(3)
    X, y = rng.standard_normal((30, 4)), rng.standard_normal(30)
    alpha, beta = 0.7, 2.5
    prior = Prior(
        centre=np.zeros(4), groups=(Group(name="all", members=np.arange(4)),), alphas=np.array([alpha]), beta=beta
    )
    H = beta * X.T @ X + alpha * np.eye(4)
    theta = beta * np.linalg.solve(H, X.T @ y)
    e = X @ theta - y
    at = Linearisation(loss=0.5 * e @ e, gradient=X.T @ e, gauss_newton=X.T @ X)
    _, evidence = update(prior, theta, at, 30)
    covariance = np.eye(30) / beta + X @ X.T / alpha
    _, log_det = np.linalg.slogdet(2.0 * np.pi * covariance)
    assert evidence.log_evidence == pytest.approx(-0.5 * (y @ np.linalg.solve(covariance, y) + log_det), rel=1e-10)


def test_effective_parameters_are_those_of_the_rank_where_the_matrix_is_singular():
    rng = np.random.default_rng(4)
    X = rng.standard_normal((50, 3)) @ rng.standard_normal((3, 20))
    groups = (Group(name="a", members=np.arange(10)), Group(name="b", members=np.arange(10, 20)))
    prior = Prior(centre=np.zeros(20), groups=groups, alphas=np.array([1e-2, 1e-2]), beta=1e6)
    at = Linearisation(loss=1.0, gradient=np.zeros(20), gauss_newton=X.T @ X)
    _, evidence = update(prior, rng.standard_normal(20), at, 50)
    # Entries of the matrix are of order 1e10 beside its identity: rounding moves each eigenvalue by some 1e-6.
    assert evidence.total_effective_parameters == pytest.approx(3.0, abs=1e-4)


def test_effective_parameters_stay_between_zero_and_all_whatever_the_conditioning():
    rng = np.random.default_rng(4)
    X = rng.standard_normal((50, 20)) * 10.0 ** rng.uniform(-8, 8, 20)
    groups = (Group(name="a", members=np.arange(10)), Group(name="b", members=np.arange(10, 20)))
    prior = Prior(centre=np.zeros(20), groups=groups, alphas=np.array([1e-6, 1e-6]), beta=1e8)
    at = Linearisation(loss=1.0, gradient=np.zeros(20), gauss_newton=X.T @ X)
    _, evidence = update(prior, rng.standard_normal(20), at, 50)
    assert all(0.0 <= gamma <= 10.0 for gamma in evidence.effective_parameters.values())


def test_residuals_that_persist_count_as_fewer_samples():
    problem, _ = linear_problem(400, noise=0.1, seed=1)
    at = problem.linearise(np.zeros(5))
    white = update(flat_prior(5, alpha=1.0), np.ones(5), at, 400)[0]
    persistent = Linearisation(loss=at.loss, gradient=at.gradient, gauss_newton=at.gauss_newton, correlation_time=10.0)
    slow = update(flat_prior(5, alpha=1.0), np.ones(5), persistent, 400)[0]
    assert slow.beta == pytest.approx(white.beta / 10.0, rel=0.15)


def test_sensitivities_near_the_largest_number_end_in_no_step_and_no_warning():
    """A free run that explodes has them: the start is damped until it is given up, and keeps its parameters."""
    exploding = Residuals(
        function=np.copy,
        jacobian=lambda _: np.array([[1.0, 1e153], [1e153, 1e-160]]),
        n_samples=2,
    )
    solution = LevenbergMarquardt(evidence_after=None).minimise(exploding, np.array([1.0, 1e-3]), flat_prior(2))
    assert_allclose(solution.theta, [1.0, 1e-3])


class _Line(AbstractProvider):
    """Residuals ``A theta - b`` within bounds."""

    def __init__(self, A: np.ndarray, b: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
        self.A, self.b, self.sides, self.n_samples = A, b, (low, high), len(b)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self.sides

    def loss(self, theta: np.ndarray) -> float:
        return 0.5 * float(np.sum((self.A @ theta - self.b) ** 2))

    def linearise(self, theta: np.ndarray, *, correlation: bool = True) -> Linearisation:  # noqa: ARG002
        error = self.A @ theta - self.b
        return Linearisation(loss=self.loss(theta), gradient=self.A.T @ error, gauss_newton=self.A.T @ self.A)


@pytest.mark.parametrize("seed", range(6))
def test_bounds_give_the_least_squares_within_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, b = rng.standard_normal((30, 5)), 3.0 * rng.standard_normal(30)
    low, high = np.full(5, -0.2), rng.uniform(0.0, 0.4, 5)
    line = _Line(A, b, low, high)
    found = LevenbergMarquardt(evidence_after=None).minimise(line, np.zeros(5), flat_prior(5, 1e-12))
    assert found.theta == pytest.approx(lsq_linear(A, b, (low, high), tol=1e-14).x, abs=1e-6)


class _Exchanger(AbstractProvider):
    """Two volumes that exchange heat, from the inlet of one to both temperatures: without a volume there is no run."""

    n_samples = 120

    def __init__(self) -> None:
        self.inlet = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, 12), 5)
        self.measured = self._run(np.array([1.0, 3.0, 2.0]))

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(3), np.full(3, np.inf)

    def loss(self, theta: np.ndarray) -> float:
        return 0.5 * float(np.sum((self._run(theta) - self.measured) ** 2)) if theta[1:].min() > 0.0 else np.inf

    def linearise(self, theta: np.ndarray, *, correlation: bool = True) -> Linearisation:  # noqa: ARG002
        moved = [1e-6 * theta[i] * np.eye(3)[i] for i in range(3)]
        J = np.column_stack([(self._run(theta + d) - self._run(theta - d)) / (2.0 * d.sum()) for d in moved])
        error = self._run(theta) - self.measured
        return Linearisation(loss=self.loss(theta), gradient=J.T @ error, gauss_newton=J.T @ J)

    def _run(self, theta: np.ndarray) -> np.ndarray:
        exchange, cold, hot = theta
        A = np.array([[-(1.0 + exchange) / hot, exchange / hot], [exchange / cold, -(1.0 + exchange) / cold]])
        step = expm(0.5 * A)
        gain = np.linalg.solve(A, (step - np.eye(2)) @ np.array([1.0 / hot, 0.0]))
        states = [np.zeros(2)]
        for u in self.inlet[:-1]:
            states.append(step @ states[-1] + gain * u)
        return np.array(states).ravel()


@pytest.mark.parametrize("start", [(0.1, 0.3, 20.0), (10.0, 30.0, 0.2)])
def test_a_bound_without_a_run_is_approached_and_holds_nothing_else_back(start: tuple[float, ...]) -> None:
    # Ten times off. The first steps lead to a volume of 0; more damping there kept all others where they were.
    found = LevenbergMarquardt(evidence_after=None).minimise(_Exchanger(), np.array(start), flat_prior(3, 1e-12))
    assert found.theta == pytest.approx([1.0, 3.0, 2.0], rel=1e-6)
    assert found.state.iteration < 20


def test_a_bound_is_met_exactly() -> None:
    # 0.7 + (0.1 - 0.7) is less than 0.1: the parameter then stands beyond its bound, or short of it.
    line = _Line(np.eye(1), np.array([-5.0]), np.array([0.1]), np.array([np.inf]))
    found = LevenbergMarquardt(evidence_after=None).minimise(line, np.array([0.7]), flat_prior(1, 1e-12))
    assert found.theta[0] == 0.1


def test_a_precision_that_is_known_is_not_the_evidences_to_find() -> None:
    groups = tuple(Group(name=f"{i}", members=np.array([i]), known=i == 0) for i in range(2))
    prior = Prior(centre=np.zeros(2), groups=groups, alphas=np.array([0.3, 0.3]), beta=1.0)
    at = Linearisation(loss=1.0, gradient=np.zeros(2), gauss_newton=np.eye(2))
    found, _ = update(prior, np.ones(2), at, 50)
    assert found.alphas[0] == 0.3
    assert found.alphas[1] != 0.3


@dataclass(eq=False)
class _Steep(AbstractProvider):
    """A slope that a float holds and whose product with its own step it does not."""

    n_samples: int = 1

    def loss(self, theta):  # noqa: ARG002 - as every provider
        return 1.0

    def linearise(self, theta, *, correlation=True):  # noqa: ARG002
        return Linearisation(loss=1.0, gradient=np.array([1e308]), gauss_newton=np.array([[1e300]]))


def test_a_step_whose_promise_is_beyond_numbers_is_not_taken_and_no_warning() -> None:
    engine = LevenbergMarquardt(termination=Termination(max_iterations=1), evidence_after=None)
    solution = engine.minimise(_Steep(), np.zeros(1), flat_prior(1))
    assert solution.theta.tolist() == [0.0]


def test_a_slow_way_through_a_valley_is_no_minimum() -> None:
    groups = (Group(name="all", members=np.arange(2), known=True),)
    prior = Prior(centre=np.zeros(2), groups=groups, alphas=np.array([1e-12]), beta=1.0)
    engine = LevenbergMarquardt(termination=Termination(max_iterations=200, patience=200), evidence_after=None)
    assert_allclose(engine.minimise(ROSENBROCK, np.array([-1.2, 1.0]), prior).theta, [1.0, 1.0], atol=1e-6)
