"""Names as text of somebody else's: whatever a name holds, it stays a name."""

from __future__ import annotations

import csv
import io
import keyword
import os
import re
from collections.abc import Callable
from xml.dom import minidom

import html5lib
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from sysid import names
from sysid.export.templating import environment
from sysid.models import Mapping
from sysid.reporting.html import page_template
from sysid.workbench.runner.console import TextConsole

HOSTILE = (
    *("data.InputData", "P+", "V->C", "nb[0]", "Öltemp.", "a/b", "\"'`", "[({})]", "🚂🔧", "x" * 200, "../../x", "CON"),
    *("two\nlines", "\x1b[31mred\x1b]0;title\x07", "*/", "*\\", "??/", "/*", "//", "-->", "]]>", '=HYPERLINK("x")'),
    *("<img src=x onerror=alert(1)>", "{{ 7 * 7 }}", "{% raw %}", "%s%n", "$x^2$", "[red]x[/]", "[/]", "\\", "a\\"),
    *("|", "---", "# head", "1. one", "> said", "- item", "![x](y)", "[x](javascript:alert(1))", "[x]: y", "&lt;"),
    *(
        "int",
        "2nd",
        "_",
        "",
        " ",
        "\x00",
        "\x9b31m",
        "\u202egnp.exe",
        "\ud800",
        "\ufffe",
        "\u2028",
        "温度",
        "nul.txt",
        "~x~",
    ),
    *(".", "..", "a//b", "/", "*/ }; __attribute__((constructor)) static void e(void){} enum { ZZ = 0 /*"),
)
"""Names that somebody has tried, or will."""

EXAMPLES = int(os.environ.get("SYSID_EXAMPLES", "200"))
"""Names that each test draws beside those; a change of what makes names fit is worth some thousands."""

CHARACTERS = st.one_of(
    st.text(alphabet=st.sampled_from("*/\\?`'\"<>&|[](){}=+-@#!_~$%^;:,. \n\r\t\x1b\x00ab1"), max_size=30),
    st.text(alphabet=st.characters(), max_size=40),
    st.lists(st.sampled_from(HOSTILE), min_size=1, max_size=3).map("".join),
)


def hostile(test: Callable[[str], None]) -> Callable[[str], None]:
    """A test over many names, the known ones among them."""
    for name in HOSTILE:
        test = example(name)(test)
    return settings(max_examples=EXAMPLES)(given(name=CHARACTERS)(test))


def without_comments(text: str) -> str:
    """A C program as its compiler reads it: trigraphs, joined lines, and then no comments."""
    for last, character in zip("=/'()!<>-", "#\\^[]|{}~", strict=True):
        text = text.replace(f"??{last}", character)
    text = re.sub(r"\\[ \t]*\n", "", text)
    token = re.compile(r'"(?:\\.|[^"\\\n])*"|//[^\n]*|/\*.*?\*/', re.DOTALL)
    return token.sub(lambda found: found[0] if found[0].startswith('"') else " ", text)


def letters(text: str) -> str:
    """A text without what a target may leave out or write more of."""
    return re.sub(rf"[\s\\{names.UNKNOWN}]", "", text)


@hostile
def test_a_comment_of_c_stays_one(name: str) -> None:
    for frame in ("int a; /* {} */\nint b;", "int a; /* {}: {}\n * more */\nint b;", "int a; /*{}*/\nint b;"):
        assert without_comments(frame.format(*2 * [names.c_comment(name)])).split() == ["int", "a;", "int", "b;"]
    assert names.c_comment(name).count("/*") == 0


@hostile
def test_a_string_of_c_stays_one(name: str) -> None:
    literal = names.c_string(name)
    assert re.fullmatch(r'"(?:[ !#-\[\]-~]|\\[0-7]{3}|\\["\\?])*"', literal)
    assert "??" not in literal
    inner = re.sub(
        rb'\\([0-7]{3})|\\(["\\?])', lambda m: bytes([int(m[1], 8)]) if m[1] else m[2], literal[1:-1].encode()
    )
    assert inner == name.encode("utf-8", "replace")


@hostile
def test_an_identifier_is_one(name: str) -> None:
    found = names.c_identifier(name)
    assert re.fullmatch(r"[a-z][a-z0-9_]*", found)
    assert len(found) <= names.LONGEST_IDENTIFIER
    assert found not in names.C_WORDS


XML = environment().from_string("<a b={{ name | attribute }} c='1'/>")


@hostile
def test_an_attribute_of_xml_reads_back(name: str) -> None:
    element = minidom.parseString(XML.render(name=name)).documentElement  # noqa: S318 - what we have just written
    assert dict(element.attributes.items()) == {"b": names.visible(name), "c": "1"}


HTML = page_template("report.html.j2").environment.from_string('<p title="{{ name }}">{{ name | arrow }}</p>')
MARKDOWN = MarkdownIt("gfm-like", {"linkify": False, "html": True})


def shown(html: str) -> tuple[str, set[str]]:
    """The text that a browser shows of some HTML, and the elements in it."""
    root = html5lib.parse(html, namespaceHTMLElements=False)
    body = root.find("body")
    text = "".join(body.itertext())
    return text, {element.tag for element in body.iter() if isinstance(element.tag, str)} - {"body"}


def as_said(name: str) -> str:
    return " ".join(names.visible(name).replace("->", "→").split())


@hostile
def test_a_paragraph_of_markdown_says_what_it_was_given(name: str) -> None:
    text, elements = shown(MARKDOWN.render(names.markdown(name)))
    assert " ".join(text.split()) == as_said(name)
    assert elements <= {"p"}


@hostile
def test_a_cell_of_markdown_stays_one(name: str) -> None:
    cell = names.markdown(name)
    text, elements = shown(MARKDOWN.render(f"| a | b |\n| --- | --- |\n| {cell} | 2 |\n"))
    assert elements == {"table", "thead", "tbody", "tr", "th", "td"}
    assert " ".join(text.split()) == " ".join(f"a b {as_said(name)} 2".split())


@hostile
def test_code_in_markdown_stays_code(name: str) -> None:
    text, elements = shown(MARKDOWN.render(f"a {names.markdown_code(name)} b"))
    assert elements <= {"p", "code"}
    assert letters(text) == letters(f"a{names.visible(name)}b")


@hostile
def test_html_shows_what_it_was_given(name: str) -> None:
    text, elements = shown(HTML.render(name=names.visible(name)))
    assert elements == {"p"}
    assert text == names.visible(name).replace("->", "→")


@hostile
def test_a_cell_of_csv_is_no_formula_and_reads_back(name: str) -> None:
    cell = names.csv_cell(name)
    assert not re.match(r"\s*[=+\-@]", cell)
    assert names.from_csv_cell(cell) == name
    if "\x00" not in name and "\ud800" not in name:
        text = io.StringIO(newline="")
        csv.writer(text).writerow([cell, "2"])
        text.seek(0)
        assert next(csv.reader(text)) == [cell, "2"]


@hostile
def test_a_terminal_gets_no_command(name: str) -> None:
    target = TextConsole(file=io.StringIO(), width=2000, highlight=False, markup=False, emoji=False)
    target.print(name, soft_wrap=True)
    said = target.file.getvalue()  # type: ignore[attr-defined]
    # Some of what cannot be shown rich leaves out itself.
    assert letters(said) == letters(names.visible(name))
    assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f-\x9f]", said)


@hostile
def test_a_key_of_the_tracker_is_one(name: str) -> None:
    from mlflow.utils.validation import _validate_metric_name, _validate_param_name, _validate_tag_name

    found = names.tracking_key(name)
    for key in (found, f"free_run_mse/{found}"):
        _validate_metric_name(key)
        _validate_param_name(key)
        _validate_tag_name(key)
    assert "/" not in found


@hostile
def test_a_signal_of_python_control_is_one(name: str) -> None:
    import control

    found = names.distinct([name, f"{name}.", "y"], names.signal_name)
    system = control.TransferFunction(
        [[[1.0], [1.0]]], [[[1.0, 0.5], [1.0, 0.5]]], 1.0, inputs=list(found.values())[:2], outputs=["z"]
    )
    assert list(system.input_labels) == list(found.values())[:2]


@hostile
def test_a_file_is_one_everywhere(name: str) -> None:
    found = names.slug(name)
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", found)
    assert len(found) <= names.LONGEST_FILE
    assert found not in names.WINDOWS_DEVICES


@settings(max_examples=EXAMPLES)
@given(st.lists(CHARACTERS, min_size=1, max_size=5, unique=True))
@example(["a/b", "a b", "a_b", "A B"])
def test_different_names_stay_different(given_names: list[str]) -> None:
    for fitted in (names.c_identifier, names.slug, names.tracking_key, names.signal_name):
        found = names.distinct(given_names, fitted)
        assert list(found) == given_names
        assert len(set(found.values())) == len(given_names)


@settings(max_examples=EXAMPLES)
@given(st.lists(CHARACTERS.filter(bool), min_size=1, max_size=4, unique=True))
@example(["P+", "V->C"])
@example(['"a"', "b"])
@example(["a-", ">b"])
def test_a_mapping_reads_back_from_its_text(given_names: list[str]) -> None:
    *inputs, output = given_names
    mapping = Mapping(inputs=tuple(inputs), output=output)
    assert Mapping.parse(str(mapping)) == mapping


def test_what_needs_no_care_is_left_alone() -> None:
    plain = "BP 1, closed loop (4/4/20): 2.5 kPa² below free_run → [kPa]"
    assert names.visible(plain) == names.markdown(plain) == names.c_comment(plain) == plain
    assert names.csv_cell("BP [kPa]") == "BP [kPa]"
    assert names.tracking_key("VAL 1") == "VAL 1"
    assert names.tracking_key("VAL 1 (µ=0.3)/a") == "VAL 1 ___0.3__a"
    assert not keyword.iskeyword(names.c_identifier("level"))


@pytest.mark.parametrize(
    ("text", "sides"),
    [
        ("BP+AR -> BC", [["BP", "AR"], ["BC"]]),
        ("-> BC", [[], ["BC"]]),
        ('"P+" + "V->C" -> "a\\"b"', [["P+", "V->C"], ['a"b']]),
        ('5" pipe -> BC', [['5" pipe'], ["BC"]]),
        ("a -> b -> c", [["a"], ["b"], ["c"]]),
        ("a+ -> b", [["a", ""], ["b"]]),
        ("no arrow", [["no arrow"]]),
    ],
)
def test_sides_are_read(text: str, sides: list[list[str]]) -> None:
    assert names.read_sides(text) == sides
