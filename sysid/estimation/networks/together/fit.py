"""Training of whole cascades: how, from where, and which of the states on the way is kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.clock import now
from sysid.estimation.least_squares.checkpoints import checkpoints_of
from sysid.estimation.least_squares.damping import DAMPINGS
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.state import Iteration, Solution
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.networks.basis import RebasedProvider
from sysid.estimation.networks.starts.multistart import INITIAL_ALPHA
from sysid.estimation.networks.starts.result import left_told
from sysid.estimation.networks.together.layout import JointLayout
from sysid.estimation.networks.together.leading_windows import ENOUGH, PATIENCE, SHARE, LeadingWindows
from sysid.estimation.networks.together.options import JointTraining
from sysid.estimation.networks.together.provider import CascadeProvider
from sysid.estimation.networks.together.result import CascadeFit
from sysid.estimation.networks.training import FitProgress
from sysid.estimation.parameters.findings import Findings, with_evidence
from sysid.estimation.results.attempts import Attempt
from sysid.estimation.results.result import Status
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import Cascade
from sysid.traces import Trace

NEGLIGIBLE = 1e-6
"""Squared residual below which a target counts as met: that of a thousandth of the error that counts as one. Without it
a target that is exactly right on a trace, such as a channel held at its bound, would outweigh all others."""

AS_GIVEN, IN_WINDOWS = 1, 2
"""The starts: the members as they were, and what was trained on windows first."""
NAMES = {AS_GIVEN: "as given", IN_WINDOWS: "by windows"}
"""What their runs are kept under."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Candidate:
    """One start as it stood at a checkpoint; without a solution, as it was given."""

    start: int
    model: Cascade
    score: float
    loss: float
    solution: Solution | None = None

    @property
    def iteration(self) -> int:
        return self.solution.state.iteration if self.solution else 0

    def attempt(self, *, chosen: bool) -> Attempt:
        """What is kept of it."""
        solution, evidence = self.solution, self.solution.evidence if self.solution else None
        return Attempt(
            start=self.start,
            seed=None,
            iterations=self.iteration,
            elapsed_s=solution.curve[-1].elapsed_s if solution and solution.curve else 0.0,
            estimation_mse=self.loss,
            selection_mse=self.score,
            log_evidence=evidence.log_evidence if evidence else -np.inf,
            effective_parameters=evidence.total_effective_parameters if evidence else np.nan,
            chosen=chosen,
            status=solution.status.name if solution else "",
        )

    @property
    def origin(self) -> str:
        return {AS_GIVEN: "the members as they were", IN_WINDOWS: "what windows led to"}[self.start]

    @property
    def sentence(self) -> str:
        on_others = "" if np.isnan(self.score) else f", on the selection traces {self.score:.4g}"
        return f"from {self.origin} after {self.iteration} iterations: mean squared residual {self.loss:.4g}{on_others}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Joint:
    """One fit of a cascade: what its starts have in common.

    Args:
        provider: Residuals and Jacobians, over plain parameters.
        layout: Priors and basis.
        training: How to train.
        selection: Traces that choose among the states looked at, by the geometric mean over traces and targets of the
            squared error; without them the least loss chooses.
        on_progress: Called after every iteration.
    """

    provider: CascadeProvider
    layout: JointLayout
    training: JointTraining
    selection: Sequence[Trace] = ()
    on_progress: Callable[[FitProgress], None] = lambda _: None

    def fit(self, begun: NDArray[np.float64]) -> CascadeFit:
        """Train from a start, and from what training on windows makes of it, where there are such.

        Args:
            begun: Parameters of the provider's own cascade in the basis.

        Returns:
            The best state seen; the start is one of them.
        """
        training, began = self.training, now() - checkpoints_of(self.on_progress).earlier_s
        windows = LeadingWindows.of(training.windows, self.provider, self.layout.to_plain @ begun)
        led, interrupted = self._through(windows.providers, begun, began)
        seen = [self._candidate(AS_GIVEN, begun, None)]
        # What windows led to may fall fast and end worse than the start that they began from: none of the two goes.
        alive: dict[int, Solution | NDArray[np.float64]] = {AS_GIVEN: begun}
        if windows.providers:
            alive[IN_WINDOWS] = led
        for checkpoint in range(1, 1 if interrupted else training.checkpoints + 1):
            reached: dict[int, Solution] = {}
            for start, where in alive.items():
                name = f"start {NAMES[start]}, checkpoint {checkpoint}"
                solution = self._advance(where, checkpoint, began, f"{start}/{len(alive)}", name)
                if not isinstance(where, Solution) or solution.state is not where.state:
                    seen.append(self._candidate(start, solution.theta, solution))
                reached[start] = solution
                interrupted = solution.status is Status.INTERRUPTED
                if interrupted:
                    break
            alive |= reached
            late = now() - began > training.max_time_s
            if interrupted or late or not any(_unfinished(one) for one in reached.values()):
                break
        return self._result(seen, windows.told, interrupted=interrupted, seconds=now() - began)

    def _through(
        self, windows: Sequence[CascadeProvider], where: NDArray[np.float64], began: float
    ) -> tuple[NDArray[np.float64], bool]:
        """Where a start is led by windows, on which nobody chooses, and whether it was interrupted there."""
        training = self.training
        enough = replace(
            training,
            tolerance=max(training.tolerance, ENOUGH),
            patience=min(training.patience, PATIENCE),
            max_time_s=training.max_time_s * SHARE,
        )
        for inner in windows:
            short = replace(self, provider=inner, training=enough)
            found = short._advance(where, self.training.checkpoints, began, "1/1", f"windows of {inner.window}")
            if found.status is Status.INTERRUPTED:
                return where, True
            where = found.theta
        return where, False

    def _advance(
        self, where: Solution | NDArray[np.float64], checkpoint: int, began: float, which: str, name: str
    ) -> Solution:
        provider = RebasedProvider(inner=self.provider, to_plain=self.layout.to_plain, between=self.layout.bounds)
        keep = checkpoints_of(self.on_progress)
        # The run's own time counts towards its limit by itself; what is left of the whole is without it.
        engine = self._engine(checkpoint, began + keep.spent_s(name), which)
        if isinstance(where, Solution):
            return keep.resume(name, engine, provider, where.state) if _unfinished(where) else where
        # As for a network alone: the noise is taken to be as large as the start's error.
        beta = 0.5 * provider.n_samples / max(provider.loss(where), np.finfo(np.float64).tiny)
        return keep.minimise(name, engine, provider, where, self.layout.prior(alpha=INITIAL_ALPHA, beta=beta))

    def _engine(self, checkpoint: int, began: float, which: str) -> LevenbergMarquardt:
        training = self.training
        start, _, starts = which.partition("/")

        def report(entry: Iteration) -> None:
            self.on_progress(
                FitProgress(
                    stage="whole cascade",
                    start=int(start),
                    starts=int(starts),
                    iteration=entry.iteration,
                    max_iterations=training.max_iterations,
                    mse=entry.mse,
                    elapsed_s=entry.elapsed_s,
                    fraction=min(1.0, entry.iteration / training.max_iterations),
                )
            )

        limits = Termination(
            max_iterations=max(1, round(training.max_iterations * checkpoint / training.checkpoints)),
            max_time_s=max(0.0, training.max_time_s - (now() - began)),
            tolerance=training.tolerance,
            patience=training.patience,
        )
        return LevenbergMarquardt(termination=limits, damping=DAMPINGS[training.damping](), on_iteration=report)

    def _candidate(self, start: int, theta: NDArray[np.float64], solution: Solution | None) -> _Candidate:
        plain = self.layout.to_plain @ theta
        # A given start is kept to the last digit, which the way into the basis and back would change.
        model = self.provider.at(plain) if solution else self.provider.cascade
        loss = solution.at.loss if solution else self.provider.loss(plain)
        mse = 2.0 * loss / self.provider.n_samples
        return _Candidate(start=start, model=model, score=self._score(model), loss=mse, solution=solution)

    def _score(self, model: Cascade) -> float:
        """As between the starts of a network: one trace on which all fail must not choose alone."""
        scores = []
        for trace in self.selection:
            run = model.simulate_trace(trace)
            counts = trace.counted(self.provider.cascade.inputs, self.provider.errors)
            for (name, error), seen in zip(self.provider.errors.items(), counts.T, strict=True):
                if seen.any():
                    scores.append(float(np.mean((run[name] - trace[name])[seen] ** 2)) / error**2)
        return float(np.exp(np.mean(np.log(np.maximum(scores, NEGLIGIBLE))))) if scores else float("nan")

    def _result(
        self, seen: Sequence[_Candidate], told: Sequence[str], *, interrupted: bool, seconds: float
    ) -> CascadeFit:
        chosen = min(seen, key=lambda one: _last(one.score if self.selection else one.loss))
        curve = chosen.solution.curve if chosen.solution else ()
        uncertainty, warnings = self._known(chosen.solution)
        left = self._left(chosen.model)
        how = "by the selection traces" if self.selection else "by its loss on the estimation traces"
        return CascadeFit(
            model=chosen.model,
            status=self._status(chosen, seen, left, interrupted=interrupted),
            errors=dict(self.provider.errors),
            history={
                "iteration": np.array([entry.iteration for entry in curve], dtype=np.float64),
                "loss": np.array([entry.mse for entry in curve]),
                "effective_parameters": np.array([entry.effective_parameters for entry in curve]),
                "elapsed_s": np.array([entry.elapsed_s for entry in curve]),
            },
            train_time_s=seconds,
            seed=None,
            evidence=chosen.solution.evidence if chosen.solution else None,
            notes=(
                *told,
                f"Chosen {how} among {len(seen)} checkpoints: {chosen.sentence}.",
                *_others([one for one in seen if one is not chosen]),
            ),
            warnings=(*warnings, *left_told(left)),
            attempts=tuple(one.attempt(chosen=one is chosen) for one in seen),
            uncertainty=uncertainty,
            solution=chosen.solution,
        )

    def _known(self, solution: Solution | None) -> tuple[Uncertainty | None, tuple[str, ...]]:
        """What is known of the parameters of equations, and what they leave open."""
        named, n = self.layout.named, self.provider.n_samples
        if not named:
            return None, ()
        if solution is None:
            return None, ("The start was kept: the parameters of equations stand where they stood.",)
        findings = Findings.of(with_evidence(solution, n), self.layout, named)
        return findings.uncertainty(2.0 * solution.at.loss / max(n - len(solution.theta), 1)), findings.warnings

    def _left(self, model: Cascade) -> tuple[str, ...]:
        """Names of the records over which the free run leaves its bounds."""
        traces = (*self.provider.traces, *self.selection)
        runs = [(trace.name, model.simulate_trace(trace)) for trace in traces]
        return tuple(name for name, run in runs if any(one.lost for one in run.activity.values()))

    @staticmethod
    def _status(chosen: _Candidate, seen: Sequence[_Candidate], left: Sequence[str], *, interrupted: bool) -> Status:
        if interrupted:
            return Status.INTERRUPTED
        if left:
            return Status.UNSTABLE
        if chosen.solution is None:
            return Status.NOT_IMPROVED
        status = chosen.solution.status
        # Of a start that was given up for others its iterations did not run out: they were not wanted.
        given_up = status is Status.MAX_ITERATIONS
        later = any((given_up or one.start == chosen.start) and one.iteration > chosen.iteration for one in seen)
        return Status.STOPPED_EARLY if later else status


def _others(seen: Sequence[_Candidate]) -> list[str]:
    """One sentence for each start: how the error that chooses went on the way."""
    by_origin: dict[str, list[str]] = {}
    alone = all(np.isnan(one.score) for one in seen)
    for one in seen:
        by_origin.setdefault(one.origin, []).append(f"{one.loss if alone else one.score:.4g} ({one.iteration})")
    what = "mean squared residual" if alone else "error on the selection traces"
    return [
        f"The other checkpoints from {origin}, {what} (iterations): {', '.join(errors)}."
        for origin, errors in by_origin.items()
    ]


def _last(value: float) -> float:
    """A sorting key by which what is not finite comes last."""
    return value if np.isfinite(value) else np.inf


def _unfinished(solution: Solution) -> bool:
    return solution.status in {Status.MAX_ITERATIONS, Status.TIME_LIMIT}
