"""The tables of ``docs/results.md``: every key of every stored result, from the records that read and write it.

    python -m sysid.reporting.schema_page docs/results.md

writes them between the two marks of that page.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping as Dict
from pathlib import Path
from typing import Any, Final

from sysid.atomic import replacing
from sysid.reporting.kinds import results_json_schema
from sysid.reporting.sweep_record import SweepRecord

BEGIN: Final = "<!-- keys: made by python -m sysid.reporting.schema_page docs/results.md -->"
END: Final = "<!-- end of the keys -->"

FIRST: Final = ("Results", "SweepRecord", "AssemblyResults", "JudgementResults", "ResponseResults")
"""The records that a file begins with; each is followed by those that it names."""

TYPES: Final = {
    "string": "text",
    "integer": "integer",
    "number": "number",
    "boolean": "true or false",
    "null": "null",
    "object": "object",
}


def definitions() -> dict[str, Any]:
    """The JSON schema of every record by its name."""
    sweep = SweepRecord.model_json_schema()
    found: dict[str, Any] = results_json_schema()["$defs"] | sweep.pop("$defs")
    return found | {"SweepRecord": sweep}


def key_tables() -> str:
    """The tables.

    Returns:
        Markdown.
    """
    records = definitions()
    order: list[str] = []
    for first in FIRST:
        _collect(first, records, order)
    return "\n\n".join(_table(name, records) for name in order) + "\n"


def with_tables(page: str) -> str:
    """A page with the tables between its marks.

    Args:
        page: Its text.

    Returns:
        The text.

    Raises:
        ValueError: If it lacks the marks.
    """
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"the page lacks {BEGIN} or {END}, on lines of their own")
    return f"{before}{BEGIN}\n\n{key_tables()}\n{END}{after}"


def undocumented() -> list[str]:
    """Keys that neither say what they are nor hold a record that does, as ``Record.key``."""
    records = definitions()
    return [
        f"{name}.{key}"
        for name, record in records.items()
        for key, field in record.get("properties", {}).items()
        if not _meaning(field, records)
    ]


def _collect(name: str, records: Dict[str, Any], order: list[str]) -> None:
    if name in order or "properties" not in records[name]:
        return
    order.append(name)
    for field in records[name]["properties"].values():
        for other in _references(field):
            _collect(other, records, order)


def _references(field: Any) -> list[str]:
    if isinstance(field, dict):
        own = [field["$ref"].rpartition("/")[2]] if "$ref" in field else []
        return own + [name for value in field.values() for name in _references(value)]
    return [name for value in field for name in _references(value)] if isinstance(field, list) else []


def _table(name: str, records: Dict[str, Any]) -> str:
    record = records[name]
    about = record.get("description", "").partition("\n")[0]
    rows = [
        f"| `{key}` | {_type(field, records)} | {_meaning(field, records)} |"
        for key, field in record["properties"].items()
    ]
    return "\n".join([f"### {name}", "", about, "", "| key | type | meaning |", "|---|---|---|", *rows])


def _type(field: Dict[str, Any], records: Dict[str, Any]) -> str:
    if "$ref" in field:
        name = field["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})" if "properties" in records[name] else _choices(records[name]["enum"])
    if "enum" in field or "const" in field:
        return _choices(field.get("enum", [field.get("const")]))
    if "anyOf" in field:
        return " or ".join(dict.fromkeys(_type(one, records) for one in field["anyOf"]))
    kind = field.get("type")
    if isinstance(kind, list):
        return " or ".join(TYPES[one] for one in kind)
    if kind == "array":
        return f"list of {_type(field['items'], records)}" if "items" in field else "list"
    if kind == "object" and isinstance(field.get("additionalProperties"), dict):
        return f"by name: {_type(field['additionalProperties'], records)}"
    return TYPES.get(str(kind), "any")


def _choices(values: list[Any]) -> str:
    return ", ".join(f"`{value}`" for value in values)


def _meaning(field: Dict[str, Any], records: Dict[str, Any]) -> str:
    if field.get("description"):
        return " ".join(str(field["description"]).split())
    told = [records[name].get("description", "") for name in _references(field)]
    return next((text.partition("\n")[0] for text in told if text), "")


def main(arguments: list[str]) -> None:
    """Write the tables into a page, or print them."""
    for page in map(Path, arguments):
        text = with_tables(page.read_text(encoding="utf-8"))
        with replacing(page) as draft:
            draft.write_text(re.sub(r"[ \t]+\n", "\n", text), encoding="utf-8", newline="\n")
    if not arguments:
        sys.stdout.write(key_tables())


if __name__ == "__main__":
    main(sys.argv[1:])
