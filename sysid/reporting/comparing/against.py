"""One run against another, of whichever kinds: who is better, on which cases, and what else differs between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sysid.errors import ConfigError
from sysid.reporting.comparing.contenders import Contender, Entry, contenders
from sysid.reporting.kinds import read_run
from sysid.reporting.records import RunResults
from sysid.reporting.tables import facts


@dataclass(frozen=True, kw_only=True, eq=False)
class Side:
    """One of the two runs.

    Args:
        name: Name of the run, different from the other's.
        results: Its results.
        entries: What it puts up, by output.
    """

    name: str
    results: RunResults
    entries: dict[str, Contender]


@dataclass(frozen=True, kw_only=True, eq=False)
class Contest:
    """Both runs on one case of one output.

    Args:
        output: Name of the output.
        case: Name of the case.
        ours: The first run's figures of it.
        theirs: The second run's.
        ratio: Error of the first divided by that of the second; NaN where one of them is not finite.
        same: Whether both were scored on the same target.
    """

    output: str
    case: str
    ours: Entry
    theirs: Entry
    ratio: float
    same: bool

    @property
    def counts(self) -> bool:
        """Whether a verdict may rest on it: unseen by both, and the same target for both."""
        return self.same and not self.ours.seen and not self.theirs.seen


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Two runs side by side.

    Args:
        ours: The first.
        theirs: The one that it is compared with.
        contests: The cases that both have, output by output, in the first one's order.
        differences: What differs apart from figures: name, first and second.
    """

    ours: Side
    theirs: Side
    contests: tuple[Contest, ...]
    differences: tuple[tuple[str, str, str], ...]

    @property
    def outputs(self) -> list[str]:
        """The outputs that both have."""
        return list(dict.fromkeys(contest.output for contest in self.contests))

    @property
    def judged(self) -> tuple[Contest, ...]:
        """The cases that the verdict rests on."""
        return tuple(contest for contest in self.contests if contest.counts)

    @property
    def mean_ratio(self) -> float:
        """Geometric mean of the ratios over the judged cases; NaN without any."""
        ratios = [contest.ratio for contest in self.judged if contest.ratio > 0.0]
        return math.exp(sum(math.log(ratio) for ratio in ratios) / len(ratios)) if ratios else math.nan

    def called(self, contest: Contest) -> str:
        """A case, with its output where there are several."""
        return contest.case if len(self.outputs) == 1 else f"{contest.output}, {contest.case}"

    def to_dict(self) -> dict[str, Any]:
        """The comparison as JSON values; figures that are not finite are null."""
        return {
            "schema_version": 2,
            "runs": {key: self._run(side) for key, side in (("ours", self.ours), ("theirs", self.theirs))},
            "mean_ratio": _finite(self.mean_ratio),
            "cases": [_case(contest) for contest in self.contests],
            "differences": [{"what": what, "ours": ours, "theirs": theirs} for what, ours, theirs in self.differences],
        }

    def _run(self, side: Side) -> dict[str, Any]:
        results = side.results
        return {
            "name": side.name,
            "kind": results.kind,
            "pipeline": results.pipeline,
            "command": results.command,
            "created": results.created,
            "data_digest": results.data.digest,
            "models": {
                output: {
                    "name": one.name,
                    "unit": one.unit,
                    "n_parameters": one.parameters,
                    "train_time_s": _finite(one.train_time_s),
                    **dict(one.facts),
                }
                for output, one in side.entries.items()
                if output in self.outputs
            },
        }


def compare_runs(run: Path, against: Path) -> Comparison:
    """Set a run beside another one, by what they chose.

    Args:
        run: Folder of the first run.
        against: Folder of the run that it is compared with; of another kind too.

    Returns:
        The comparison.

    Raises:
        ConfigError: If a folder holds no results, or the runs have no output with a case and the unit in common.
    """
    names = _names(Path(run), Path(against))
    ours, theirs = _side(Path(run), names[0]), _side(Path(against), names[1])
    contests = tuple(
        _contest(output, case, one, theirs.entries[output])
        for output, one in ours.entries.items()
        if output in theirs.entries and theirs.entries[output].unit == one.unit
        for case in one.cases
        if case in theirs.entries[output].cases
    )
    if not contests:
        raise ConfigError(
            "the runs cannot be compared",
            where=against,
            expected=f"an output in common, in the same unit, and a case of it: {_has(ours)}",
            got=_has(theirs),
            remedy="compare runs of one output on the same data set",
        )
    return Comparison(ours=ours, theirs=theirs, contests=contests, differences=_differences(ours, theirs))


def _has(side: Side) -> str:
    return "; ".join(f"{output} in {one.unit} on {', '.join(one.cases)}" for output, one in side.entries.items())


def _side(folder: Path, name: str) -> Side:
    results = read_run(folder)
    return Side(name=name, results=results, entries={one.output: one for one in contenders(folder, results)})


def _names(run: Path, against: Path) -> tuple[str, str]:
    """The shortest ends of the two paths that differ."""
    one, other = run.resolve().parts, against.resolve().parts
    for length in range(1, max(len(one), len(other)) + 1):
        if one[-length:] != other[-length:]:
            return "/".join(one[-length:]), "/".join(other[-length:])
    return f"{run.name} (1)", f"{run.name} (2)"


def _contest(output: str, case: str, ours: Contender, theirs: Contender) -> Contest:
    one, other = ours.cases[case], theirs.cases[case]
    mine, yours = one.error, other.error
    known = math.isfinite(mine) and math.isfinite(yours) and yours > 0.0
    return Contest(
        output=output,
        case=case,
        ours=one,
        theirs=other,
        ratio=mine / yours if known else math.nan,
        same=bool(one.target) and one.target == other.target,
    )


def _case(contest: Contest) -> dict[str, Any]:
    sides = {
        key: {
            **{name: _finite(value) for name, value in entry.figures.items()},
            "run_time_s": _finite(entry.run_time_s),
            "role": None if entry.role is None else entry.role.value,
        }
        for key, entry in (("ours", contest.ours), ("theirs", contest.theirs))
    }
    return {
        "output": contest.output,
        "case": contest.case,
        "same_target": contest.same,
        "counts": contest.counts,
        "ratio": _finite(contest.ratio),
        **sides,
    }


def _differences(ours: Side, theirs: Side) -> tuple[tuple[str, str, str], ...]:
    left, right = _facts(ours), _facts(theirs)
    names = dict.fromkeys([*left, *right])
    return tuple((n, left.get(n, "none"), right.get(n, "none")) for n in names if left.get(n) != right.get(n))


def _facts(side: Side) -> dict[str, str]:
    results = side.results
    several = len(side.entries) > 1
    models = {
        f"{output}: {what}" if several else what: text
        for output, one in side.entries.items()
        for what, text in one.facts.items()
    }
    return (
        {"kind": results.kind, "pipeline": results.pipeline}
        | models
        | {
            "seed": str(results.seed),
            "data set": results.data.name,
            "digest of the data set": results.data.digest,
            "free runs start": str((results.start or {}).get("kind", "unknown")),
            "command": results.command,
        }
        | dict(facts(results.environment))
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
