"""Every key of a stored result is documented: in the records, in the JSON schema, on the page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from sysid.reporting import results_json_schema
from sysid.reporting.schema_page import undocumented, with_tables
from tests.reporting.assembly.conftest import document

PAGE = Path(__file__).parents[2] / "docs" / "results.md"


def test_every_key_says_what_it_is() -> None:
    assert undocumented() == []


def test_the_page_has_the_keys_of_the_records() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert with_tables(text) == text, "run python -m sysid.reporting.schema_page docs/results.md"


def test_a_page_without_the_marks_is_refused() -> None:
    with pytest.raises(ValueError, match="lacks"):
        with_tables("# results.json")


def test_the_schema_takes_what_is_written(run_folder: Path) -> None:
    """Of fits and of an assembly; a key of a later release is no fault, one that is missing is."""
    schema = results_json_schema()
    fits: dict[str, Any] = json.loads((run_folder / "results.json").read_text(encoding="utf-8"))
    for stored in (fits, document()):
        jsonschema.validate(stored | {"later": 1}, schema)
        without = {key: value for key, value in stored.items() if key != "pipeline"}
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(without, schema)
