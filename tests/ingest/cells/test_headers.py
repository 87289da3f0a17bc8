"""Column headers: name, unit, reference."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.ingest.cells.headers import Header, is_unit, parse_header, split_reference
from sysid.traces import Channel
from sysid.units import Reference

NAMES = st.text(min_size=1, max_size=20).filter(lambda text: text == text.strip())


@pytest.mark.parametrize(
    ("text", "name", "unit", "reference"),
    [
        ("BP [kPa]", "BP", "kPa", None),
        ("BP[kPa]", "BP", "kPa", None),
        ("  BP  [ kPa ] ", "BP", "kPa", None),
        ("BP [psi gauge]", "BP", "psi", Reference.GAUGE),
        ("BP [psi absolute]", "BP", "psi", Reference.ABSOLUTE),
        ("BP [kPa abs]", "BP", "kPa", Reference.ABSOLUTE),
        ("BP [bar(g)]", "BP", "bar", Reference.GAUGE),
        ("BP (bar (a))", "BP", "bar", Reference.ABSOLUTE),
        ("BP [barg]", "BP", "bar", Reference.GAUGE),
        ("BP [psia]", "BP", "psi", Reference.ABSOLUTE),
        ("Tijd (s)", "Tijd", "s", None),
        ("T [°C]", "T", "degC", None),
        ("valve [%]", "valve", "percent", None),
        ("ratio [-]", "ratio", "1", None),
        ("ratio [1]", "ratio", "1", None),
        ("p[1]", "p[1]", None, None),
        ("p[12] [bar]", "p[12]", "bar", None),
        ("Test (1)", "Test (1)", None, None),
        ("BP (wagon 3)", "BP (wagon 3)", None, None),
        ("[kPa]", "[kPa]", None, None),
        ("BP []", "BP []", None, None),
        ("mass [kg]", "mass", "kg", None),
        ("unknown [furlongs per]", "unknown", "furlongs per", None),
        ("", "", None, None),
    ],
)
def test_a_header_is_taken_apart(text: str, name: str, unit: str | None, reference: Reference | None) -> None:
    header = parse_header(text)
    assert (header.name, header.unit, header.reference) == (name, unit, reference)


@given(st.text(max_size=60))
def test_any_text_is_a_header(text: str) -> None:
    header = parse_header(text)
    assert header.name in text
    assert header.unit != ""


@given(NAMES, st.sampled_from(["kPa", "1", "m/s", "degC"]), st.sampled_from(list(Reference)))
def test_an_axis_label_reads_back(name: str, unit: str, reference: Reference) -> None:
    header = parse_header(Channel(name=name, unit=unit, reference=reference).label)
    assert (header.name, header.unit, header.reference or Reference.NONE) == (name, unit, reference)


@pytest.mark.parametrize("text", ["9**9**9**9", "kPa^9^9^9", "m" * 200, "", "  ", "99999999"])
def test_what_would_keep_the_unit_parser_busy_is_no_unit(text: str) -> None:
    assert not is_unit(text)


@pytest.mark.parametrize("text", ["kg", "gauge", "ag", "deg"])
def test_a_g_at_the_end_is_not_gauge(text: str) -> None:
    assert split_reference(text) == (text, None)


@pytest.mark.parametrize("text", ["y[k]", "u[k-1]", "x1(k + 2)", "y(n)", "u(t)", "y2[t]"])
def test_a_sample_or_a_signal_has_no_unit(text: str) -> None:
    """They were in units of Boltzmann's constant, and in tonnes."""
    assert parse_header(text) == Header(name=text)


@pytest.mark.parametrize(
    ("text", "unit"), [("T[K]", "K"), ("y [k]", "k"), ("mass(t)", "t"), ("m [t]", "t"), ("v(km)", "km")]
)
def test_a_unit_that_looks_like_one_is_one(text: str, unit: str) -> None:
    assert parse_header(text).unit == unit
