r"""Systems of some records: subspace estimates, states that are added to them, and steps to the least prediction error.

Steps are those of :class:`~sysid.estimation.least_squares.levenberg_marquardt.LevenbergMarquardt` in a chart of local
coordinates; when no step improves the fit any more, the system is balanced, the covariance of the errors is taken
anew, and a new chart is laid there, until that changes nothing either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.errors import FitDivergedError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.provider import Linearisation
from sysid.estimation.least_squares.state import Iteration
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.colour import coloured
from sysid.estimation.linear.state_space.coordinates import Chart
from sysid.estimation.linear.state_space.provider import PredictionErrors
from sysid.estimation.linear.state_space.training import BEST
from sysid.estimation.linear.subspace.projections import Weighting
from sysid.estimation.linear.subspace.starts import ENOUGH, Subspace
from sysid.estimation.linear.subspace.system import EDGE, stabilised
from sysid.estimation.linear.subspace.yardstick import beyond_chance
from sysid.estimation.linear.transfer_function.runs import flat_prior
from sysid.estimation.results.result import Status
from sysid.models import LinearStateSpace
from sysid.models.linear.innovations import Innovations

Array = NDArray[np.float64]
Level = tuple[float, ...]

LONG = 100_000
"""Samples beyond which one solution is enough: rounding is far below the noise there."""


NESTED = 200_000
"""Samples times squared states up to which systems of fewer states are fitted first."""


POLES, LITTLE, CLEARLY = (0.0, 0.5, 0.9, 0.97, -0.5), 0.1, 1e-6
"""Poles that a further state may begin with, how strongly it is driven and read, and a gain that is one."""


FINE, COARSE, CHART = 1e-9, 1e-4, 1e3
"""Share of the loss that a step has to gain: of a fit, and at least where it is asked whether a state less would do;
how many times that a chart has to gain for another to be laid."""


CHARTS = 6
"""Charts that are laid at most."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """What was found.

    Args:
        system: In scaled numbers, balanced.
        chart: Local coordinates around it.
        n_samples: Samples that count, times outputs.
        at: Its linearisation there.
        status: How the search ended.
        curve: Its learning curve, losses as mean squared whitened errors.
        covariance: Of the innovations, in scaled numbers.
        weighting: The subspace method that it began with.
        singular_values: Canonical correlations of past and future.
        notes: What a reader should know of slow poles.
        coloured: What its errors say of the parameters where they hang together; ``None`` where they are white.
        level: Of each input the value from which integrators add it up, in scaled numbers; ``None`` where no pole is
            held at 1.
        warnings: Those of the notes that say what is wrong.
    """

    system: Innovations
    chart: Chart
    n_samples: int
    at: Linearisation
    status: Status
    curve: tuple[Iteration, ...]
    covariance: Array
    weighting: Weighting
    singular_values: Array
    notes: tuple[str, ...] = ()
    coloured: Array | None = None
    level: Level | None = None
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """Records and what is asked of a system."""

    segments: Sequence[Segment]
    orders: LinearStateSpace
    stable: bool
    largest: float = EDGE
    sums: int = 0
    """So many first states of a system are integrators that stay so."""

    @property
    def lengths(self) -> list[int]:
        """Samples of each record."""
        return [len(segment) for segment in self.segments]

    def around_errors(self, system: Innovations) -> list[Array]:
        """Errors of each record."""
        return self.errors(self.linear(system), np.eye(system.n_outputs)).errors(system)

    def best(self, subspace: Subspace, weighting: str, iterations: int, until: float) -> Found:
        """From the subspace estimate; and from one state less where that, with another state, is better already.

        Where errors are as small as those of a long ARX model, and a state less is clearly worse, nothing is left to
        look for.

        Args:
            subspace: The decomposition that estimates of all orders are taken from.
            weighting: Of the estimate.
            iterations: Steps at most.
            until: When the time is up, by the clock that counts seconds.

        Returns:
            What was found: over these records never worse than with fewer states.
        """
        start, one = self.start(subspace, weighting)
        found = replace(self.refined(start, iterations, until - now()), weighting=one)
        if not iterations or self.orders.states == 1 or sum(self.lengths) * self.orders.states**2 > NESTED:
            return found
        fewer = replace(self, orders=replace(self.orders, states=self.orders.states - 1))
        try:
            if fewer.hopeless(found, subspace, weighting, iterations, until):
                return found
            lower = fewer.best(subspace, weighting, iterations, until)
        except FitDivergedError:
            return found
        wider = self._widened(lower.system)
        if wider is None or wider[0] >= size_of(found.covariance) - CLEARLY:
            return found
        other = self.refined(wider[1], iterations, until - now())
        better = size_of(other.covariance) < size_of(found.covariance)
        return replace(other, weighting=lower.weighting) if better else found

    def hopeless(self, found: Found, subspace: Subspace, weighting: str, iterations: int, until: float) -> bool:
        """Whether these fewer states need not be looked into: what was found with more leaves next to nothing.

        They are given up where the gap would not be closed in all iterations at the rate of the last steps.
        """
        if not subspace.yardstick.reached(found.covariance, found.chart.n_parameters):
            return False
        start, seconds = self.start(subspace, weighting)[0], until - now()

        def behind(lower: Found) -> float:
            fewer = found.chart.n_parameters - lower.chart.n_parameters
            size, than = size_of(lower.covariance), size_of(found.covariance)
            return beyond_chance(size, than, n_rows=sum(self.lengths), n_parameters=fewer)

        missing = -np.expm1(-max(behind(self.at(start)), 0.0) / start.n_outputs)
        lower = self.refined(start, iterations, seconds, tolerance=max(COARSE, missing / iterations))
        return behind(lower) > 0.0

    def _widened(self, system: Innovations) -> tuple[float, Innovations] | None:
        """A system with one more state, of the pole that helps most; and its loss."""
        found = [fitted for pole in POLES if (fitted := self.with_inputs(_with_state(system, pole))) is not None]
        return min(found, key=lambda entry: entry[0], default=None)

    def start(self, subspace: Subspace, weighting: str) -> tuple[Innovations, Weighting]:
        """The subspace estimate with the least prediction error, its ``B``, ``D`` and constant fitted to that."""
        chosen = list(Weighting) if weighting == BEST else [Weighting(weighting)]
        found: list[tuple[float, int, Innovations, Weighting]] = []
        judge = self.begun() if len(chosen) > 1 and sum(map(len, self.segments)) > LONG else self
        for one in chosen:
            try:
                system = subspace.estimate(self.orders.states, one)
            except (linalg.LinAlgError, ValueError):  # not finite, or no decomposition: another one may do
                continue
            fitted = judge.with_inputs(system)
            if fitted is not None:
                found.append((fitted[0], len(found), fitted[1], one))
        if not found:
            raise FitDivergedError(
                "no subspace estimate gives a finite prediction",
                remedy="ask for fewer states, or for noise: true where the plant is unstable",
            )
        _, _, system, one = min(found, key=lambda entry: entry[:2])
        fitted = None if judge is self else self.with_inputs(system)
        return (system if fitted is None else fitted[1]), one

    def begun(self) -> Problem:
        """The same problem over the first samples of each record, which are enough to choose by."""
        return replace(self, segments=tuple(segment.first(ENOUGH) for segment in self.segments))

    def with_inputs(self, system: Innovations) -> tuple[float, Innovations] | None:
        """The loss and the system with the ``B``, ``D`` and constant that fit best; twice, for rounding.

        Args:
            system: The system.

        Returns:
            Both; ``None`` where its run is not finite.
        """
        if self.stable:
            system = stabilised(system, self.largest)
        if not self.orders.intercept:
            system = replace(system, constant=np.zeros(system.n_outputs))
        system = self._laid(system)
        for _ in range(2 if sum(map(len, self.segments)) <= LONG else 1):
            solved = self.solved(self.linear(system))
            if solved is None:
                return None
            system = solved
        errors = self.errors(self.linear(system), np.eye(system.n_outputs))
        covariance = errors.covariance(system)
        if not np.isfinite(covariance).all():
            return None
        return size_of(covariance), system

    def solved(self, chart: Chart) -> Innovations | None:
        """The system of least error in a chart in which predictions are linear.

        Args:
            chart: The chart.

        Returns:
            It; ``None`` where its run is not finite.
        """
        errors = self.errors(chart, np.eye(chart.base.n_outputs))
        at = errors.linearise(np.zeros(chart.n_parameters))
        if not errors.allowed(chart.base) or not np.isfinite(at.loss) or not at.finite:
            return None
        root, scaled = at.scaled()
        return chart.system(-np.linalg.lstsq(scaled, at.gradient / root, rcond=1e-13)[0] / root)

    def errors(self, chart: Chart, whitening: Array) -> PredictionErrors:
        """The least-squares problem over a chart."""
        return PredictionErrors(
            chart=chart, segments=self.segments, whitening=whitening, stable=self.stable, largest=self.largest
        )

    def around(self, system: Innovations) -> Chart:
        """All that changes a system."""
        o = self.orders
        fitted = {"feedthrough": o.feedthrough, "noise": o.noise, "intercept": o.intercept}
        return Chart.around(system, **fitted, sums=self.sums)

    def _laid(self, system: Innovations) -> Innovations:
        """The system in the coordinates in which a chart is laid: balanced, but where sums have to stay apart."""
        return system if self.sums else system.balanced()

    def linear(self, system: Innovations) -> Chart:
        """The part in which its predictions are linear."""
        o = self.orders
        return Chart.linear(system, feedthrough=o.feedthrough, intercept=o.intercept, sums=self.sums)

    def refined(self, system: Innovations, iterations: int, seconds: float, *, tolerance: float = FINE) -> Found:
        """The system with the least prediction error nearby."""
        began, status = now(), Status.EXACT if iterations == 0 else Status.MAX_ITERATIONS
        curve: list[Iteration] = []
        whitening = self._whitening(system)
        for _ in range(CHARTS):
            system = self._laid(system)
            chart = self.around(system)
            errors = self.errors(chart, whitening)
            zero = np.zeros(errors.chart.n_parameters)
            left = iterations - (curve[-1].iteration if curve else 0)
            if left <= 0:
                break
            spent = now() - began
            limits = Termination(max_iterations=left, max_time_s=seconds - spent, tolerance=tolerance, patience=2)
            engine = LevenbergMarquardt(termination=limits, evidence_after=None)
            solution = engine.minimise(errors, zero, flat_prior(len(zero)))
            before = curve[-1].iteration if curve else 0
            steps = solution.curve if not curve else solution.curve[1:]
            curve += [replace(one, iteration=one.iteration + before, elapsed_s=one.elapsed_s + spent) for one in steps]
            system, status = errors.chart.system(solution.theta), solution.status
            gained = solution.curve[0].mse - solution.curve[-1].mse
            if status in {Status.TIME_LIMIT, Status.INTERRUPTED} or gained <= CHART * tolerance * solution.curve[0].mse:
                break
            whitening = self._whitening(system)
        if status in {Status.NOT_IMPROVED, Status.STALLED} and curve:
            status = Status.CONVERGED  # a later chart found nothing more to gain
        found = self.at(self._laid(system), minimised=iterations > 0)
        return replace(found, status=status, curve=tuple(curve) or found.curve)

    def at(self, system: Innovations, *, minimised: bool = True) -> Found:
        """A system with its linearisation; where nothing was minimised, nothing is said of uncertainty."""
        chart = self.around(system)
        errors = self.errors(chart, self._whitening(system))
        zero = np.zeros(chart.n_parameters)
        if minimised:
            at = errors.linearise(zero)
        else:
            at = Linearisation(loss=errors.loss(zero), gradient=zero, gauss_newton=np.eye(len(zero)))
        mse = 2.0 * at.loss / max(errors.n_samples, 1)
        curve = (Iteration(iteration=0, mse=mse, damping=0.0, effective_parameters=np.nan, elapsed_s=0.0),)
        return Found(
            system=system, chart=chart, n_samples=errors.n_samples, at=at, status=Status.EXACT, curve=curve,
            covariance=errors.covariance(system), weighting=Weighting.CVA, singular_values=np.zeros(0),
        )  # fmt: skip

    def with_colour(self, found: Found) -> Found:
        """What was found, with what its errors say of the parameters where nothing models their colour."""
        if self.orders.noise:
            return found
        errors = self.errors(found.chart, self._whitening(found.system))
        return replace(found, coloured=coloured(errors, np.zeros(found.chart.n_parameters)))

    def _whitening(self, system: Innovations) -> Array:
        """What makes the errors of one sample independent and of size 1."""
        p = system.n_outputs
        covariance = self.errors(self.linear(system), np.eye(p)).covariance(system)
        size = max(float(np.trace(covariance)), 1e-20)
        for share in (1e-20, 1e-15, 1e-12):  # outputs that are made of each other leave errors of fewer dimensions
            try:
                return np.asarray(linalg.inv(linalg.cholesky(covariance + share * size * np.eye(p), lower=True)))
            except linalg.LinAlgError:
                continue
        return np.asarray(np.eye(p) / np.sqrt(size), dtype=np.float64)


def size_of(covariance: Array) -> float:
    """Logarithm of the determinant of a covariance of errors.

    Args:
        covariance: Shape ``(n_outputs, n_outputs)``.

    Returns:
        The logarithm.
    """
    return float(np.linalg.slogdet(covariance + 1e-30 * np.eye(len(covariance)))[1])


def _with_state(system: Innovations, pole: float) -> Innovations:
    """The same system beside a state of its own that every input drives a little, and every output reads."""
    n, m, p = system.n_state, system.n_inputs, system.n_outputs
    return replace(
        system,
        A=linalg.block_diag(system.A, [[pole]]),
        B=np.vstack([system.B, np.full((1, m), LITTLE)]),
        C=np.hstack([system.C, np.full((p, 1), LITTLE)]),
        K=np.vstack([system.K, np.zeros((1, p))]) if n else np.zeros((1, p)),
    )
