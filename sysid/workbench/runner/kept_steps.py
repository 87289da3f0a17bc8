"""Steps whose results are kept by their content: done once, found again by any later run, whoever asks for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from sysid.workbench.runner.events import Event, StepDone, StepProgress, StepStarted
from sysid.workbench.runner.store import RunFolder, digest, read_json, strict, write_json


class Step(Protocol):
    """One thing to do."""

    @property
    def name(self) -> str:
        """For people; different for each step."""

    @property
    def terms(self) -> Mapping[str, Any]:
        """JSON values that the result depends on, beside the version of the code."""

    @property
    def run(self) -> Callable[[], Any]:
        """Does it; gives JSON values."""


def do_steps(
    steps: Sequence[Step], *, title: str, version: str, store: RunFolder, fresh: bool, tell: Callable[[Event], None]
) -> dict[str, Any]:
    """The result of every step; each is on disk before the next begins.

    Args:
        steps: That do not depend on each other.
        title: What they are together, for people.
        version: Digest of the code that does them.
        store: The run folder.
        fresh: Do all of them again.
        tell: Told what happens.

    Returns:
        Results by name of the step.
    """
    tell(StepStarted(step=title))
    results, stored = {}, 0
    for number, step in enumerate(steps):
        detail = f"{step.name} ({number + 1} of {len(steps)})"
        tell(StepProgress(step=title, fraction=number / len(steps), detail=detail))
        key = digest(strict({"code": version, "terms": dict(step.terms)}))
        # By its content, not its name: the same step under another name is the same step.
        name, file = f"step-{key[:16]}", store.path / "steps" / f"{key[:16]}.json"
        if not fresh and store.is_done(name, key):
            stored += 1
        else:
            write_json(file, step.run())
            store.mark_done(name, key, [file], does=step.name)
        results[step.name] = read_json(file)
    tell(StepDone(step=title, stored=stored == len(steps), detail=f"{len(steps)} steps, {stored} of them stored"))
    return results
