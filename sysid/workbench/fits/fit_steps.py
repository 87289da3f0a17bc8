"""The steps of a pipeline of kind ``fits``: traces, each fit and its figures, the chosen one exported, the report."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid.estimation import FitResult
from sysid.export.exporters import wanted_formats
from sysid.reporting.published.tables import read_published
from sysid.reporting.results import Results, parse_results
from sysid.reporting.sweep_record import has_sweep, read_sweep
from sysid.units import in_unit
from sysid.workbench.fits import steps
from sysid.workbench.fits.choice import Choice, choose
from sysid.workbench.fits.config import FitConfig, Pipeline, PipelineConfig
from sysid.workbench.fits.data import Data, load_data, unmade_data
from sysid.workbench.fits.estimates import EXPORT_TIME, SCORING_TIME, amount, how_long
from sysid.workbench.fits.evidence import curves, residuals
from sysid.workbench.fits.fitted import Fitted, Scored
from sysid.workbench.fits.orders import orders_key, said, search
from sysid.workbench.fits.outputs import FitModel, FitOutput, models_of
from sysid.workbench.fits.record import (
    export_record,
    is_final,
    read_fit,
    read_scores,
    results_document,
    write_curves,
    write_fit,
    write_residuals,
    write_scores,
)
from sysid.workbench.fits.shared_config import ExportConfig
from sysid.workbench.fits.words import cases_told, fit_title, how_ended, looked_told, worst_told
from sysid.workbench.runner import events
from sysid.workbench.runner.run import REPORT, Run
from sysid.workbench.runner.steps import NOT_KNOWN, Done, Estimate, Outlined, Step, Work
from sysid.workbench.runner.store import read_json, strict, write_json

if TYPE_CHECKING:
    from sysid.export import Bundle

LOOKING = Outlined(name="advice", title="Looking at the traces", estimate=Estimate(seconds=2.0, basis="typical"))
LOADING = Outlined(name="data", title="Loading the traces")
ORDERS = Outlined(name="orders", title="Searching the orders", estimate=Estimate(seconds=10.0, basis="typical"))


@dataclass(frozen=True, kw_only=True, eq=False)
class GivenFit:
    """A fit that was made elsewhere, such as by a sweep, and goes through the steps like any other.

    Args:
        key: Digest of everything that it depends on.
        make: Gives it, when it is not stored yet; told how to say how that goes.
        bare: Gives it without its posterior, for which a part of its training may have to be done again; ``None`` where
            that costs nothing.
    """

    key: str
    make: Callable[[Work], FitResult]
    bare: Callable[[], FitResult] | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class FitSteps:
    """The steps of one pipeline.

    Args:
        pipeline: What to do.
        given: Fits that are made already, by name.
        chosen: The fit that comes first, where it was chosen elsewhere.
        page: Whether a page is made of the results, and the traces are looked at for it.
        before_page: Writes what the page shows beside the results, once these and the bundle are there.
        suggest: Whether the page suggests structures.
        seen: The traces that have a look for the page; all of them by default.
    """

    pipeline: Pipeline
    given: Mapping[str, GivenFit] = field(default_factory=dict)
    chosen: Choice | None = None
    page: bool = True
    before_page: Callable[[], object] | None = None
    suggest: bool = True
    seen: Callable[[Data], Data] = lambda data: data

    @property
    def config(self) -> PipelineConfig:
        """The checked fields."""
        return self.pipeline.config

    @property
    def _names(self) -> tuple[str | None, ...]:
        return (self.config.data, self.config.selection, self.config.stability.sequences)

    def outline_around(self, trials: Outlined) -> list[Outlined]:
        """All steps of a search, which stands behind the loading: of which structure a fit is, nobody knows."""
        data, *rest = self.outline()
        named = [
            replace(one, title=one.title.partition(",")[0]) if one.name.startswith("fit-") else one for one in rest
        ]
        return [data, trials, *named]

    def outline(self) -> list[Outlined]:
        """All steps, as far as they are known before the traces are."""
        found = [LOADING] + ([ORDERS] if self.config.orders is not None else [])
        for model in (model for fit in self.config.fits for model in models_of(fit, self.config)):
            found.append(Outlined(name=f"fit-{model.fit.slug}", title=fit_title(model.fit), called=model.fit.name))
            found += [
                Outlined(name=f"scores-{one.fit.slug}", title=f"Scoring {one.fit.name}", estimate=SCORING_TIME)
                for one in model.outputs
            ]
        if self.config.export is not None:
            asked = self.config.export.fit
            name = "the best fit" if asked == "best" else asked
            found.append(Outlined(name="export", title=self._exporting(name), estimate=EXPORT_TIME))
        return [*found, LOOKING, REPORT]

    def run(self, run: Run, loaded: Done[Data] | None = None) -> Results:
        """Every step, in order.

        Args:
            run: Does them.
            loaded: The traces, where they are loaded already.

        Returns:
            The contents of ``results.json``.
        """
        if self.config.export is not None:
            wanted_formats(self.config.export.formats)  # what cannot be written is said now, not when all is fitted
        return self._run(run, loaded or run.do(self.loading()))

    def _run(self, run: Run, loaded: Done[Data]) -> Results:
        run.then(lambda: run.tell(_loaded(loaded.value)))
        orders = run.do(self._orders(run, loaded)) if self.config.orders is not None else None
        fitted: dict[str, Fitted] = {}
        for fit in self.config.fits:
            fitted[fit.name] = self._fitted(run, fit, loaded, fitted)
            run.then(partial(self._announce, run, loaded, fitted, fit.name))
        asked = self.config.export.fit if self.config.export else "best"
        sizes = steps.output_sizes(loaded.value, self.config.mapping.outputs)
        pairs = {name: one.pairs for name, one in fitted.items()}
        unstable = self.config.export is None or self.config.export.unstable
        choice = self.chosen or choose(pairs, asked, sizes, unstable=unstable, tolerance=self.config.tolerance)
        best = fitted[choice.name]
        leaves = self.config.export is not None and not choice.withheld
        bundle = run.export(self._export(run, best, loaded)) if leaves else None
        exports = () if bundle is None else bundle.value
        for refused in run.refused:
            choice = replace(choice, chosen_by=f"{choice.chosen_by} It is not exported: {refused.summary}.")
        if bundle is not None:
            place, stored = run.store.bundle, bundle.stored
            for ready in best.ready:
                told = events.BundleReady(
                    of=ready, folder=place, exports=exports, stored=stored,
                    mapping=str(self.config.mapping), told=ready.output != self.config.mapping.outputs[0],
                )  # fmt: skip
                run.then(partial(run.tell, told))
        advice = run.do(self._look(run, loaded)).value if self.page else ()
        found = () if orders is None else orders.value
        results = self._results(run, loaded.value, fitted, choice=choice, exports=exports, advice=advice, orders=found)
        if not self.page:
            return results
        if self.before_page is not None and not run.refused:
            run.then(self.before_page)
        page = run.report(results)
        for ready in best.ready:
            written = events.ReportReady(page=page.value, results=run.store.results, of=ready)
            run.then(partial(run.tell, written))
        return results

    def loading(self) -> Step[Data]:
        """The step that loads the traces."""
        beside = self.pipeline.path.parent

        def make(work: Work) -> Data:
            if self.config.report.published is not None:
                # A misspelt name is told before the fits are done, not after.
                read_published(self.config.report.published)
            return load_data(self.config, beside=beside, progress=work.say)

        return Step(
            name=LOADING.name,
            title=LOADING.title,
            make=make,
            outcome=cases_told,
            at_hand=lambda: unmade_data(self._names, beside=beside) is None,
            how_long=lambda: unmade_data(self._names, beside=beside) or NOT_KNOWN,
        )

    def _orders(self, run: Run, loaded: Done[Data]) -> Step[list[dict[str, Any]]]:
        """The step that searches the orders."""
        file = run.store.path / "orders.json"

        def write(found: list[dict[str, Any]]) -> list[Path]:
            write_json(file, {"orders": found})
            return [file]

        return Step(
            name=ORDERS.name,
            title=ORDERS.title,
            make=lambda _: search(self.config, loaded.value),
            key=lambda: orders_key(self.config, loaded.value),
            write=write,
            read=lambda _: list(read_json(file)["orders"]),
            outcome=said,
            typical=ORDERS.estimate,
        )

    def _fitted(self, run: Run, fit: FitConfig, loaded: Done[Data], earlier: Mapping[str, Fitted]) -> Fitted:
        begun = earlier[fit.initial].models if fit.initial else {}
        models, outputs, wanted = dict[str, Done[FitResult]](), list[Scored](), models_of(fit, self.config)
        for model in wanted:
            mapping = str(model.config.mapping)
            made = models[mapping] = run.do(self._fit(run, model, loaded, begun.get(mapping)))
            for one in model.outputs:
                folder = run.store.fit(one.fit.slug)
                step = self._score(made, loaded, one, folder)
                if len(wanted) > 1 and model is wanted[-1] and one is model.outputs[-1]:
                    step = replace(step, called=fit.name, export=partial(self._whole, models, outputs, loaded))
                scores = run.do(step)
                outputs.append(Scored(output=one, of=fit, model=model, fit=made, scores=scores, folder=folder))
        return Fitted(config=fit, models=models, outputs=tuple(outputs))

    def _fit(self, run: Run, model: FitModel, loaded: Done[Data], initial: Done[FitResult] | None) -> Step[FitResult]:
        fit, config = model.fit, model.config
        given, folder = self.given.get(fit.name), run.store.fit(fit.slug)

        def find_key() -> str:
            return given.key if given else steps.fit_key(fit, config, loaded.value, initial.key if initial else None)

        def make(work: Work) -> FitResult:
            if given is not None:
                return given.make(work)
            begin = initial.value if initial else None
            watch = work.watch(getattr(fit.training_options(config.seed), "max_time_s", math.inf))
            return steps.fit_traces(fit, config, loaded.value, begin, watch)

        return Step(
            name=f"fit-{fit.slug}",
            title=fit_title(fit),
            make=make,
            key=find_key,
            after=[initial] if initial else [],
            write=partial(write_fit, folder),
            read=lambda _: read_fit(folder),
            outcome=how_ended,
            final=is_final,
            amount=lambda: amount(fit, loaded.value),
            how_long=lambda: how_long(fit, config, loaded.value),
            called=fit.name,
            export=lambda result, into, provenance: self._bundle(model, result, loaded.value, into, provenance),
        )

    def _bundle(self, model: FitModel, fit: FitResult, data: Data, folder: Path, provenance: dict[str, Any]) -> Bundle:
        """Any model of a fit as a bundle, whether or not it is the one that the pipeline exports."""
        config = model.config.model_copy(update={"export": self.config.export or ExportConfig()})
        scores = {one.config.mapping.output: steps.score(fit, data, one.config) for one in model.outputs}
        return steps.export([fit], scores, data, config, folder=folder, provenance=provenance)

    def _whole(
        self,
        models: Mapping[str, Done[FitResult]],
        outputs: Sequence[Scored],
        loaded: Done[Data],
        _: steps.Scores,
        folder: Path,
        provenance: dict[str, Any],
    ) -> Bundle:
        """All models of a fit that has one an output as a bundle, which is there once the last of them is scored."""
        config = self.config.model_copy(update={"export": self.config.export or ExportConfig()})
        scores = {one.output.config.mapping.output: one.scores.value for one in outputs}
        fits = [one.value for one in models.values()]
        return steps.export(fits, scores, loaded.value, config, folder=folder, provenance=provenance)

    @staticmethod
    def _score(made: Done[FitResult], loaded: Done[Data], output: FitOutput, folder: Path) -> Step[steps.Scores]:
        fit, config, written = output.fit, output.config, list[Path]()

        def make(_: Work) -> steps.Scores:
            scores = steps.score(made.value, loaded.value, config)
            written[:] = write_residuals(folder, residuals(made.value, loaded.value, config))
            written.extend(write_curves(folder, curves(made.value, loaded.value, config)))
            return scores

        return Step(
            name=f"scores-{fit.slug}",
            title=f"Scoring {fit.name}",
            make=make,
            key=lambda: steps.scores_key(made.key, fit.structure, loaded.value, config),
            # A fit that was made again may differ from the stored one by what its key does not know: a time limit, or
            # Ctrl-C. Its figures are made again with it.
            of=made,
            write=lambda scores: write_scores(folder, scores) + written,
            read=lambda _: read_scores(folder),
            outcome=worst_told,
            typical=SCORING_TIME,
        )

    def _look(self, run: Run, loaded: Done[Data]) -> Step[list[dict[str, Any]]]:
        """What is in the traces; after the fits, which nobody shall wait for longer than they take."""
        file, seen = run.store.path / "advice.json", self.seen(loaded.value)

        def write(found: list[dict[str, Any]]) -> list[Path]:
            write_json(file, found)
            return [file]

        return Step(
            name=LOOKING.name,
            title=LOOKING.title,
            make=lambda _: steps.look(self.config, seen, suggest=self.suggest),
            key=lambda: steps.advice_key(self.config, seen, suggest=self.suggest),
            write=write,
            read=lambda _: read_json(file),
            outcome=looked_told,
            typical=LOOKING.estimate,
        )

    def _export(self, run: Run, best: Fitted, loaded: Done[Data]) -> Step[tuple[dict[str, Any], ...]]:
        config, folder, fits = self.config, run.store.bundle, [one.value for one in best.models.values()]
        unit = ", ".join(dict.fromkeys(unit for fit in fits for unit in fit.model.ends.output_units))
        scores = {one.output.config.mapping.output: one.scores.value for one in best.outputs}
        provenance = {"pipeline": config.name, "fit": best.config.name, "command": run.command}

        def make(_: Work) -> tuple[dict[str, Any], ...]:
            bundle = steps.export(fits, scores, loaded.value, config, folder=folder, provenance=provenance)
            timed = steps.export_run_times(bundle) if config.export and config.export.run_times else ()
            return tuple(export_record(entry, folder.name, unit, timed) for entry in bundle.files)

        def outcome(exports: Sequence[Mapping[str, Any]]) -> str:
            worst = max((float(entry["largest_difference"]) for entry in exports), default=0.0)
            files = "1 file" if len(exports) == 1 else f"{len(exports)} files"
            return f"{files}, at most {in_unit(f'{worst:.1e}', unit)} from the model"

        return Step(
            name="export",
            title=self._exporting(best.config.name),
            make=make,
            key=lambda: steps.export_key(best.scores_key, config),
            of=best.outputs[-1].scores,
            write=lambda _: [file for file in sorted(folder.rglob("*")) if file.is_file()],
            read=lambda facts: tuple(facts["exports"]),
            facts=lambda exports: {"exports": list(exports)},
            outcome=outcome,
            typical=EXPORT_TIME,
        )

    def _exporting(self, name: str) -> str:
        asked = self.config.export or ExportConfig()
        return f"Exporting {name} as {wanted_formats(asked.formats)}"

    def _announce(self, run: Run, loaded: Done[Data], fitted: Mapping[str, Fitted], name: str) -> None:
        """Tell of a fit; a killed run leaves results.json with what is finished, not with what an older run had."""
        told = fitted[name].ready
        for ready in told:
            run.tell(ready)
        if not all(ready.stored for ready in told):
            self._results(run, loaded.value, fitted, choice=None, exports=())

    def _results(
        self,
        run: Run,
        data: Data,
        fitted: Mapping[str, Fitted],
        *,
        choice: Choice | None,
        exports: Sequence[Mapping[str, Any]],
        advice: Sequence[Mapping[str, Any]] = (),
        orders: Sequence[Mapping[str, Any]] = (),
    ) -> Results:
        document = results_document(
            config=self.config,
            command=run.command,
            environment=run.environment,
            data=data,
            fits=[ready for one in fitted.values() for ready in one.ready],
            choice=choice,
            exports=exports,
            advice=advice,
            orders=orders,
            sweep=read_sweep(run.store.path) if has_sweep(run.store.path) else None,
        )
        new = parse_results(strict(document), where=run.store.results)
        return run.results(new)


def _loaded(data: Data) -> events.DataLoaded:
    return events.DataLoaded(traces=data.traces, selection=tuple(trace.name for trace in data.selection))
