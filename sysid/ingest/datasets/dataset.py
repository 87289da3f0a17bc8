"""A data set by name or path: find its description, make or read its traces."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sysid.content import content_folders, nearest_name, unique_folders
from sysid.errors import ConfigError, SysidError, near_words
from sysid.ingest.assembling.assemble import Wanted, assemble, round_channels
from sysid.ingest.assembling.masks import check_masks, masked
from sysid.ingest.datasets.cache import TraceCache, content_key, default_cache_folder
from sysid.ingest.datasets.description import DatasetDescription, read_description
from sysid.ingest.datasets.generators import Generator, find_generator
from sysid.ingest.datasets.places import checked_file, files_folder
from sysid.ingest.readers import READERS, choose_reader
from sysid.ingest.reading import read_table
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.table import beside
from sysid.traces import Trace, TraceSet

DESCRIPTION_FILE = "dataset.yaml"
Progress = Callable[[str, int, int], None]
"""Called as ``progress(case, index, count)`` before case ``index`` (from 0) of ``count`` is made."""


def _check_text(path: Path) -> None:
    """Refuse a file that is no description but something else, such as a record of a kind that no reader knows."""
    with path.open("rb") as file:
        is_text = b"\0" not in file.read(4096)
    if is_text and path.suffix.lower() in {".yaml", ".yml"}:
        return
    choose_reader(path, READERS)  # says which kinds there are, or
    raise ConfigError(
        "the file is no description of a data set",
        where=path,
        expected="a YAML file, or a name or a file of traces",
        got=f"a name that ends in {path.suffix}" if is_text and path.suffix else "a file that is no text",
        remedy="sysid ingest FILE looks into a file of traces",
    )


def find_dataset(name_or_path: str | Path, *, search: Sequence[Path] | None = None) -> Path:
    """The description of a data set.

    Args:
        name_or_path: A name, a folder that holds a ``dataset.yaml``, or a YAML file.
        search: Folders to look in for names; ``None`` is the workspace's ``datasets``, then the
            built-in ones.

    Returns:
        Path of the YAML file.

    Raises:
        ConfigError: If there is no such data set; names that are known are listed.
    """
    path = Path(name_or_path)
    for candidate in (path / DESCRIPTION_FILE, path):
        if candidate.is_file():
            _check_text(candidate)
            return candidate
    folders = content_folders("datasets") if search is None else unique_folders(search)
    for folder in folders:
        candidate = folder / path / DESCRIPTION_FILE
        if candidate.is_file():
            return candidate
    if path.is_dir():
        raise ConfigError(
            f"a folder without a {DESCRIPTION_FILE} is no data set",
            where=path,
            expected=f"a data set's name, its folder, or its {DESCRIPTION_FILE}",
            got=", ".join(sorted(file.name for file in path.iterdir())[:8]) or "an empty folder",
            remedy="name one of the files in it: sysid ingest FILE proposes a description",
        )
    groups = [sorted(file.parent.name for file in folder.glob(f"*/{DESCRIPTION_FILE}")) for folder in folders]
    known = list(dict.fromkeys(name for names in groups for name in names))  # one's own first
    near = nearest_name(str(name_or_path), groups)
    raise ConfigError(
        f"there is no data set {name_or_path}",
        where=", ".join(str(folder) for folder in folders) or "no folder of data sets was found",
        expected=f"one of {', '.join(known) or '(none)'}, or the path of a {DESCRIPTION_FILE}",
        got=name_or_path,
        remedy=f"did you mean {near}?" if near else "correct the name or the path",
    )


def load_dataset(
    name_or_path: str | Path,
    *,
    cases: Sequence[str] | None = None,
    cache: bool | Path = True,
    search: Sequence[Path] | None = None,
    progress: Progress | None = None,
) -> TraceSet:
    """Load a data set: read its files, or have its generator make the traces.

    Generated traces are kept under the hash of everything that they are made from (recipe, options,
    channels, versions), and are made again when any of it changes or the kept file is damaged.

    Args:
        name_or_path: A name, a folder that holds a ``dataset.yaml``, or a YAML file.
        cases: Only these; ``None`` is all.
        cache: Whether generated traces are kept, or the folder to keep them in; ``True`` is
            ``$SYSID_CACHE`` or ``~/.cache/sysid``.
        search: Folders to look in for names, instead of the usual ones.
        progress: Called before each case.

    Returns:
        The traces, with the roles that the description gives them.

    Raises:
        ConfigError: If the description, or a case asked for, cannot be used.
        ReaderError: If a file cannot be read.
        ChannelError: If a channel is missing.
        UnitError: If a unit is missing, unknown or of another quantity.
        TraceError: If something is wrong with the samples and its repair was not asked for.
    """
    path = find_dataset(name_or_path, search=search)
    return load_described(read_description(path), path, cases=cases, cache=cache, progress=progress)


def load_described(
    description: DatasetDescription,
    path: Path,
    *,
    cases: Sequence[str] | None = None,
    cache: bool | Path = True,
    progress: Progress | None = None,
) -> TraceSet:
    """Load the traces of a description, as :func:`load_dataset` does.

    Args:
        description: The data set.
        path: Its file: named in errors, and what its files are seen from.
        cases: Only these; ``None`` is all.
        cache: Whether generated traces are kept, or the folder to keep them in.
        progress: Called before each case.

    Returns:
        The traces, with the roles that the description gives them.

    Raises:
        UserError: As :func:`load_dataset`.
    """
    chosen = _choose(description, cases, path)
    store = None
    if cache is not False:
        store = TraceCache(folder=default_cache_folder() if cache is True else Path(cache))
    source = description.source
    generator = None if source.generator is None else find_generator(source.generator, where=path)
    traces = []
    for index, case in enumerate(chosen):
        if progress is not None:
            progress(case, index, len(chosen))
        if generator is not None and description.cases[case].recipe is not None:
            made = _generated(description, case, generator, store)
            traces.append(masked(made, source.repairs, f"{path}, source"))
        else:
            traces.append(_read(description, case, path))
    check_masks(source.repairs, traces, cases=[*description.cases], where=f"{path}, source", whole=cases is None)
    return TraceSet(
        name=description.name,
        traces=tuple(traces),
        roles={case: description.cases[case].role for case in chosen},
        source=_source(description),
    )


def _choose(description: DatasetDescription, cases: Sequence[str] | None, path: Path) -> list[str]:
    known = list(description.cases)
    if cases is None:
        return known
    strangers = [case for case in cases if case not in known]
    if strangers or not cases:
        near = [one for case in strangers for one in near_words(case, known)]
        raise ConfigError(
            f"no case {', '.join(strangers)} in the data set" if strangers else "no case is asked for",
            where=path,
            expected=f"one of {', '.join(known)}",
            got=", ".join(strangers) or "none",
            remedy=f"did you mean {', '.join(near)}?" if near else "correct the name of the case",
        )
    return [case for case in known if case in cases]


@dataclass(frozen=True, kw_only=True)
class Unmade:
    """What a generator has yet to make before a data set can be loaded.

    Args:
        cases: How many traces.
        generator: Its name.
        seconds: How long that takes by what it has made on this machine; ``None`` if it has made nothing yet.
    """

    cases: int
    generator: str
    seconds: float | None


def unmade(name_or_path: str | Path, *, search: Sequence[Path] | None = None) -> Unmade | None:
    """Whether loading a data set makes traces first; nothing is made or read.

    Args:
        name_or_path: As for :func:`load_dataset`.
        search: Folders to look in for names, instead of the usual ones.

    Returns:
        What is to be made; ``None`` for a data set of files, or one whose traces are all kept.

    Raises:
        ConfigError: If there is no such data set, or its description cannot be used.
    """
    path = find_dataset(name_or_path, search=search)
    description = read_description(path)
    if description.source.generator is None:
        return None
    generator, store = (
        find_generator(description.source.generator, where=path),
        TraceCache(folder=default_cache_folder()),
    )
    made = (case for case, said in description.cases.items() if said.recipe is not None)
    cases = sum(not store.has(_key(description, case, generator)) for case in made)
    mean = store.mean_time(generator.name)
    seconds = None if mean is None else cases * mean
    return Unmade(cases=cases, generator=generator.name, seconds=seconds) if cases else None


def _key(description: DatasetDescription, case: str, generator: Generator) -> str:
    """What a generated trace is kept under."""
    return content_key(
        {
            "generator": [generator.name, generator.version],
            "case": case,
            "recipe": description.cases[case].recipe or {},
            "options": description.source.options,
            "channels": [channel.model_dump(mode="json") for channel in description.channels],
            "sample_time": description.sample_time,
        }
    )


def _generated(description: DatasetDescription, case: str, generator: Generator, store: TraceCache | None) -> Trace:
    recipe = description.cases[case].recipe or {}
    key = _key(description, case, generator)
    kept = store.load(key) if store is not None else None
    if kept is not None:
        return kept
    began = time.perf_counter()
    trace = generator.make(
        case=case,
        recipe=recipe,
        options=description.source.options,
        channels=description.trace_channels,
        sample_time=description.sample_time,
    )
    values, notes = round_channels(trace.values, trace.channels, description.decimals)
    finished = Trace(
        name=trace.name,
        sample_time=trace.sample_time,
        channels=trace.channels,
        values=values,
        start_time=trace.start_time,
        usable=trace.usable,
        provenance=(f"made by the generator {generator.name}", *trace.provenance, *notes),
    )
    if store is not None:
        store.store(key, finished)
        store.note_time(generator.name, time.perf_counter() - began)
    return finished


def _read(description: DatasetDescription, case: str, path: Path) -> Trace:
    folder = files_folder(description, path)
    source, wish = description.source, description.cases[case]
    files = wish.read_as(source.files or FileOptions())
    wanted = Wanted(
        name=case,
        channels=description.trace_channels,
        sample_time=description.sample_time,
        decimals=description.decimals,
        start=wish.start,
        stop=wish.stop,
    )
    try:
        paths = [checked_file(source, name, folder) for name in wish.files]
        return assemble(
            beside([read_table(path, files=files, repairs=source.repairs) for path in paths]),
            wanted,
            files=files,
            grid=source.grid,
            repairs=source.repairs,
        )
    except SysidError as error:
        error.add_note(f"reading case {case} of {path}")
        raise


def _source(description: DatasetDescription) -> str:
    sentences = [description.provenance.strip(), *(f"Inferred: {sentence}" for sentence in description.inferred)]
    return "\n".join(sentence for sentence in sentences if sentence)
