"""One run against another: which model is better, on which cases, and what else differs between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ConfigError
from sysid.reporting.numbers import number
from sysid.reporting.results import CaseRecord, FitRecord, Results, read_results
from sysid.reporting.signals import CaseSignals, read_signals
from sysid.reporting.tables import SCORED, facts


@dataclass(frozen=True, kw_only=True, eq=False)
class Side:
    """One of the two runs.

    Args:
        name: Name of the run, different from the other's.
        results: Its results.
        fit: The fit that it chose, or its first.
        signals: That fit's signals by case.
    """

    name: str
    results: Results
    fit: FitRecord
    signals: dict[str, CaseSignals]


@dataclass(frozen=True, kw_only=True)
class Contest:
    """Both models on one case.

    Args:
        case: Its name.
        ours: The first run's record of it.
        theirs: The second run's.
        ratio: Free-run mse of the first divided by that of the second; NaN where one of them is not finite.
        same: Whether both were scored on the same target.
    """

    case: str
    ours: CaseRecord
    theirs: CaseRecord
    ratio: float
    same: bool

    @property
    def counts(self) -> bool:
        """Whether a verdict may rest on it: unseen by both, and the same target for both."""
        return self.same and self.ours.role in SCORED and self.theirs.role in SCORED


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Two runs side by side.

    Args:
        ours: The first.
        theirs: The one that it is compared with.
        contests: The cases that both have, in the first one's order.
        differences: What differs apart from figures: name, first and second.
    """

    ours: Side
    theirs: Side
    contests: tuple[Contest, ...]
    differences: tuple[tuple[str, str, str], ...]

    @property
    def judged(self) -> tuple[Contest, ...]:
        """The cases that the verdict rests on."""
        return tuple(contest for contest in self.contests if contest.counts)

    @property
    def mean_ratio(self) -> float:
        """Geometric mean of the ratios over the judged cases; NaN without any."""
        ratios = [contest.ratio for contest in self.judged if contest.ratio > 0.0]
        return math.exp(sum(math.log(ratio) for ratio in ratios) / len(ratios)) if ratios else math.nan

    def to_dict(self) -> dict[str, Any]:
        """The comparison as JSON values; figures that are not finite are null."""
        return {
            "schema_version": 1,
            "runs": {
                key: {
                    "name": side.name,
                    "pipeline": side.results.pipeline,
                    "command": side.results.command,
                    "created": side.results.created,
                    "data_digest": side.results.data.digest,
                    "fit": side.fit.name,
                    "label": side.fit.label,
                    "mapping": side.fit.mapping,
                    "n_parameters": side.fit.n_parameters,
                    "train_time_s": _finite(side.fit.train_time_s),
                }
                for key, side in (("ours", self.ours), ("theirs", self.theirs))
            },
            "mean_ratio": _finite(self.mean_ratio),
            "cases": {
                contest.case: {
                    "same_target": contest.same,
                    "counts": contest.counts,
                    "ratio": _finite(contest.ratio),
                    **{
                        key: {
                            "mse": _finite(record.free_run.mse),
                            "nrmse_fit": _finite(record.free_run.nrmse_fit),
                            "max_abs_error": _finite(record.free_run.max_abs_error),
                            "run_time_s": _finite(record.run_time_s),
                            "role": record.role.value,
                        }
                        for key, record in (("ours", contest.ours), ("theirs", contest.theirs))
                    },
                }
                for contest in self.contests
            },
            "differences": [{"what": what, "ours": ours, "theirs": theirs} for what, ours, theirs in self.differences],
        }


def compare_runs(run: Path, against: Path) -> Comparison:
    """Set a run beside another one, by the fits that they chose.

    Args:
        run: Folder of the first run.
        against: Folder of the run that it is compared with.

    Returns:
        The comparison.

    Raises:
        ConfigError: If a folder holds no results, or the runs have no case with the same unit in common.
    """
    names = _names(Path(run), Path(against))
    ours, theirs = _side(Path(run), names[0]), _side(Path(against), names[1])
    common = [name for name in ours.fit.cases if name in theirs.fit.cases]
    if not common or ours.fit.unit != theirs.fit.unit:
        raise ConfigError(
            "the runs cannot be compared",
            where=against,
            expected=f"a case in common, and {ours.fit.unit} as the output's unit",
            got=f"cases {', '.join(theirs.fit.cases)} in {theirs.fit.unit}",
            remedy="compare runs of the same mapping on the same data set",
        )
    contests = tuple(_contest(name, ours, theirs) for name in common)
    return Comparison(ours=ours, theirs=theirs, contests=contests, differences=_differences(ours, theirs))


def _side(folder: Path, name: str) -> Side:
    results = read_results(folder)
    fit = results.best_fit or results.fits[0]
    signals = read_signals(folder / "fits" / fit.slug, list(fit.cases))
    return Side(name=name, results=results, fit=fit, signals=signals)


def _names(run: Path, against: Path) -> tuple[str, str]:
    """The shortest ends of the two paths that differ."""
    one, other = run.resolve().parts, against.resolve().parts
    for length in range(1, max(len(one), len(other)) + 1):
        if one[-length:] != other[-length:]:
            return "/".join(one[-length:]), "/".join(other[-length:])
    return f"{run.name} (1)", f"{run.name} (2)"


def _contest(name: str, ours: Side, theirs: Side) -> Contest:
    one, other = ours.fit.cases[name], theirs.fit.cases[name]
    same = np.array_equal(ours.signals[name].target, theirs.signals[name].target)
    mine, yours = one.free_run.mse, other.free_run.mse
    known = math.isfinite(mine) and math.isfinite(yours) and yours > 0.0
    return Contest(case=name, ours=one, theirs=other, ratio=mine / yours if known else math.nan, same=same)


def _differences(ours: Side, theirs: Side) -> tuple[tuple[str, str, str], ...]:
    left, right = _facts(ours), _facts(theirs)
    names = dict.fromkeys([*left, *right])
    return tuple((n, left.get(n, "none"), right.get(n, "none")) for n in names if left.get(n) != right.get(n))


def _facts(side: Side) -> dict[str, str]:
    fit, results = side.fit, side.results
    return {
        "pipeline": results.pipeline,
        "fit": fit.name,
        "mapping": fit.mapping,
        "structure": fit.label,
        "trained in": f"{fit.loop.value} loop",
        "parameters": "unknown" if fit.n_parameters is None else str(fit.n_parameters),
        "training time [s]": number(fit.train_time_s),
        "seed": str(results.seed),
        "data set": results.data.name,
        "digest of the data set": results.data.digest,
        "free runs start": str((results.start or {}).get("kind", "unknown")),
        "command": results.command,
    } | dict(facts(results.environment))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
