"""Names of channels, cases and fits as text of somebody else's: C, XML, Markdown, tables, terminals, trackers, files.

A name is data. It comes from a column's header or from a YAML, may hold anything, and keeps what it holds wherever it
is data. Where it becomes part of another language's text it goes through here, once, at the writer's end: it can then
neither end what it stands in nor begin anything of its own.
"""

from sysid.names.fitting import distinct, shortened, told_apart
from sysid.names.identifiers import (
    C_WORDS,
    LONGEST_FILE,
    LONGEST_IDENTIFIER,
    LONGEST_KEY,
    WINDOWS_DEVICES,
    c_identifier,
    signal_name,
    slug,
    task_slug,
    tracking_key,
    xml_name,
)
from sysid.names.markup import (
    c_comment,
    c_string,
    csv_cell,
    from_csv_cell,
    markdown,
    markdown_block,
    markdown_cell,
    markdown_code,
    markdown_inline,
    tracking_text,
    xml_attribute,
)
from sysid.names.shown import DIRECTION, UNKNOWN, visible
from sysid.names.sides import output_side, read_sides, written_side

__all__ = [
    "C_WORDS",
    "DIRECTION",
    "LONGEST_FILE",
    "LONGEST_IDENTIFIER",
    "LONGEST_KEY",
    "UNKNOWN",
    "WINDOWS_DEVICES",
    "c_comment",
    "c_identifier",
    "c_string",
    "csv_cell",
    "distinct",
    "from_csv_cell",
    "markdown",
    "markdown_block",
    "markdown_cell",
    "markdown_code",
    "markdown_inline",
    "output_side",
    "read_sides",
    "shortened",
    "signal_name",
    "slug",
    "task_slug",
    "told_apart",
    "tracking_key",
    "tracking_text",
    "visible",
    "written_side",
    "xml_attribute",
    "xml_name",
]
