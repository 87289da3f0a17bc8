"""What a frozen surrogate is worst at: new sequences of the reference, the worst of them kept as a data set.

That is how training data grow where it helps: train, run the surrogate beside the reference on commands that it has not
seen, deal in those that it is worst at, train on (``also`` and ``begin`` in a pipeline of kind ``assembly``). Sequences
are drawn as a case of a data set is, from other seeds; never look among those that a report scores.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.export.bundle import Bundle
from sysid.export.simulation import simulate_bundle
from sysid.ingest import DatasetDescription, Progress, load_described
from sysid.ingest.datasets.description import CaseDescription
from sysid.models import Start
from sysid.traces import Role
from sysid.yaml_files import yaml_text

AT_ONCE = 50
"""Sequences in memory at a time."""
CHOOSE = 5
"""Of so many that are kept, in the order of their errors, the middle one chooses; the others are for training."""


def drawn(like: DatasetDescription, case: str | None, seeds: Sequence[int], *, where: object) -> DatasetDescription:
    """A data set of new sequences: one for each seed, otherwise made as a case of another data set is.

    Args:
        like: That data set; its traces are made from recipes with a seed.
        case: Its case; the first by default.
        seeds: The seeds.
        where: Named in errors.

    Returns:
        The data set; its cases are named after their seeds, ``N130000``.

    Raises:
        ConfigError: If there is no such case, or no one seed in its recipe.
    """
    name = next(iter(like.cases)) if case is None else case
    if name not in like.cases:
        raise ConfigError.unknown("there is no such case", name, like.cases, "name one of these", where=where)
    recipe = like.cases[name].recipe or {}
    if (count := _count_seeds(recipe)) != 1:
        raise ConfigError(
            f"no other sequences can be drawn as case {name} is",
            where=where,
            expected="a recipe with one seed, such as {random: {seed: 7, ...}}",
            got=f"{count} seeds" if count else "a recipe without a seed" if recipe else "a case out of a file",
            remedy="name a case of random sequences",
        )
    cases = {f"N{seed}": CaseDescription(role=Role.VALIDATION, recipe=_with_seed(recipe, seed)) for seed in seeds}
    return like.model_copy(update={"cases": cases})


def errors_of(
    bundle: Bundle, sequences: DatasetDescription, output: str, *, where: Path, progress: Progress | None = None
) -> NDArray[np.float64]:
    """Error of a surrogate's free run on each of many sequences, of which few are in memory at a time.

    Args:
        bundle: The surrogate.
        sequences: The sequences; made ones are kept, so that a search that was stopped goes on where it was.
        output: The output that counts.
        where: Named in errors.
        progress: Called before each sequence.

    Returns:
        Root mean square error in the output's unit, infinite for a run that left all numbers, shape ``(n_cases,)``.

    Raises:
        ConfigError: If the bundle does not put it out.
        ChannelError: If the sequences lack an input of the bundle, or the output.
    """
    outputs = [str(entry["name"]) for entry in bundle.outputs]
    if output not in outputs:
        raise ConfigError.unknown(
            "the bundle has no such output", output, outputs, "name one of these", where="option --output"
        )
    names, found = list(sequences.cases), []
    for first in range(0, len(names), AT_ONCE):
        some = names[first : first + AT_ONCE]

        def report(case: str, index: int, _: int, first: int = first) -> None:
            if progress is not None:
                progress(case, first + index, len(names))

        for trace in load_described(sequences, where, cases=some, progress=report):
            run = simulate_bundle(bundle, trace, start=Start()).trace[output]
            found.append(np.sqrt(np.mean((run - trace[output])[trace.usable_samples] ** 2)))
    errors = np.array(found)
    return np.where(np.isfinite(errors), errors, np.inf)


@dataclass(frozen=True, kw_only=True)
class Kept:
    """The worst of some sequences.

    Args:
        training: Names of those to train on, the worst first.
        choosing: Names of those that choose between fits, likewise.
    """

    training: tuple[str, ...]
    choosing: tuple[str, ...]

    @classmethod
    def of(cls, names: Sequence[str], errors: NDArray[np.float64], count: int) -> Kept:
        """The worst of some sequences, dealt to training and choosing alike in how bad they are.

        Args:
            names: Their names.
            errors: Their errors.
            count: How many are kept.

        Returns:
            Them.

        Example:
            >>> Kept.of(["a", "b", "c", "d"], np.array([0.1, 0.4, 0.3, 0.2]), 3)
            Kept(training=('b', 'c'), choosing=('d',))
        """
        order = [names[i] for i in np.argsort(-errors, kind="stable")[:count]]
        choosing = order[CHOOSE // 2 :: CHOOSE]
        return cls(training=tuple(one for one in order if one not in choosing), choosing=tuple(choosing))


def kept_text(sequences: DatasetDescription, kept: Kept, *, name: str, description: str) -> str:
    """The ``dataset.yaml`` of the sequences that are kept, a line for each.

    Args:
        sequences: All of them.
        kept: Those that are kept.
        name: Of the new data set.
        description: What it is.

    Returns:
        The YAML.
    """
    head = sequences.model_copy(update={"name": name, "description": description})
    fields = head.model_dump(mode="json", exclude_unset=True, exclude={"cases"})
    roles = {**dict.fromkeys(kept.training, Role.ESTIMATION), **dict.fromkeys(kept.choosing, Role.SELECTION)}
    lines = [
        f"  {case}: {_in_a_line({'role': role.value, 'recipe': sequences.cases[case].recipe})}"
        for case, role in roles.items()
    ]
    return yaml_text(fields) + "\n".join(["cases:", *lines, ""])


def _in_a_line(value: Mapping[str, Any]) -> str:
    return yaml.safe_dump(dict(value), default_flow_style=True, sort_keys=False, width=10**6).strip()


def _count_seeds(recipe: Mapping[str, Any]) -> int:
    return sum(_count_seeds(one) if isinstance(one, Mapping) else name == "seed" for name, one in recipe.items())


def _with_seed(recipe: Mapping[str, Any], seed: int) -> dict[str, Any]:
    return {
        name: _with_seed(one, seed) if isinstance(one, Mapping) else seed if name == "seed" else one
        for name, one in recipe.items()
    }
