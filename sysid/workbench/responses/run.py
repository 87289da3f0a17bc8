"""A fit to a measured frequency response as steps: the file read, orders compared or fitted, exported, reported."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from sysid.api.responses import poles
from sysid.atomic import write_bytes
from sysid.estimation import FitResult
from sysid.export.exporters import wanted_formats
from sysid.names import slug
from sysid.reporting.frequency import HERTZ
from sysid.reporting.numbers import number
from sysid.reporting.records import parse_record, read_document, write_record
from sysid.reporting.responses.results import ResponseDataRecord, ResponseFitRecord, ResponseResults
from sysid.traces.measured_response import MeasuredResponse
from sysid.units import in_unit
from sysid.workbench.fits.record import export_record, read_fit, write_fit
from sysid.workbench.fits.steps import export_run_times
from sysid.workbench.responses import steps
from sysid.workbench.responses.config import ResponseConfig
from sysid.workbench.runner import events
from sysid.workbench.runner.naming import nearby
from sysid.workbench.runner.program import Closing, Program
from sysid.workbench.runner.run import REPORT, Run
from sysid.workbench.runner.steps import Done, Estimate, Outlined, Step, Work
from sysid.workbench.written import Written
from sysid.yaml_files import yaml_text

if TYPE_CHECKING:
    from sysid.export import Bundle
    from sysid.workbench.kinds import RunRequest

LOADING = Outlined(name="data", title="Reading the response")
FITTING, COMPARING = "Fitting a transfer function", "Comparing orders"
EXPORT_TIME = Estimate(seconds=10.0, basis="typical")
TABLE, RECORD = "response.csv", "record.json"


@dataclass(frozen=True, kw_only=True, eq=False)
class Response(Written[ResponseConfig]):
    """A fit to a response and where it was read from.

    Args:
        load: Gives the response where it is at hand; by default it is read as the YAML says.
    """

    load: Callable[[], MeasuredResponse] | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Fitted:
    """A fit as it is stored.

    Args:
        fit: The fit.
        record: As results.json has it, without exports.
    """

    fit: FitResult
    record: ResponseFitRecord


@dataclass(frozen=True, kw_only=True, eq=False)
class Responded:
    """What came of a run.

    Args:
        results: The contents of ``results.json``.
        fit: The fit.
    """

    results: ResponseResults
    fit: FitResult


def program(request: RunRequest) -> Program[Responded]:
    """What ``sysid run`` does of a pipeline of kind ``response``.

    Args:
        request: What was asked.

    Returns:
        The program.

    Raises:
        UserError: If the pipeline cannot be used.
    """
    return program_of(Response.read(ResponseConfig, request.path))


def response_of(config: ResponseConfig, *, load: Callable[[], MeasuredResponse] | None = None) -> Response:
    """A fit that is in no file.

    Args:
        config: Its fields.
        load: Gives the response.

    Returns:
        The fit, with the YAML that makes it again.
    """
    fields = {"kind": config.kind, **config.model_dump(mode="json", exclude_defaults=True)}
    return Response(config=config, text=yaml_text(fields), path=Path.cwd() / f"{config.name}.yaml", load=load)


def program_of(pipeline: Response, *, verb: str = "run") -> Program[Responded]:
    """A fit to a response as a program.

    Args:
        pipeline: What to do; paths in it are relative to the folder of its file.
        verb: The command that runs it.

    Returns:
        The program.
    """
    work = _ResponseSteps(pipeline=pipeline)
    return Program(
        name=pipeline.config.name, keep=pipeline.keep, steps=work.run, outline=work.outline, closing=closing, verb=verb
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _ResponseSteps:
    """The steps of one pipeline."""

    pipeline: Response

    @property
    def config(self) -> ResponseConfig:
        """The checked fields."""
        return self.pipeline.config

    @property
    def _fitting(self) -> Outlined:
        title = COMPARING if self.config.searched else f"{FITTING}, {self.config.structure.label}"
        return Outlined(name="fit", title=title, called=self.config.name)

    def outline(self) -> list[Outlined]:
        """All steps."""
        export = [] if self.config.export is None else [Outlined(name="export", title=self._exporting)]
        return [LOADING, self._fitting, *export, REPORT]

    def run(self, run: Run) -> Responded:
        """Every step, in order."""
        if self.config.export is not None:
            wanted_formats(self.config.export.formats)  # what cannot be written is said now, not when all is fitted
        loaded = run.do(self._loading())
        done = run.do(self._fit(run, loaded))
        bundle = None if self.config.export is None else run.export(self._export(run, done, loaded))
        exports = () if bundle is None else bundle.value
        results = self._results(run, loaded.value, done.value.record, exports)
        page = run.report(results)
        run.then(lambda: self._track(run, results, done, page.value))
        return Responded(results=results, fit=done.value.fit)

    def _loading(self) -> Step[MeasuredResponse]:
        def make(_: Work) -> MeasuredResponse:
            given = self.pipeline.load
            measured = given() if given else steps.load_response(self.config, self.pipeline.path.parent)
            steps.problem_of(self.config, measured)  # what does not apply is said before anything is fitted
            return measured

        def outcome(measured: MeasuredResponse) -> str:
            low, high = HERTZ.told(measured.frequency[[0, -1]])
            return f"{len(measured)} points from {low:.4g} to {high:.4g} Hz"

        return Step(
            name=LOADING.name, title=LOADING.title, make=make, outcome=outcome, at_hand=lambda: True
        )  # fmt: skip

    def _fit(self, run: Run, loaded: Done[MeasuredResponse]) -> Step[Fitted]:
        folder, config = run.store.fit(slug(str(self.config.mapping))), self.config

        def make(work: Work) -> Fitted:
            problem = steps.problem_of(config, loaded.value)
            fit = steps.fit_response(problem, config, work.say)
            write_bytes(run.store.path / TABLE, fit.to_frame().to_csv(index=False).encode())
            return Fitted(fit=fit, record=steps.record_of(fit))

        def write(found: Fitted) -> list[Path]:
            written = write_fit(folder, found.fit)
            return [*written, write_record(folder / RECORD, found.record), run.store.path / TABLE]

        def read(_: object) -> Fitted:
            place = folder / RECORD
            record = parse_record(ResponseFitRecord, read_document(place), where=place)
            return Fitted(fit=read_fit(folder), record=record)

        return Step(
            name=self._fitting.name,
            title=self._fitting.title,
            make=make,
            key=lambda: steps.fit_key(config, loaded.value),
            write=write,
            read=read,
            outcome=lambda found: f"{found.record.label}, {found.record.fit_percent:.2f} % of the response",
            amount=lambda: [len(loaded.value), str(config.poles), str(config.delays)],
            called=config.name,
            export=lambda found, into, provenance: self._bundle(found, loaded.value, into, provenance),
        )

    def _bundle(self, found: Fitted, measured: MeasuredResponse, into: Path, provenance: dict[str, Any]) -> Bundle:
        return steps.export(found.fit, measured, self.config, into, provenance)

    @property
    def _exporting(self) -> str:
        asked = self.config.export
        return f"Exporting it as {wanted_formats(None if asked is None else asked.formats)}"

    def _export(self, run: Run, done: Done[Fitted], loaded: Done[MeasuredResponse]) -> Step[tuple[dict[str, Any], ...]]:
        config, folder = self.config, run.store.bundle
        provenance = {"pipeline": config.name, "command": run.command}

        def make(_: Work) -> tuple[dict[str, Any], ...]:
            bundle = self._bundle(done.value, loaded.value, folder, provenance)
            timed = export_run_times(bundle) if config.export and config.export.run_times else ()
            unit = done.value.record.units[1]
            return tuple(export_record(entry, folder.name, unit, timed) for entry in bundle.files)

        def outcome(exports: Sequence[Any]) -> str:
            worst = max((float(entry["largest_difference"]) for entry in exports), default=0.0)
            files = "1 file" if len(exports) == 1 else f"{len(exports)} files"
            return f"{files}, at most {in_unit(f'{worst:.1e}', done.value.record.units[1])} from the model"

        return Step(
            name="export",
            title=self._exporting,
            make=make,
            key=lambda: steps.export_key(done.key, config),
            of=done,
            write=lambda _: [file for file in sorted(folder.rglob("*")) if file.is_file()],
            read=lambda facts: tuple(facts["exports"]),
            facts=lambda exports: {"exports": list(exports)},
            outcome=outcome,
            typical=EXPORT_TIME,
        )

    def _results(
        self, run: Run, measured: MeasuredResponse, record: ResponseFitRecord, exports: Sequence[Any]
    ) -> ResponseResults:
        data = ResponseDataRecord(
            name=measured.name,
            digest=steps.data_digest(measured),
            file=self.config.data,
            points=len(measured),
            lowest=float(measured.frequency[0]),
            highest=float(measured.frequency[-1]),
            coherence=measured.coherence is not None,
            notes=list(measured.notes),
        )
        fields = {**record.model_dump(), "exports": list(exports)}
        results = ResponseResults(
            kind=self.config.kind,
            pipeline=self.config.name,
            description=self.config.description,
            command=run.command,
            created=time.strftime("%Y-%m-%dT%H:%M:%S%z"),
            environment=dict(run.environment),
            seed=self.config.options.seed,
            data=data,
            fits=[ResponseFitRecord.model_validate(fields)],
            frequency=self.config.report.frequency,
        )
        return run.results(results)

    def _track(self, run: Run, results: ResponseResults, done: Done[Fitted], page: Path) -> None:
        run.tell(
            events.ResponseReady(
                results=results,
                key=done.key,
                stored=done.stored,
                page=page,
                document=run.store.results,
                bundle=run.store.bundle if results.fits[0].exports else None,
            )
        )


def closing(found: Responded, folder: Path) -> Closing:
    """What is said at the end: the orders that were compared, the fit, its poles, and what was guessed.

    Args:
        found: What came of the run.
        folder: The run folder.

    Returns:
        The lines and files.
    """
    (fit,) = found.results.fits
    lines: list[Any] = [] if fit.orders is None else [table_of_orders(fit)]
    lines += [f"{fit.label}, {fit.mapping}", fit.ended, f"Fit of the frequency response: {fit.fit_percent:.2f} %."]
    if math.isfinite(fit.left_out_percent):
        lines += [f"Error at frequencies left out of the fit, each fifth in turn: {fit.left_out_percent:.3g} %."]
    at = HERTZ.told(float(fit.furthest_at))
    lines += [f"Furthest off: {fit.furthest_db:.3g} dB, at {at:.4g} Hz; {fit.furthest_degrees:.3g} degrees."]
    lines += [f"  {one.name:<16} {one.value:>12.6g} ± {one.deviation:.3g}" for one in fit.parameters]
    lines += [f"Poles\n{poles(found.fit)}", *(f"Note: {note}" for note in (*found.results.data.notes, *fit.notes))]
    names = {"Report": "report/index.html", "Table": TABLE, "Bundle": "bundle", "Results": "results.json"}
    files = {what: nearby(folder.resolve() / name) for what, name in names.items()}
    return Closing(lines=lines, files=files, compare=True)


def table_of_orders(fit: ResponseFitRecord) -> Table:
    """All structures that were compared, the best first.

    Args:
        fit: The fit that was chosen.

    Returns:
        The table.
    """
    table = Table(title="Orders by the errors at frequencies left out of the fits", title_justify="left")
    for head in ("poles", "zeros", "dead time [s]", "error where left out %", "fit %", "beyond the best"):
        table.add_column(head, justify="right")
    for one in fit.orders.rows if fit.orders is not None else ():
        table.add_row(
            str(one.poles), str(one.zeros), number(one.dead_time), f"{one.left_out:.3g}", f"{one.fit:.2f}",
            f"{one.score:.3g}",
        )  # fmt: skip
    return table
