"""Names of channels, cases and fits as text of somebody else's: C, XML, Markdown, tables, terminals, trackers, files.

A name is data. It comes from a column's header or from a YAML, may hold anything, and keeps what it holds wherever it
is data. Where it becomes part of another language's text it goes through here, once, at the writer's end: it can then
neither end what it stands in nor begin anything of its own.
"""

from sysid.names.fitting import distinct as distinct
from sysid.names.fitting import shortened as shortened
from sysid.names.fitting import told_apart as told_apart
from sysid.names.identifiers import C_WORDS as C_WORDS
from sysid.names.identifiers import LONGEST_FILE as LONGEST_FILE
from sysid.names.identifiers import LONGEST_IDENTIFIER as LONGEST_IDENTIFIER
from sysid.names.identifiers import LONGEST_KEY as LONGEST_KEY
from sysid.names.identifiers import WINDOWS_DEVICES as WINDOWS_DEVICES
from sysid.names.identifiers import c_identifier as c_identifier
from sysid.names.identifiers import signal_name as signal_name
from sysid.names.identifiers import slug as slug
from sysid.names.identifiers import task_slug as task_slug
from sysid.names.identifiers import tracking_key as tracking_key
from sysid.names.identifiers import xml_name as xml_name
from sysid.names.markup import c_comment as c_comment
from sysid.names.markup import c_string as c_string
from sysid.names.markup import csv_cell as csv_cell
from sysid.names.markup import from_csv_cell as from_csv_cell
from sysid.names.markup import markdown as markdown
from sysid.names.markup import markdown_block as markdown_block
from sysid.names.markup import markdown_code as markdown_code
from sysid.names.markup import markdown_inline as markdown_inline
from sysid.names.markup import tracking_text as tracking_text
from sysid.names.markup import xml_attribute as xml_attribute
from sysid.names.shown import DIRECTION as DIRECTION
from sysid.names.shown import UNKNOWN as UNKNOWN
from sysid.names.shown import visible as visible
from sysid.names.sides import output_side as output_side
from sysid.names.sides import read_sides as read_sides
from sysid.names.sides import written_side as written_side
