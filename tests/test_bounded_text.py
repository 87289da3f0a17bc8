"""Text files that describe something, within bounds."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.bounded_text import parse_json, read_bounded, read_json


@pytest.mark.parametrize(
    ("raw", "message"),
    [
        pytest.param(b"[" * 100 + b"]" * 100, "64 deep", id="lists in lists"),
        pytest.param(b'{"a":' * 100 + b"1" + b"}" * 100, "64 deep", id="objects in objects"),
        pytest.param(b"[],[]," * 3_500_000, "MB of lists", id="too many lists"),
        pytest.param(b"9" * 5000, "4300 digits", id="an integer of 5,000 digits"),
        pytest.param(b"\xff", "utf-8", id="bytes that are no text"),
        pytest.param(b"{", "Expecting", id="a cut file"),
    ],
)
def test_what_is_out_of_bounds_is_refused(raw: bytes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse_json(raw)


def test_brackets_in_a_text_count_for_nothing() -> None:
    text = '"' + "[" * 200 + '\\"' + "{" * 200 + '"'
    assert parse_json(f'{{"a": {text}}}'.encode()) == {"a": "[" * 200 + '"' + "{" * 200}


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(b"[1, 2]")
    assert read_json(path) == [1, 2]
    with pytest.raises(ValueError, match="larger than 0 MB"):
        read_bounded(path, most=5)
