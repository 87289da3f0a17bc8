"""Steps whose results are JSON values kept by their content: done once, found again by any run, under any name."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from sysid.names import slug
from sysid.workbench.runner.steps import Step, Work
from sysid.workbench.runner.store import RunFolder, digest, read_json, strict, write_json


class KeptStep(Protocol):
    """One thing to do, as judges and makers have it."""

    @property
    def name(self) -> str:
        """For people; different for each step."""

    @property
    def terms(self) -> Mapping[str, Any]:
        """JSON values that the result depends on, beside the version of the code."""

    @property
    def run(self) -> Callable[[], Any]:
        """Does it; gives JSON values."""


def kept_steps(steps: Sequence[KeptStep], *, title: str, version: str, store: RunFolder) -> list[Step[Any]]:
    """Such steps for the runner.

    Args:
        steps: That do not depend on each other.
        title: What they are together, for people.
        version: Digest of the code that does them.
        store: The run folder.

    Returns:
        As many steps.
    """
    return [_kept(step, f"{title} {step.name}", version, store) for step in steps]


def _kept(step: KeptStep, title: str, version: str, store: RunFolder) -> Step[Any]:
    key = digest(strict({"code": version, "terms": dict(step.terms)}))
    # By its content, not its name: the same step under another name is the same step.
    file = store.path / "steps" / f"{key[:16]}.json"

    def make(_: Work) -> Any:
        return json.loads(json.dumps(strict(step.run())))  # the same values as when they are read again

    return Step(
        name=f"step-{key[:16]}",
        title=title,
        make=make,
        key=lambda: key,
        write=partial(_written, file),
        read=lambda _: read_json(file),
        facts=lambda _: {"does": step.name},
        timed_as=f"step-{slug(title)}",
    )


def _written(file: Path, values: Any) -> list[Path]:
    write_json(file, values)
    return [file]
