"""``extends``: a pipeline that builds on another one, and says only what is different.

A key that it gives stands instead of the base's, whole, but for two: entries of ``fixed`` are joined by the channel
that they write (one that the base writes too stands in its place, others come after), and ``limits`` by output. What
is ``null`` takes the base's away; a ``name`` is each one's own. Files are joined before anything is checked: a run
knows one pipeline, and what it stores depends on what is declared, whichever file that stands in. Paths in it, such as
that of ``warm_start``, are seen from the folder of the file that is run.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from sysid.atomic import write_bytes
from sysid.errors import ConfigError, did_you_mean
from sysid.field_checks import Loc, Origins
from sysid.models import Mapping
from sysid.workbench.assembly.fixed_words import fixed_schema, one_by_one
from sysid.workbench.kinds import DEFAULT
from sysid.workbench.old_words import ASSEMBLY, with_new_words
from sysid.yaml_files import read_yaml, yaml_text

JOINED_FILE = "pipeline-joined.yaml"
"""What a run folder keeps beside ``pipeline.yaml`` where that extends another."""
NULL_MEANS = {"export"}
"""Keys whose null says something by itself: nothing is exported."""


@dataclass(frozen=True, kw_only=True)
class Joined:
    """A pipeline with what it extends.

    Args:
        data: All of it as one, plain data.
        origins: Which file each part stands in.
        files: The files, each before the one that it extends.
        text: The first of them, as it is written.
    """

    data: dict[str, Any]
    origins: Origins
    files: tuple[Path, ...]
    text: bytes

    def keep(self, folder: Path) -> None:
        """Write down what is run.

        Args:
            folder: The run folder: gets the pipeline as it is written and, where it extends another, the whole.
        """
        write_bytes(folder / "pipeline.yaml", self.text)
        if len(self.files) > 1:
            first, *bases = (file.name for file in self.files)
            head = f"# {first} joined with what it extends: {', '.join(bases)}\n"
            write_bytes(folder / JOINED_FILE, (head + yaml_text(self.data)).encode())
        else:
            # An earlier run of this name may have extended another.
            (folder / JOINED_FILE).unlink(missing_ok=True)


def read_joined(path: Path) -> Joined:
    """Read a pipeline and what it extends.

    Args:
        path: Its YAML file.

    Returns:
        The two, or more, as one; not yet checked.

    Raises:
        ConfigError: If a file cannot be read, is not there, is of another kind or extends itself in the end.
    """
    return _read(path, ())


def _read(path: Path, before: tuple[Path, ...]) -> Joined:
    """The same, for a file to which others have led."""
    data, own = with_new_words(read_yaml(path), ASSEMBLY), Origins(file=path)
    text = path.read_bytes()
    if isinstance(data.get("fixed"), list):
        fixed = one_by_one(data["fixed"], own)
        data = {**data, "fixed": [one for one, _ in fixed]}
        own = Origins(file=path, parts={("fixed", at): (own, loc) for at, (_, loc) in enumerate(fixed)})
    if data.get("extends") is None:
        return Joined(data=data, origins=own, files=(path,), text=text)
    way = (*before, path)
    file = _base(data["extends"], path, own)
    if file.resolve() in (one.resolve() for one in way):
        raise ConfigError(
            "the pipelines extend each other in a circle",
            where=own.place(("extends",)),
            expected="a pipeline that extends none of those that lead to it",
            got=" -> ".join(one.name for one in (*way, file)),
            remedy="leave out extends in one of them",
        )
    base = _read(file, way)
    if base.data.get("kind") != data.get("kind"):
        raise ConfigError(
            "a pipeline extends one of another kind",
            where=own.place(("extends",)),
            expected=f"a pipeline of kind {data.get('kind')}",
            got=f"{file}, of kind {base.data.get('kind', DEFAULT)}",
            remedy="name a pipeline of the same kind",
        )
    whole, parts = _join(base, data, own)
    return Joined(data=whole, origins=Origins(file=path, parts=parts), files=(path, *base.files), text=text)


def _base(given: object, path: Path, own: Origins) -> Path:
    """The file that is extended."""
    if isinstance(given, str) and (file := path.parent / given).is_file():
        return file
    there = [one.name for one in path.parent.glob("*.yaml") if one != path]
    raise ConfigError(
        "the pipeline to extend is not there",
        where=own.place(("extends",)),
        expected=f"a YAML file, seen from {path.parent}",
        got=given,
        remedy=did_you_mean(given, there, "correct the path"),
    )


class _Entry(NamedTuple):
    """One of ``fixed`` or ``limits``: itself, and which one it is in whose file."""

    value: Any
    origins: Origins
    loc: Loc


def _join(base: Joined, data: dict[str, Any], own: Origins) -> tuple[dict[str, Any], dict[Loc, tuple[Origins, Loc]]]:
    """The whole, and which parts of it stand in other files than the extending one."""
    whole: dict[str, Any] = {}
    parts: dict[Loc, tuple[Origins, Loc]] = {}
    for key in dict.fromkeys((*base.data, *data)):
        theirs, ours = base.data.get(key), data.get(key)
        entries: dict[Any, _Entry] = {}
        if key == "extends" or (key == "name" and key not in data):
            continue
        if key not in data:
            whole[key], parts[key,] = theirs, (base.origins, (key,))
        elif ours is None and key in base.data and key not in NULL_MEANS:
            continue
        elif key == "fixed" and isinstance(theirs, list) and isinstance(ours, list):
            entries = dict(enumerate(_join_known(_listed(theirs, base.origins), _listed(ours, own))))
            whole[key] = [entry.value for entry in entries.values()]
        elif key == "limits" and isinstance(theirs, dict) and isinstance(ours, dict):
            entries = _join_limits(theirs, ours, base.origins, own)
            whole[key] = {name: entry.value for name, entry in entries.items()}
        else:
            whole[key] = ours
        parts |= {(key, at): (entry.origins, entry.loc) for at, entry in entries.items()}
    return whole, parts


def _listed(known: list[Any], origins: Origins) -> list[_Entry]:
    return [_Entry(one, origins, ("fixed", at)) for at, one in enumerate(known)]


def _join_known(theirs: list[_Entry], ours: list[_Entry]) -> list[_Entry]:
    """Ours stand in the place of theirs that write the same channel, the first of them; the rest come after."""
    outputs = {_output(one.value) for one in ours} - {None}
    joined, left = [], list(ours)
    for entry in theirs:
        output = _output(entry.value)
        if output in outputs:
            joined += [one for one in left if _output(one.value) == output]
            left = [one for one in left if _output(one.value) != output]
        else:
            joined.append(entry)
    return [*joined, *left]


def _output(known: Any) -> str | None:
    """The channel that an entry writes; none where it does not say so, which the check of the whole tells."""
    try:
        return Mapping.parse(str(known["mapping"])).output
    except (ConfigError, KeyError, TypeError):
        return None


def _join_limits(theirs: dict[str, Any], ours: dict[str, Any], base: Origins, own: Origins) -> dict[str, _Entry]:
    """Each output's limit of ours, or of theirs where there is none of ours; null takes theirs away."""
    joined = {name: _Entry(one, base, ("limits", name)) for name, one in theirs.items()}
    for name, one in ours.items():
        if one is None and name in theirs:
            del joined[name]
        else:
            joined[name] = _Entry(one, own, ("limits", name))
    return joined


def extending_schema(schema: dict[str, Any]) -> None:
    """Let editors know that ``fixed`` may be equations, and what one with ``extends`` may leave out or take away.

    Args:
        schema: The JSON schema of a pipeline that stands alone; changed in place.
    """
    fixed_schema(schema)
    required, declared, own = schema["required"], schema["properties"], ("kind", "name", "extends")
    limits = {**declared["limits"], "additionalProperties": _or_null(declared["limits"]["additionalProperties"])}
    opened = {**declared, "limits": limits}
    schema["required"] = [name for name in required if name in own]
    schema["properties"] = {name: one if name in own else _or_null(one) for name, one in opened.items()}
    schema["if"] = {"required": ["extends"]}
    schema["else"] = {"required": required, "properties": declared}


def _or_null(schema: dict[str, Any]) -> dict[str, Any]:
    return {"anyOf": [schema, {"type": "null"}]}
