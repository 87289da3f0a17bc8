"""What the steps of a run have in common: where it stores, whom it tells, what it loads and fits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from sysid.code_digest import code_digest
from sysid.content import content_folders
from sysid.estimation import FitProgress, FitResult
from sysid.traces import TraceSet
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.extending import Joined
from sysid.workbench.fits.record import is_final, read_fit, write_fit
from sysid.workbench.fits.steps import STORED_BY
from sysid.workbench.runner import events
from sysid.workbench.runner.store import RunFolder, digest, strict

SEEDS_OF_A_START = 10_000
"""How far the seeds of one start are from the next one's: its candidates' are a thousand apart."""


def training_code(work: Callable[..., Any] | str, models: Iterable[object]) -> str:
    """Digest of the code that a training runs; what the YAML asks for is not code, and is among the terms of its key.

    Args:
        work: Does it, or its address.
        models: That it is given, which are of any class.

    Returns:
        64 hexadecimal digits.
    """
    function = work.func if isinstance(work, partial) else work
    return code_digest(function, *{type(model) for model in models}, STORED_BY, without=("sysid.workbench",))


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
        start: Which of the pipeline's starts this is, from 1 on.
    """

    config: AssemblyConfig
    joined: Joined
    beside: Path
    store: RunFolder
    command: str
    fresh: bool
    watchers: Sequence[events.Watcher]
    digests: dict[str, str] = field(default_factory=dict)
    start: int = 1

    def of_start(self, number: int) -> Context:
        """The same run with the seeds of one of its starts.

        Args:
            number: From 1 on; the first has the pipeline's own seed.

        Returns:
            The context.
        """
        seed = self.config.seed + SEEDS_OF_A_START * (number - 1)
        return replace(self, config=self.config.model_copy(update={"seed": seed}), start=number)

    def named(self, name: str) -> str:
        """What a step of this start is called on disk."""
        return name if self.start == 1 else f"start-{self.start}-{name}"

    def titled(self, step: str) -> str:
        """What a step of this start is called on the screen."""
        return step if self.config.starts == 1 else f"Start {self.start} of {self.config.starts}: {step}"

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

    def fit(
        self,
        name: str,
        title: str,
        terms: Mapping[str, Any],
        work: Callable[[Callable[[FitProgress], None]], FitResult],
        models: Iterable[object] = (),
    ) -> tuple[FitResult, str]:
        """A fit that is stored under what it depends on.

        Args:
            name: Of its folder.
            title: Of the step.
            terms: What it depends on, beside the code.
            work: Does it; given whom to tell after every iteration.
            models: That the work is given.

        Returns:
            The fit, and the digest of what it depends on.
        """
        key = digest(strict({"code": training_code(work, models), "terms": dict(terms)}))
        name, title = self.named(name), self.titled(title)
        folder = self.store.fit(name)
        self.tell(events.StepStarted(step=title))
        stored = not self.fresh and self.store.is_done(f"fit-{name}", key)
        if stored:
            fit = read_fit(folder)
        else:
            fit = work(self.reporter(title))
            files = write_fit(folder, fit)
            if is_final(fit):
                self.store.mark_done(f"fit-{name}", key, files)
        self.tell(events.StepDone(step=title, stored=stored, detail=f"{fit.train_time_s:.1f} s, {fit.status.value}"))
        return fit, key

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
