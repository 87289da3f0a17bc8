"""A surrogate against its reference: on new experiments that taught it nothing, and in its place as an FMU."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.export.bundle import Bundle
from sysid.extras import has
from sysid.references.config import InputPort, ReferenceConfig
from sysid.references.design import Design
from sysid.references.design import drawn as drawn_cases
from sysid.references.runs import Case, Outcome, Progress, ReferenceRuns
from sysid.references.told import reasons_of
from sysid.reporting.judging.results import CurveRecord, JudgementRecord, QuantityRecord, SceneRecord
from sysid.traces import TraceSet
from sysid.workbench.surrogates.beginning import begun_elsewhere

SEED = 77_001
"""Of the proof, behind the design's: no experiment that taught is drawn from it."""
DRAWN, POINTS = (3, 10), 400
"""The worst experiments that are drawn: a tenth of them, but so many at least and at most; and points of a line."""
FEWEST, ELSEWHERE = 20, 6
"""Experiments of a proof, whatever the time; and of those that begin elsewhere, of which there are a tenth as many."""
QUANTILES = (0.5, 0.9, 0.95, 0.99, 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Proof:
    """What came of it. Errors are shares of each output's range in the data that was fitted.

    Args:
        errors: Root mean square of the free run, shape ``(n, n_outputs)``; infinite where it left all numbers.
        largest: Largest error, likewise.
        outcomes: The experiments that gave a record, in the same order.
        failed: Those of the reference that gave none.
        why: Why these gave none, in words.
        tolerance: Share of the range.
        outputs: Their names.
        spans: Range of each.
        reference_s: Processor seconds of a run of the reference, the mean.
        surrogate_s: Of the surrogate's model.
        dropped: Largest difference of the surrogate's FMU in an importer from its model, as a share of the range;
            ``None`` where it was not run so.
        dropped_s: Processor seconds of that run.
        dropped_reference_s: Of the reference on the same experiment.
        drawn: How many of the worst are drawn, at most.
        elsewhere: Errors, as ``errors``, of experiments that begin at other inputs than all others do; ``None`` where
            there are none.
    """

    errors: NDArray[np.float64]
    largest: NDArray[np.float64]
    outcomes: Sequence[Outcome]
    failed: int
    why: str
    tolerance: float
    outputs: tuple[str, ...]
    spans: NDArray[np.float64]
    reference_s: float
    surrogate_s: float
    dropped: float | None = None
    dropped_s: float = float("nan")
    dropped_reference_s: float = float("nan")
    drawn: int = DRAWN[1]
    elsewhere: NDArray[np.float64] | None = None

    @property
    def share(self) -> float:
        """Share of the experiments in which every output is within the tolerance (root mean square)."""
        return float((self.errors <= self.tolerance).all(axis=1).mean())

    @property
    def share_everywhere(self) -> float:
        """Share in which every output is at every sample."""
        return float((self.largest <= self.tolerance).all(axis=1).mean())

    @property
    def n_elsewhere(self) -> int:
        """Experiments that begin at other inputs than all others do."""
        return 0 if self.elsewhere is None else len(self.elsewhere)

    @property
    def share_elsewhere(self) -> float:
        """Share within the tolerance of those that begin at other inputs; NaN without any."""
        return float("nan") if self.elsewhere is None else float((self.elsewhere <= self.tolerance).all(axis=1).mean())

    @property
    def diverged(self) -> int:
        """Experiments in which the surrogate left all numbers, or its error passed the whole range."""
        return int((~(self.errors < 1.0)).any(axis=1).sum())

    def quantiles(self) -> dict[str, list[float]]:
        """Error quantiles of each output, by name, at :data:`QUANTILES`."""
        values = np.quantile(np.where(np.isfinite(self.errors), self.errors, 1e9), QUANTILES, axis=0)
        return dict(zip(self.outputs, values.T.tolist(), strict=True))

    def sentences(self) -> list[str]:
        """The figures in words."""
        percent = 100.0 * self.tolerance
        told = [
            f"Of {len(self.errors)} new random experiments that taught nothing, {100.0 * self.share:.1f} % are within "
            f"{percent:g} % of the range of every output (root mean square of the free run), and "
            f"{100.0 * self.share_everywhere:.1f} % at every sample; {self.diverged} diverged"
            + (
                f"; the reference itself gave no record of {self.failed} more, where nobody knows how the surrogate "
                f"does: {self.why}"
                if self.failed
                else ""
            )
        ]
        if self.elsewhere is not None:
            told.append(
                f"Of {self.n_elsewhere} more that begin at other inputs than those do, "
                f"{100.0 * self.share_elsewhere:.1f} % are"
            )
        for name, values in self.quantiles().items():
            said = ", ".join(f"{q:.0%}: {100.0 * v:.3g} %" for q, v in zip(QUANTILES, values, strict=True))
            told.append(f"Error of {name} by quantile, as a share of its range: {said}")
        ratio = self.reference_s / self.surrogate_s
        told.append(
            f"Processor time of an experiment: reference {self.reference_s:.3g} s, surrogate {self.surrogate_s:.3g} s: "
            f"{ratio:.3g} times as fast"
        )
        if self.dropped is not None:
            told.append(
                f"In the reference's place as an FMU, in the same importer: at most {100.0 * self.dropped:.2g} % of "
                f"the range from its model, {self.dropped_s:.3g} s, the reference {self.dropped_reference_s:.3g} s"
            )
        return told

    def record(self, predicted: Sequence[NDArray[np.float64]]) -> JudgementRecord:
        """The section of a report: the figures, and the worst experiments drawn.

        Args:
            predicted: The surrogate's outputs of the :attr:`worst` experiments.

        Returns:
            The section's figures.
        """
        quantities = {f"rms {n}": QuantityRecord(name=f"{n}, root mean square", unit="%") for n in self.outputs}
        quantities |= {f"max {n}": QuantityRecord(name=f"{n}, largest", unit="%") for n in self.outputs}
        reference, subject = {}, {}
        for k, found in zip(self.worst, predicted, strict=True):
            one = self.outcomes[k]
            assert one.trace is not None  # noqa: S101 - those without are not among them
            step = max(1, len(one.trace) // POINTS)
            for n in self.outputs:
                quantities[n] = QuantityRecord(name=n, unit=one.trace.channel(n).unit)
            measured, name = one.trace.columns(self.outputs), f"{one.case.name}: {one.case.told}"
            reference[name] = self._scene(one.trace.time[::step], measured[::step], {})
            percents = {f"rms {n}": 100.0 * float(self.errors[k, j]) for j, n in enumerate(self.outputs)}
            percents |= {f"max {n}": 100.0 * float(self.largest[k, j]) for j, n in enumerate(self.outputs)}
            subject[name] = self._scene(one.trace.time[::step], found[::step], percents)
        return JudgementRecord(
            title="Proof", told=f"{self.sentences()[0]}.",
            method=". ".join(self.sentences()) + f". The {len(subject)} worst are drawn.",
            scenes=list(subject), headline_scenes=list(subject)[:1], quantities=quantities, reference=reference,
            subjects={"surrogate": subject},
        )  # fmt: skip

    def _scene(
        self, seconds: NDArray[np.float64], values: NDArray[np.float64], differences: dict[str, float]
    ) -> SceneRecord:
        columns = zip(self.outputs, np.where(np.isfinite(values), values, np.nan).T, strict=True)
        signals = {n: CurveRecord(time=seconds.tolist(), value=column.tolist()) for n, column in columns}
        return SceneRecord(signals=signals, differences=differences)

    @property
    def worst(self) -> list[int]:
        """The experiments with the largest errors that are drawn, the worst first."""
        count = int(np.clip(len(self.errors) // 10, DRAWN[0], max(self.drawn, DRAWN[0])))
        return [int(k) for k in np.argsort(-self.errors.max(axis=1), kind="stable")[:count]]


def prove(
    bundle: Bundle, config: ReferenceConfig, design: Design, taught: TraceSet, *, count: int, workers: int,
    tolerance: float = 0.01, until: float = inf, drawn: int = DRAWN[1], progress: Progress | None = None,
) -> tuple[Proof, JudgementRecord]:  # fmt: skip
    """Run reference and surrogate on new random experiments.

    Args:
        bundle: The surrogate.
        config: The reference, with whole paths.
        design: As the experiments that taught were drawn; the new ones are drawn from other seeds.
        taught: The records that were fitted, whose ranges errors are held against.
        count: How many.
        workers: Processes.
        tolerance: Share of the range.
        until: The time of ``time.monotonic`` by which reference and surrogate have been run; the first
            :data:`FEWEST` are whatever the time.
        drawn: How many of the worst are drawn, at most.
        progress: Told of each run.

    Returns:
        The figures, and the section of a report.

    Raises:
        ConfigError: If none of the experiments gave a record.
    """
    cases = drawn_cases(config, design, count, seed=(design.seed, SEED), prefix="N")
    with ReferenceRuns(config=config, workers=workers) as runs:
        ends = _begun_until(until, bundle, runs, cases[0])
        done = runs.run(cases, progress, until=ends, fewest=FEWEST)
        others = begun_elsewhere(config, cases[: max(ELSEWHERE, count // 10)])
        begun = [one for one in runs.run(others, until=ends, fewest=ELSEWHERE) if one.trace is not None]
    there = [one for one in done if one.trace is not None]
    if not there:
        raise ConfigError(
            "no new experiment gave a record", where="proof", expected="a reference that can be run",
            got=done[0].reason, remedy="run the reference in its own tool first",
        )  # fmt: skip
    outputs = tuple(config.outputs)
    spans = np.ptp(np.concatenate([trace.columns(outputs) for trace in taught]), axis=0)
    spans = np.where(spans > 0.0, spans, 1.0)
    began, runs_of = time.process_time(), [_run(bundle, config, one.case) for one in there]
    spent = (time.process_time() - began) / len(there)
    off = [_shares(found, _measured(one, outputs), spans) for one, found in zip(there, runs_of, strict=True)]
    elsewhere = [rms_shares(_run(bundle, config, one.case), _measured(one, outputs), spans) for one in begun]
    dropped = _drop_in(bundle, config, there[0], runs_of[0], spans)
    proof = Proof(
        errors=np.array([_rms(one) for one in off]), largest=np.array([one.max(axis=0) for one in off]),
        elsewhere=np.array(elsewhere) if elsewhere else None, outcomes=there, failed=len(done) - len(there),
        why=reasons_of(done), tolerance=tolerance, outputs=outputs, spans=spans, surrogate_s=max(spent, 1e-7),
        reference_s=float(np.nanmean([one.cpu_s for one in there])), drawn=min(drawn, DRAWN[1]), **dropped,
    )  # fmt: skip
    return proof, proof.record([runs_of[k] for k in proof.worst])


def _begun_until(until: float, bundle: Bundle, runs: ReferenceRuns, case: Case) -> float:
    """When the last run of the reference is begun, so that the surrogate's runs after them are over in time too."""
    if not np.isfinite(until):
        return until
    _run(bundle, runs.config, case)  # what is loaded and compiled for the first run is not for each
    began = time.monotonic()
    _run(bundle, runs.config, case)
    now, each = time.monotonic(), runs.seconds_each()[0]
    beside = 0.0 if each is None else (time.monotonic() - began) * runs.workers / max(each, 1e-6)
    return now + (until - now) / (1.0 + beside)


def _shares(
    found: NDArray[np.float64], measured: NDArray[np.float64], spans: NDArray[np.float64]
) -> NDArray[np.float64]:
    off = np.abs(found - measured) / spans
    return np.where(np.isfinite(off), np.minimum(off, 1e100), np.inf)


def rms_shares(
    found: NDArray[np.float64], measured: NDArray[np.float64], spans: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Root mean square errors of a free run as shares of the ranges.

    Args:
        found: Shape ``(n_samples, n_outputs)``.
        measured: Likewise.
        spans: Range of each output, shape ``(n_outputs,)``.

    Returns:
        Shape ``(n_outputs,)``; infinite where the run left all numbers.
    """
    return _rms(_shares(found, measured, spans))


def _rms(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.sqrt(np.mean(shares**2, axis=0)))


def _measured(one: Outcome, outputs: Sequence[str]) -> NDArray[np.float64]:
    assert one.trace is not None  # noqa: S101 - those without have been left out
    return one.trace.columns(outputs)


def surrogate_inputs(config: ReferenceConfig, case: Case) -> NDArray[np.float64]:
    """Inputs of a surrogate over an experiment: those of the reference, and its parameters as constants.

    Args:
        config: The reference.
        case: The experiment.

    Returns:
        Shape ``(n_samples, n_inputs + n_parameters)``.
    """
    return np.hstack([case.inputs, *(np.full((len(case.inputs), 1), case.parameters[n]) for n in config.parameters)])


def _run(bundle: Bundle, config: ReferenceConfig, case: Case) -> NDArray[np.float64]:
    """The surrogate's free run, from its declared levels, a column an output of the reference."""
    names = [*config.inputs, *config.parameters]
    columns = dict(zip(names, surrogate_inputs(config, case).T, strict=True))
    with np.errstate(all="ignore"):
        found = np.asarray(bundle.simulate(columns, warn=False)).reshape(len(case.inputs), -1)
    order = [str(entry["name"]) for entry in bundle.outputs]
    return found[:, [order.index(name) for name in config.outputs]]


def _drop_in(
    bundle: Bundle, config: ReferenceConfig, one: Outcome, model: NDArray[np.float64], spans: NDArray[np.float64]
) -> dict[str, Any]:
    """The surrogate's own FMU, run as a reference is: in the same importer, by the same names."""
    file = fmu_of(bundle)
    if file is None or not has("fmpy"):
        return {}
    ports = {name: InputPort(unit=port.unit, range=port.range) for name, port in config.parameters.items()}
    own = ReferenceConfig(
        fmu=str(file.resolve()),
        sample_time=config.sample_time,
        inputs={**config.inputs, **ports},
        outputs=config.outputs,
    )
    with ReferenceRuns(config=own, workers=1, fresh=True) as runs:
        (found,) = runs.run([Case(name="drop-in", inputs=surrogate_inputs(config, one.case))])
    if found.trace is None:
        raise ConfigError(
            "the surrogate's FMU does not run in the reference's place", where=file, expected="the same ports",
            got=found.reason, remedy="please report this with the bundle's model.json",
        )  # fmt: skip
    off = np.abs(found.trace.columns(tuple(config.outputs)) - model) / spans
    return {"dropped": float(off.max()), "dropped_s": found.cpu_s, "dropped_reference_s": one.cpu_s}


def fmu_of(bundle: Bundle) -> Path | None:
    """The FMU of a bundle, the newest version first; ``None`` where it has none."""
    found = {file.format: bundle.folder / file.name for file in bundle.files if file.format in {"fmi2", "fmi3"}}
    return found.get("fmi2") or found.get("fmi3")
