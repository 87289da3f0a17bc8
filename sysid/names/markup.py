"""Names inside another language's text: C, XML, Markdown, tables, trackers."""

from __future__ import annotations

import re

from sysid.names.fitting import shortened
from sysid.names.shown import visible


def c_comment(text: object) -> str:
    r"""Text that can neither end a C comment nor begin one, nor join its line to the next.

    Args:
        text: Any text.

    Returns:
        One line.

    Example:
        >>> c_comment("a */ b"), c_comment("a *\\ b"), c_comment("P/*Q")
        ('a * / b', 'a * / b', 'P/ *Q')
    """
    # First all that means a slash, then the pairs, in one pass that looks at both neighbours.
    written = re.sub(r"\s+", " ", visible(text).replace("??", "? ?").replace("\\", "/"))
    return re.sub(r"(?<=\*)(?=/)|(?<=/)(?=[*/])", " ", written)


def c_string(text: object) -> str:
    r"""A C string literal; what is not printable ASCII stands as octal digits, and no trigraph is left.

    Args:
        text: Any text.

    Returns:
        The literal, with its quotes.

    Example:
        >>> c_string('say "ä"')
        '"say \\"\\303\\244\\""'
    """
    parts = []
    for byte in str(text).encode("utf-8", "replace"):
        character = chr(byte)
        plain = 32 <= byte < 127 and character not in '"\\?'
        parts.append(character if plain else f"\\{character}" if character in '"\\?' else f"\\{byte:03o}")
    return f'"{"".join(parts)}"'


def xml_attribute(text: object) -> str:
    r"""The value of an XML attribute, with its quotes.

    Args:
        text: Any text.

    Returns:
        The value, of characters that XML 1.0 has.

    Example:
        >>> xml_attribute('a<b & "c"')
        '\'a&lt;b &amp; "c"\''
    """
    from xml.sax.saxutils import quoteattr  # brings the whole of urllib, a twelfth of what --help takes

    return quoteattr(visible(text))


def markdown(text: object) -> str:
    r"""Text as it may stand in a paragraph or a cell of Markdown: no HTML, no link, no picture, no table.

    Args:
        text: Any text; an arrow of two characters becomes one.

    Returns:
        One line.

    Example:
        >>> markdown("V->C <img src=x>"), markdown("[x](http://y)"), markdown("a|b")
        ('V→C &lt;img src=x>', '[x\\](http://y)', 'a\\|b')
    """
    return markdown_inline(visible(text).strip().replace("->", "→"))


def markdown_inline(text: object) -> str:
    """Text as it may stand within a line of Markdown, behind other text; spaces at its ends stay.

    Args:
        text: Any text.

    Returns:
        One line.
    """
    written = re.sub(r"[\\*~$`|]|(?<![^\W_])_|_(?![^\W_])", lambda found: f"\\{found[0]}", visible(text))
    written = re.sub(r"&(?=#?\w+;)", "&amp;", written).replace("<", "&lt;")
    written = re.sub(r"\](?=[(\[:])", r"\]", written)
    return re.sub(r"^(\s*)((?:#{1,6}|\+|-|\d+[.)])(?=\s|$)|>|-{2,}|={1,}$)", lambda m: f"{m[1]}{_held(m[2])}", written)


def _held(mark: str) -> str:
    """What would begin a heading, a quotation or a list, as itself."""
    return f"{mark[:-1]}\\{mark[-1]}" if mark[0].isdigit() else f"\\{mark}"


def markdown_code(text: object) -> str:
    """Text as code in a line of Markdown, or in a cell.

    Args:
        text: Any text.

    Returns:
        The text, between as many marks as it takes.

    Example:
        >>> markdown_code("sysid run x")
        '`sysid run x`'
    """
    written = visible(text).replace("|", "\\|") or " "
    fence = "`" * (1 + max(map(len, re.findall("`+", written)), default=0))
    space = " " if written.startswith("`") or written.endswith("`") else ""
    return f"{fence}{space}{written}{space}{fence}"


def markdown_block(text: str) -> list[str]:
    """Lines of text as they stand, fenced by more marks than any of them begins with.

    Args:
        text: Any text.

    Returns:
        Lines of Markdown.
    """
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", text)), default=0))
    return [f"{fence}text", visible(text.rstrip("\n"), lines=True), fence]


def csv_cell(text: str) -> str:
    """Text as a cell of a CSV that a spreadsheet takes for text, not for a formula.

    Args:
        text: Any text.

    Returns:
        The text, behind an apostrophe where it would be a formula; :func:`from_csv_cell` takes it away.

    Example:
        >>> csv_cell("=HYPERLINK(A1)"), csv_cell("level [cm]"), from_csv_cell(csv_cell("@x"))
        ("'=HYPERLINK(A1)", 'level [cm]', '@x')
    """
    return f"'{text}" if re.match(r"'*\s*[=+\-@\uff1d\uff0b\uff0d\uff20]", text) else text


def from_csv_cell(text: str) -> str:
    """What :func:`csv_cell` was given."""
    return text[1:] if text.startswith("'") and csv_cell(text[1:]) == text else text


def tracking_text(text: object, length: int = 5000) -> str:
    """Text as the value of a tag or a parameter, or as the name of a run or an experiment.

    Args:
        text: Any text.
        length: The most characters.

    Returns:
        The text, of characters that every database keeps.
    """
    return shortened(visible(text, lines=True), length)
