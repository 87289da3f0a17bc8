"""What the steps of a run have in common: where it stores, whom it tells, what it loads and fits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sysid.code_digest import code_digest
from sysid.composite.keeper import Fit, Task
from sysid.content import content_folders
from sysid.estimation import CascadeFit, FitProgress, FitResult
from sysid.traces import TraceSet
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.extending import Joined
from sysid.workbench.fits.record import is_final, read_fit, write_fit
from sysid.workbench.fits.steps import STORED_BY
from sysid.workbench.runner import events
from sysid.workbench.runner.naming import slug
from sysid.workbench.runner.store import RunFolder, digest, read_json, strict, write_json


@dataclass(frozen=True, kw_only=True, eq=False)
class Context:
    """One run.

    Args:
        config: The pipeline.
        joined: Its YAML, with what that extends.
        beside: Folder of the YAML, where data sets are looked for first.
        store: Folder of the run.
        command: What was typed.
        fresh: Whether everything is done again, whatever is stored.
        watchers: Told of every event.
        digests: SHA-256 of every data set that was read, by name.
    """

    config: AssemblyConfig
    joined: Joined
    beside: Path
    store: RunFolder
    command: str
    fresh: bool
    watchers: Sequence[events.Watcher]
    digests: dict[str, str] = field(default_factory=dict)

    def tell(self, event: events.Event) -> None:
        """Tell the watchers.

        Args:
            event: What happened.
        """
        for watch in self.watchers:
            watch(event)

    def load(self, name: str) -> TraceSet:
        """Load a data set.

        Args:
            name: Its name, or its folder beside the pipeline.

        Returns:
            Its traces.
        """
        from sysid.ingest import load_dataset

        step, local = f"Loading {name}", self.beside / name
        self.tell(events.StepStarted(step=step))
        loaded = load_dataset(
            local if local.exists() else name,
            search=(self.beside.parent / "datasets", *content_folders("datasets")),
            progress=lambda case, index, count: self.tell(
                events.StepProgress(step=step, fraction=index / count, detail=f"{case} ({index + 1} of {count})")
            ),
        )
        self.tell(events.StepDone(step=step, stored=False, detail=f"{len(loaded)} traces"))
        self.digests[loaded.name] = loaded.digest
        return loaded

    def keep(self, task: Task[Fit]) -> Fit:
        """The result of a task of the training, stored under what it depends on.

        Args:
            task: The task.

        Returns:
            What it comes to.
        """
        # What the YAML asks for is not code, and is among the terms.
        code = code_digest(*task.runs, STORED_BY, without=("sysid.workbench",))
        key = digest(strict({"code": code, "terms": dict(task.terms)}))
        name, form = slug(task.name), _FORMS[task.kind]
        stamp, place = form.stamp.format(name=name), self.store.path / form.place.format(name=name)
        self.tell(events.StepStarted(step=task.title))
        before = None
        if not self.fresh and self.store.is_done(stamp, key):
            before = form.read(place)
        fit = task.make(self.reporter(task.title)) if before is None else task.put(before)
        if before is None or before.model.to_dict() != fit.model.to_dict():
            files = form.write(place, fit)
            if is_final(fit):
                self.store.mark_done(stamp, key, files)
        detail = f"{fit.train_time_s:.1f} s, {fit.status.value}"
        self.tell(events.StepDone(step=task.title, stored=before is not None, detail=detail))
        return fit

    def say(self, title: str, detail: str = "", *, done: bool = False) -> None:
        """Tell of work of the training whose result is not stored.

        Args:
            title: The work.
            detail: How it goes.
            done: Whether it has ended.
        """
        if done:
            self.tell(events.StepDone(step=title, stored=False, detail=detail))
        elif detail:
            self.tell(events.StepProgress(step=title, fraction=None, detail=detail))
        else:
            self.tell(events.StepStarted(step=title))

    def reporter(self, step: str) -> Callable[[FitProgress], None]:
        """Whom a training tells after every iteration.

        Args:
            step: Title of the step.

        Returns:
            The callback.
        """

        def report(entry: FitProgress) -> None:
            detail = f"start {entry.start} of {entry.starts}, {entry.stage}, iteration {entry.iteration}"
            self.tell(events.StepProgress(step=step, fraction=entry.fraction, detail=f"{detail}, mse {entry.mse:.3g}"))

        return report


@dataclass(frozen=True)
class _Form:
    """How a kind of result is stored: what its stamp is called, where it lies, how it is written and read."""

    stamp: str
    place: str
    write: Callable[[Path, Any], list[Path]]
    read: Callable[[Path], Any]


def _write_round(file: Path, fit: CascadeFit) -> list[Path]:
    write_json(file, fit.to_dict())
    return [file]


def _read_round(file: Path) -> CascadeFit:
    return CascadeFit.from_dict(read_json(file))


_FORMS: dict[type, _Form] = {
    FitResult: _Form("fit-{name}", "fits/{name}", write_fit, read_fit),
    CascadeFit: _Form("{name}", "{name}.json", _write_round, _read_round),
}
