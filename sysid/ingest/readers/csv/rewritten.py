"""Text files that are tables once their lines are written otherwise."""

from __future__ import annotations

from sysid.ingest.readers.csv.named import as_table, names_its_values
from sysid.ingest.readers.csv.nested import depth_of, innermost
from sysid.ingest.readers.csv.wrapped import count_in_head, unwrapped
from sysid.ingest.readers.sheets import SheetText
from sysid.ingest.readers.text_source import TextFile


def in_a_table(file: TextFile) -> TextFile | SheetText:
    """The same file; one whose lines name their values, or that has tables in tables, as one table.

    Args:
        file: The file.

    Returns:
        It, or the lines of its table, with what should be told.
    """
    head = file.head()[0]
    nested = depth_of(head)
    counted = count_in_head(head) if nested is None else None
    if nested is None and counted is None and not names_its_values(head):
        return file
    texts = (text for block in file.blocks() for text in block.data.decode().removesuffix("\n").split("\n"))
    if counted is not None:
        found = unwrapped(texts, *counted, file.path)
        if found is None:
            return file
        lines, told = found
    else:
        lines, told = as_table(texts) if nested is None else innermost(texts, *nested)
    return SheetText(path=file.path, lines=lines, notes=told, encoding=file.encoding)
