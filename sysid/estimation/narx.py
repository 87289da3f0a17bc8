"""NARX networks: open loop, closed loop, several starts, and an honest choice between them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.arx import first_output
from sysid.estimation.initialise import Layout
from sysid.estimation.levenberg_marquardt import Iteration, LevenbergMarquardt, Solution
from sysid.estimation.provider import RecursionProvider, experiments_of
from sysid.estimation.result import FitResult, Loop, Status
from sysid.estimation.termination import Termination
from sysid.models import NARX, Mapping, NARXModel, Recursion, Scaling, Start
from sysid.models.narx import CLAMP
from sysid.traces import Trace

INITIAL_ALPHA = 1e-2
"""Precision of the weights before the evidence has spoken, with residuals of precision 1: weak, but enough to keep
the first steps of an underdetermined network small."""


@dataclass(frozen=True, kw_only=True)
class Training:
    """How a network is trained.

    Args:
        loop: ``closed`` minimises the error of the free run, ``open`` that of the one-step prediction.
        max_iterations: Levenberg-Marquardt iterations of each start.
        max_time_s: Wall time of each start in seconds.
        tolerance: Relative improvement over ``patience`` iterations below which a fit has converged.
        patience: Iterations over which improvement is judged.
        starts: Random starts; the best one is kept.
        seed: Seed of the first start; each start's own seed is derived from it.
        choose_by: What picks among the starts: ``selection`` (least free-run error on traces that are used for
            nothing else) or ``evidence``.
        open_iterations: Iterations in open loop before a closed-loop fit begins.
        workers: Starts that run at the same time.
    """

    loop: Loop = Loop.CLOSED
    max_iterations: int = 200
    max_time_s: float = float("inf")
    tolerance: float = 1e-4
    patience: int = 20
    starts: int = 1
    seed: int = 0
    choose_by: str = "selection"
    open_iterations: int = 0
    workers: int = 2

    def __post_init__(self) -> None:
        object.__setattr__(self, "loop", Loop(self.loop))
        if self.choose_by not in {"selection", "evidence"}:
            raise ConfigError(
                "not a way to choose between starts",
                where="choose_by",
                expected="selection or evidence",
                got=repr(self.choose_by),
                remedy="write choose_by: selection and name a selection data set, or choose_by: evidence",
            )
        for name in ("max_iterations", "patience", "starts", "workers"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{name} is too small", where=name, expected="1 or more", got=getattr(self, name))


@dataclass(frozen=True, kw_only=True)
class FitProgress:
    """What a progress bar shows.

    Args:
        stage: What is being done, in words.
        start: Which start, from 1 on.
        starts: How many there are.
        iteration: Iterations of this start done.
        max_iterations: At most so many.
        mse: Mean squared error on the estimation traces, in the output's unit squared.
        elapsed_s: Seconds since this start began.
    """

    stage: str
    start: int
    starts: int
    iteration: int
    max_iterations: int
    mse: float
    elapsed_s: float


@dataclass(frozen=True, kw_only=True, eq=False)
class _Task:
    """Everything the starts of one fit have in common."""

    training: Training
    network: NARX
    layout: Layout
    template: NARXModel
    open_loop: RecursionProvider
    closed_loop: RecursionProvider
    selection: Sequence[Trace]
    start: Start
    on_progress: Callable[[FitProgress], None]
    stop: threading.Event = field(default_factory=threading.Event)

    def model(self, theta: NDArray[np.float64]) -> NARXModel:
        return replace(self.template, theta=theta)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Candidate:
    """One start's outcome."""

    seed: int | None
    solution: Solution
    model: NARXModel
    selection_mse: float
    seconds: float


def fit_narx(
    traces: Sequence[Trace],
    mapping: Mapping,
    network: NARX,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    selection: Sequence[Trace] = (),
    initial: FitResult | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit a NARX network by Levenberg-Marquardt with Bayesian regularisation.

    An interruption from the keyboard keeps the best model so far (status ``INTERRUPTED``).

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which comes out.
        network: The structure.
        training: How to train.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.
        selection: Traces that choose between starts; without them the evidence chooses.
        initial: A fit with the same structure whose parameters are the first start.
        on_progress: Called after every iteration, from the threads that train.

    Returns:
        The best start's model, with the spread over starts in its notes.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the structure does not fit the mapping, or ``initial`` has another structure.
    """
    began = time.perf_counter()
    training = training or Training()
    task = _prepare(traces, mapping, network, training, start or Start(), rest_output, selection, on_progress)
    first = _initial_parameters(initial, task)
    candidates = _run_starts(task, first)
    chosen, how = _choose(candidates, training.choose_by, bool(selection))
    scale = task.template.scaling.output_scale**2
    curve = chosen.solution.curve
    return FitResult(
        model=chosen.model,
        status=chosen.solution.status,
        loop=training.loop,
        history={
            "iteration": np.array([entry.iteration for entry in curve], dtype=np.float64),
            "mse": np.array([entry.mse * scale for entry in curve]),
            "effective_parameters": np.array([entry.effective_parameters for entry in curve]),
            "elapsed_s": np.array([entry.elapsed_s for entry in curve]),
        },
        train_time_s=time.perf_counter() - began,
        seed=chosen.seed,
        evidence=chosen.solution.evidence,
        notes=(*_spread(candidates, chosen, how, scale),),
    )


def _prepare(  # noqa: PLR0917  # private, called once, in the order of fit_narx
    traces: Sequence[Trace],
    mapping: Mapping,
    network: NARX,
    training: Training,
    start: Start,
    rest_output: float | None,
    selection: Sequence[Trace],
    on_progress: Callable[[FitProgress], None],
) -> _Task:
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    experiments = experiments_of(traces, mapping, start, rest)
    scaling = Scaling.to_unit_range([e.inputs for e in experiments], [e.output for e in experiments])
    layout = Layout(lags=network.lags(len(mapping.inputs)), neurons=network.neurons, linear=network.feedthrough)
    template = NARXModel(
        network=network,
        theta=layout.centre(),
        scaling=scaling,
        mapping=mapping,
        sample_time=traces[0].sample_time,
        input_units=tuple(traces[0].channel(name).unit for name in mapping.inputs),
        output_unit=traces[0].channel(mapping.output).unit,
        rest_output=rest,
        clamp=CLAMP,
    )
    recursion: Recursion = template.recursion
    return _Task(
        training=training,
        network=network,
        layout=layout,
        template=template,
        open_loop=RecursionProvider(template=recursion, experiments=experiments, closed=False),
        closed_loop=RecursionProvider(template=recursion, experiments=experiments, closed=True),
        selection=selection,
        start=start,
        on_progress=on_progress,
    )


def _initial_parameters(initial: FitResult | None, task: _Task) -> NARXModel | None:
    if initial is None:
        return None
    if not isinstance(initial.model, NARXModel) or initial.model.network != task.network:
        raise ConfigError(
            "the initial fit has another structure",
            where="initial",
            expected=task.network.label,
            got=initial.model.structure.label,
            remedy="name a fit with the same delays and neurons, or leave initial out",
        )
    return initial.model


def _run_starts(task: _Task, first: NARXModel | None) -> list[_Candidate]:
    """All starts, a few at a time; threads suffice because the kernels and BLAS release the interpreter."""
    training = task.training
    with ThreadPoolExecutor(min(training.workers, training.starts)) as pool:
        futures = [
            pool.submit(_run_start, task, number, first if number == 0 else None) for number in range(training.starts)
        ]
        try:
            return [future.result() for future in futures]
        except KeyboardInterrupt:
            task.stop.set()
            done = [future for future in futures if not future.cancel()]
            return [future.result() for future in done]


def _run_start(task: _Task, number: int, given: NARXModel | None) -> _Candidate:
    began = time.perf_counter()
    training = task.training
    seed = None if given is not None else training.seed + number
    theta = task.layout.draw(np.random.default_rng(seed)) if given is None else given.theta
    prior = task.layout.prior(alpha=INITIAL_ALPHA, beta=1.0)
    if training.loop is Loop.CLOSED and training.open_iterations and given is None:
        engine = _engine(task, number, "one step ahead", training.open_iterations)
        theta = engine.minimise(task.open_loop, theta, prior).theta
    provider = task.closed_loop if training.loop is Loop.CLOSED else task.open_loop
    stage = "free run" if training.loop is Loop.CLOSED else "one step ahead"
    solution = _engine(task, number, stage, training.max_iterations).minimise(provider, theta, prior)
    model = task.model(solution.theta)
    return _Candidate(
        seed=seed,
        solution=solution,
        model=model,
        selection_mse=_free_run_mse(model, task.selection, task.start),
        seconds=time.perf_counter() - began,
    )


def _engine(task: _Task, number: int, stage: str, max_iterations: int) -> LevenbergMarquardt:
    training = task.training
    scale = task.template.scaling.output_scale**2

    def report(entry: Iteration) -> None:
        task.on_progress(
            FitProgress(
                stage=stage,
                start=number + 1,
                starts=training.starts,
                iteration=entry.iteration,
                max_iterations=max_iterations,
                mse=entry.mse * scale,
                elapsed_s=entry.elapsed_s,
            )
        )

    return LevenbergMarquardt(
        termination=Termination(
            max_iterations=max_iterations,
            max_time_s=training.max_time_s,
            tolerance=training.tolerance,
            patience=training.patience,
        ),
        on_iteration=report,
        should_stop=task.stop.is_set,
    )


def _free_run_mse(model: NARXModel, traces: Sequence[Trace], start: Start) -> float:
    """Mean over traces of the free run's mean squared error; NaN without traces."""
    errors = []
    for trace in traces:
        inputs, target = trace.columns(model.mapping.inputs), trace[model.mapping.output]
        n = start.n_measured
        output = model.simulate(inputs[n:], start.history(inputs, target, model.rest_output))
        errors.append(float(np.mean((output - target[n:])[trace.usable_samples[n:]] ** 2)))
    return float(np.mean(errors)) if errors else float("nan")


def _choose(candidates: Sequence[_Candidate], choose_by: str, has_selection: bool) -> tuple[_Candidate, str]:
    usable = [c for c in candidates if c.solution.status.usable] or list(candidates)
    if choose_by == "selection" and has_selection:
        return min(usable, key=lambda c: c.selection_mse), "least free-run error on the selection traces"
    with_evidence = [c for c in usable if c.solution.evidence is not None]
    if with_evidence:
        best = max(with_evidence, key=lambda c: c.solution.evidence.log_evidence if c.solution.evidence else -np.inf)
        return best, "largest evidence"
    return min(usable, key=lambda c: c.solution.at.loss), "least error on the estimation traces"


def _spread(candidates: Sequence[_Candidate], chosen: _Candidate, how: str, scale: float) -> list[str]:
    notes = []
    if len(candidates) > 1:
        notes.append(f"Chosen among {len(candidates)} starts by {how}.")
    for candidate in candidates:
        origin = "initial fit" if candidate.seed is None else f"seed {candidate.seed}"
        evidence = candidate.solution.evidence
        notes.append(
            f"{'Chosen' if candidate is chosen else 'Start'}, {origin}: estimation mse {_mse(candidate) * scale:.4g}, "
            f"selection mse {candidate.selection_mse:.4g}, "
            f"log evidence {evidence.log_evidence if evidence else float('nan'):.6g}, "
            f"{candidate.seconds:.1f} s, {candidate.solution.status.name}."
        )
    return notes


def _mse(candidate: _Candidate) -> float:
    return candidate.solution.curve[-1].mse


__all__ = ["FitProgress", "Status", "Training", "fit_narx"]
