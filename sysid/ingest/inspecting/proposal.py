"""A ``dataset.yaml`` for a file that was inspected: it loads, and it says what was guessed."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sysid.errors import ReaderError
from sysid.ingest.inspecting.findings import ColumnFinding, FileFinding
from sysid.ingest.readers.text_source import bare_stem
from sysid.ingest.tables.options import GridOptions
from sysid.units import Reference

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_/.^-]*(?: [A-Za-z0-9_/.^-]+)*")
_WORDS = {"true", "false", "null", "yes", "no", "on", "off"}


def propose_dataset(finding: FileFinding, *, folder: Path | None = None, split: Sequence[float] = ()) -> str:
    """Write the description of a data set that holds one inspected file.

    Args:
        finding: From :func:`~sysid.ingest.inspecting.inspection.inspect_file`.
        folder: Where it will be saved; ``None`` is beside the file.
        split: Shares of estimation, selection and validation: of the rows of one record, or of several records in their
            order; none leaves all for estimation.

    Returns:
        YAML to be saved as ``dataset.yaml``.

    Raises:
        ReaderError: If the file has no column that can be a channel, or its rows are no samples over time.
    """
    if not finding.channels:
        raise ReaderError(
            "the file has no column that can be a channel",
            where=finding.path,
            expected="at least one column of numbers beside time",
            got=", ".join(f"{column.name}: {column.problem or column.aside}" for column in finding.columns)
            or "time alone",
            remedy="choose another file, or read it with other options",
        )
    if finding.samples < 2:
        raise ReaderError(
            "one sample is no record",
            where=finding.path,
            expected="a row of numbers for each sample, at least two",
            got=f"{finding.samples} row",
            remedy="check that the recording was saved, and the options separator and skip_lines",
        )
    if finding.frequencies:
        from sysid.ingest.tables.no_record import refuse_frequencies  # here: a record needs no word of it

        raise refuse_frequencies(finding.frequencies, finding.path)
    finding = _in_parts(finding, split) if split and not finding.cases else finding
    # A data set under datasets/ is called by its folder, whatever the file is called.
    place = finding.path if folder is None else folder.resolve()
    name = place.name if place.parent.name == "datasets" and folder is not None else bare_stem(finding.path)
    lines = [
        f"# Proposed from {_comment(finding.path.name)}. Check what is marked 'guessed' before you rely on it.",
        f"name: {_text(name)}",
        'description: ""',
        f"sample_time: {finding.sample_time!r}  # s",
        "channels:",
        *(f"  - {_channel(column)}" for column in finding.channels),
        "source:",
        *_files(finding),
        *_grid(finding),
        *_repairs(finding),
        "cases:",
        *(_shared if split else _cases)(finding, _seen_from(finding.path, folder), *([split] if split else [])),
        'provenance: ""',
        'licence: ""',
    ]
    return "\n".join(lines) + "\n"


def _in_parts(finding: FileFinding, split: Sequence[float]) -> FileFinding:
    """What was found, with the channels that move in the record but not in each of its parts."""
    from sysid.ingest.split import spans_of

    told = []
    for role, start, stop in spans_of(split, finding.samples):
        parts = {column.name: finding.table.find(column.name).values[start:stop] for column in finding.channels}
        still = [name for name, part in parts.items() if len(part) and np.all(part == part[0])]
        told += [f"{', '.join(still)}: never changes in {role.value}"] if still else []
    if not told:
        return finding
    needed = finding.needed.model_copy(update={"constant": "accept"})
    return replace(finding, needed=needed, notes=(*finding.notes, *told))


def _channel(column: ColumnFinding) -> str:
    pairs = {"name": column.name, "unit": column.unit}
    if column.reference is not Reference.NONE or column.reference_guessed:
        pairs["reference"] = column.reference.value
    if column.description:
        pairs["description"] = column.description
    guessed = [
        what for what, is_guess in (("unit", column.unit_guessed), ("reference", column.reference_guessed)) if is_guess
    ]
    told = f"guessed: {' and '.join(guessed)}; " if guessed else ""
    told += f"the file says {_comment(column.said)}; " if column.said else ""
    return f"{_mapping(pairs)}  # {told}{column.minimum:g} to {column.maximum:g}"


def _seen_from(path: Path, folder: Path | None) -> str:
    if folder is None or folder.resolve() == path.parent.resolve():
        return path.name
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive
        return path.resolve().as_posix()


def _cases(finding: FileFinding, file: str) -> list[str]:
    if not finding.cases:
        return [f"  {_text(bare_stem(finding.path))}: {_mapping({'role': 'estimation', 'file': file})}"]
    lines = []
    for case in finding.cases:
        options = dict(case.options)
        if "time" in options:
            options["time"] = {"column": options["time"], "unit": case.finding.time.unit}
        pairs = {"role": case.role, "file": file, **options}
        told = "role guessed; " if case.role_guessed else ""
        lines.append(f"  {_text(case.name)}: {_mapping(pairs)}  # {told}{case.finding.samples} samples")
    return lines


def _shared(finding: FileFinding, file: str, split: Sequence[float]) -> list[str]:
    """Cases by shares: parts of one record by their rows, or whole records."""
    from sysid.ingest.split import spans_of

    if finding.cases:
        roles = [role.value for role, start, stop in spans_of(split, len(finding.cases)) for _ in range(start, stop)]
        cases = [replace(case, role=role, role_guessed=False) for case, role in zip(finding.cases, roles, strict=True)]
        return _cases(replace(finding, cases=tuple(cases)), file)
    spans = [(role.value, start + 1, stop) for role, start, stop in spans_of(split, finding.samples)]
    return [
        f"  {role}: {_mapping({'role': role, 'file': file, 'rows': [first, last]})}  # {last - first + 1} samples"
        for role, first, last in spans
    ]


def _files(finding: FileFinding) -> list[str]:
    time = finding.time
    own = any("time" in case.options for case in finding.cases)
    if time.step is not None:
        shown = f"{{step: {time.step!r}}}"
    else:
        pairs = {"column": time.column, "unit": time.unit, "format": time.format, "zone": time.zone}
        shown = _mapping({key: value for key, value in pairs.items() if value is not None})
    told = finding.time_told
    told = told if not told or "guess" in told else f"guessed: {told}"
    lines = [] if own else [f"    time: {shown}" + (f"  # {_comment(told)}" if told else "")]
    options = finding.files.model_dump(
        exclude_unset=True, exclude_none=True, exclude={"time", "columns", "units", "references"}
    )
    lines += [
        f"    {key}: {_value(value)}" + ("  # guessed" if key in finding.guessed else "")
        for key, value in options.items()
    ]
    guessed = [column for column in finding.channels if column.unit_guessed]
    lines += [f"    units: {_mapping({column.name: column.unit for column in guessed})}"] if guessed else []
    unsaid = [column for column in finding.channels if column.reference_guessed]
    lines += [f"    references: {_mapping({c.name: c.reference.value for c in unsaid})}"] if unsaid else []
    return ["  files:", *lines] if lines else ["  files: {}"]


def _grid(finding: FileFinding) -> list[str]:
    pairs: dict[str, object] = {}
    if finding.needed.jitter is not None:
        pairs["method"] = "linear"
    if finding.tolerance is not None:
        pairs["tolerance"] = finding.tolerance
    if finding.longest_step is not None:
        pairs["longest_step"] = finding.longest_step
    if finding.distinct < GridOptions().fewest_samples:
        pairs["fewest_samples"] = max(finding.distinct, 2)
    return [f"  grid: {_mapping(pairs)}"] if pairs else []


def _repairs(finding: FileFinding) -> list[str]:
    needed = finding.needed.model_dump(exclude_none=True)
    if not needed:
        return []
    comments = [f"  # found: {_comment(problem)}" for problem in finding.problems]
    return [*comments, f"  repairs: {_mapping(needed)}"]


def _mapping(pairs: Mapping[str, object]) -> str:
    return "{" + ", ".join(f"{_text(key)}: {_value(value)}" for key, value in pairs.items()) + "}"


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return _mapping(value)
    if value is None:
        return "null"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    return _text(value) if isinstance(value, str) else repr(value)


def _text(text: str) -> str:
    """Text as YAML reads it back, quoted only where it must be."""
    if _PLAIN.fullmatch(text) and text.lower() not in _WORDS:
        return text
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'


def _comment(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)
