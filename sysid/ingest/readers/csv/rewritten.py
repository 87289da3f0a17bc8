"""Text files that are tables once their lines are written otherwise; what writes them so is imported with the first."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from sysid.ingest.readers.sheets import SheetText
from sysid.ingest.readers.text_source import TextFile

_NAMED = re.compile(r"(?<!\w)(?:[^\W\d]|@)\w{0,39}\s?[:=]\s{0,3}[-+.\d]")
_BARE = re.compile(r"\s*(?:[-+]?\.?\d[\d.]*(?:[eE][-+]?\d+)?[\s]*){2,}")
_LAST, _HEADS = 5, 4


def in_a_table(file: TextFile) -> TextFile | SheetText:
    """The same file; one whose lines name their values, or that has tables in tables, or one signal, as one table.

    Args:
        file: The file.

    Returns:
        It, or the lines of its table, with what should be told.

    Raises:
        ReaderError: If several signals stand one below the other, each over many lines.
    """
    head = file.head()[0]
    shown = [line[:1000] for line in head if line.strip()]
    found = None
    if any(line[0] in "\t;," for line in shown[1:_HEADS]):
        from sysid.ingest.readers.csv.nested import depth_of, innermost  # here, as below: most files are none of such

        nested = depth_of(head)
        found = None if nested is None else innermost(_lines(file), *nested)
    elif _is_one_signal(shown):
        from sysid.ingest.readers.csv.wrapped import count_in_head, unwrapped

        counted = count_in_head(head)
        found = None if counted is None else unwrapped(_lines(file), *counted, file.path)
    if found is None and any(map(_NAMED.search, shown[-_LAST:])):
        from sysid.ingest.readers.csv.named import as_table, names_its_values

        found = as_table(_lines(file)) if names_its_values(head) else None
    return file if found is None else SheetText(path=file.path, lines=found[0], notes=found[1], encoding=file.encoding)


def _is_one_signal(shown: Sequence[str]) -> bool:
    """Whether numbers alone stand in the last lines, and words with a number in the line above the first of these."""
    if len(shown) < _HEADS or not _BARE.fullmatch(shown[-2]):
        return False
    above = next((k for k, line in enumerate(shown) if _BARE.fullmatch(line)), 0) - 1
    return above >= 0 and any(map(str.isalpha, shown[above])) and any(map(str.isdigit, shown[above]))


def _lines(file: TextFile) -> Iterator[str]:
    return (text for block in file.blocks() for text in block.data.decode().removesuffix("\n").split("\n"))
