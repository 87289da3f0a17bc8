"""Names of channels, cases and fits as text of somebody else's: C, XML, Markdown, tables, terminals, trackers, files.

A name is data. It comes from a column's header or from a YAML, may hold anything, and keeps what it holds wherever it
is data. Where it becomes part of another language's text it goes through here, once, at the writer's end: it can then
neither end what it stands in nor begin anything of its own.
"""

from __future__ import annotations

import hashlib
import json
import re
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from typing import Final

UNKNOWN: Final = "\N{REPLACEMENT CHARACTER}"
"""What stands for a character that cannot be shown."""

DIRECTION: Final = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\ufeff")
"""Characters that change the direction of what follows: a text could read other than it is."""

C_WORDS: Final = frozenset(
    {
        *("auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum"),
        *("extern", "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return"),
        *("short", "signed", "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void"),
        *("volatile", "while", "asm", "alignas", "alignof", "and", "and_eq", "bitand", "bitor", "bool"),
        *("catch", "class", "compl", "constexpr", "const_cast", "decltype", "delete", "dynamic_cast"),
        *("explicit", "export", "false", "friend", "mutable", "namespace", "new", "noexcept", "not"),
        *("not_eq", "nullptr", "operator", "or", "or_eq", "private", "protected", "public"),
        *("reinterpret_cast", "static_assert", "static_cast", "template", "this", "thread_local", "throw"),
        *("true", "try", "typeid", "typename", "using", "virtual", "wchar_t", "xor", "xor_eq"),
    }
)
"""Words that are no identifier in C or C++."""

WINDOWS_DEVICES: Final = frozenset(
    ["con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(1, 10))]
)
"""Names that are no file's on Windows, whatever their ending."""

LONGEST_FILE: Final = 80
LONGEST_IDENTIFIER: Final = 40
LONGEST_KEY: Final = 120
"""What is longer is cut, and ends with a digest of the whole."""


def visible(text: object, *, lines: bool = False) -> str:
    """Text that can be shown: no control characters, nothing that turns the direction, no half of a pair.

    Args:
        text: Any text.
        lines: Whether it may have several lines.

    Returns:
        The text, with a space for each break of a line and :data:`UNKNOWN` for what cannot be shown.

    Example:
        >>> visible("level" + chr(27) + "[31m" + chr(10) + "of the tank")
        'level�[31m of the tank'
    """
    written = str(text)
    if written.isascii() and written.isprintable():
        return written
    return "".join(_shown(character, lines) for character in written.replace("\r\n", "\n"))


def _shown(character: str, lines: bool) -> str:
    if character in "\t\n\r\v\f\x85\u2028\u2029":
        return character if lines and character == "\n" else " "
    hidden = unicodedata.category(character) in {"Cc", "Cs", "Cn"} or character in DIRECTION
    return UNKNOWN if hidden else character


def shortened(text: str, length: int, joint: str = "-") -> str:
    """A text of at most some length; what is cut off is told apart by a digest of the whole.

    Args:
        text: The text.
        length: The most characters, from 12 on.
        joint: Between what is left and the digest.

    Returns:
        The text.

    Example:
        >>> shortened("a" * 100, 20)
        'aaaaaaaaaaa-28165978'
    """
    if len(text) <= length:
        return text
    return f"{text[: length - 9].rstrip(joint)}{joint}{_digest(text)}"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:8]


def distinct(names: Iterable[str], fitted: Callable[[str], str], joint: str = "_") -> dict[str, str]:
    """Different names for different names, of which some may come out the same.

    Args:
        names: The names.
        fitted: Makes one fit.
        joint: Between a name and the number that tells it apart.

    Returns:
        What each became; the first of those that are alike keeps its own.

    Example:
        >>> distinct(["a/b", "a b", "c"], c_identifier)
        {'a/b': 'a_b', 'a b': 'a_b_2', 'c': 'c'}
    """
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in dict.fromkeys(names):
        plain = unique = fitted(name)
        number = 2
        while unique in taken:
            unique, number = f"{plain}{joint}{number}", number + 1
        taken.add(unique)
        found[name] = unique
    return found


def _ascii(name: str) -> str:
    """Letters without what stands above and below them; other alphabets are lost."""
    return unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()


def slug(name: str) -> str:
    """A name as a folder or a file: lower case, letters and digits, dashes between words.

    Args:
        name: For example ``"closed loop, 2 starts"``.

    Returns:
        For example ``"closed-loop-2-starts"``; ``"fit"`` where no letter or digit is left.

    Example:
        >>> slug("Closed loop (4/4/20)"), slug("../../x"), slug("CON")
        ('closed-loop-4-4-20', 'x', 'con-0')
    """
    plain = re.sub(r"[^a-z0-9]+", "-", _ascii(name).lower()).strip("-") or "fit"
    return shortened(f"{plain}-0" if plain in WINDOWS_DEVICES else plain, LONGEST_FILE)


def told_apart(fitted: str, names: Iterable[str]) -> str:
    """What some names became, with a digest behind it where one of them has lost more than its spaces and dots.

    Args:
        fitted: What they became.
        names: The names.

    Returns:
        The same, or a text that no other names have.

    Example:
        >>> told_apart("bp-ar", ["BP", "AR"]), told_apart("p", ["P+"])
        ('bp-ar', 'p-f23407cc')
    """
    given = list(names)
    plain = all(re.fullmatch(r"[A-Za-z0-9_. -]+", name) for name in given)
    return fitted if plain else f"{fitted}-{_digest(json.dumps(given))}"


def task_slug(name: str) -> str:
    """The name of a task of a training, in which mappings stand, as a folder; no other task has it.

    Args:
        name: For example ``"BP+AR -> BC 0"``.

    Returns:
        For example ``"bp-ar-bc-0"``.
    """
    return told_apart(slug(name), [one for side in read_sides(name) for one in side])


def c_identifier(name: str) -> str:
    """A name as a lower-case C identifier.

    Args:
        name: For example ``"Öltemp. [°C]"``.

    Returns:
        For example ``"oltemp_c"``.

    Example:
        >>> c_identifier("Öltemp."), c_identifier("2nd"), c_identifier("*/"), c_identifier("int")
        ('oltemp', 'c2nd', 'channel', 'cint')
    """
    plain = re.sub(r"[^0-9a-z]+", "_", _ascii(name).lower()).strip("_") or "channel"
    plain = f"c{plain}" if plain[0].isdigit() or plain in C_WORDS else plain
    return shortened(plain, LONGEST_IDENTIFIER, "_")


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


def xml_name(name: str) -> str:
    """A name as XML has it in one line, such as of a variable of an FMU; not empty.

    Args:
        name: Any name.

    Returns:
        The name, of characters that XML 1.0 has.
    """
    return visible(name).strip() or "channel"


def markdown(text: object) -> str:
    r"""Text as it may stand in a paragraph of Markdown: no HTML, no link, no picture, no table.

    Args:
        text: Any text; an arrow of two characters becomes one.

    Returns:
        One line.

    Example:
        >>> markdown("V->C <img src=x>"), markdown("[x](http://y)")
        ('V→C &lt;img src=x>', '[x\\](http://y)')
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


def markdown_cell(text: object) -> str:
    r"""Text as it may stand in a cell of a Markdown table; where nothing begins a line.

    Args:
        text: Any text.

    Returns:
        One line.

    Example:
        >>> markdown_cell("a|b"), markdown_cell("=1+1")
        ('a\\|b', '=1+1')
    """
    return markdown_inline(visible(text).strip().replace("->", "→"))


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


def tracking_key(name: str) -> str:
    """A name as a key of a metric, a parameter or a tag, or as a part of one; of MLflow's characters, no path.

    Args:
        name: For example ``"VAL 1 (µ = 0.3)"``.

    Returns:
        For example ``"VAL 1 __ _ 0.3_"``.

    Example:
        >>> tracking_key("nb[0]"), tracking_key("a/b"), tracking_key("../x"), tracking_key("VAL 1 (µ = 0.3)")
        ('nb.0', 'a_b', '_._x', 'VAL 1 __ _ 0.3_')
    """
    plain = re.sub(r"\[(\d+)\]", r".\1", name.strip())
    plain = re.sub(r"[^A-Za-z0-9_. -]", "_", plain)
    plain = re.sub(r"^\.", "_", plain).strip() or "_"
    return shortened(plain, LONGEST_KEY, "_")


def tracking_text(text: object, length: int = 5000) -> str:
    """Text as the value of a tag or a parameter, or as the name of a run or an experiment.

    Args:
        text: Any text.
        length: The most characters.

    Returns:
        The text, of characters that every database keeps.
    """
    return shortened(visible(text, lines=True), length)


def signal_name(name: str) -> str:
    """A name as python-control takes it for a signal: without dots, not empty.

    Args:
        name: For example ``"data.u"``.

    Returns:
        For example ``"data_u"``.

    Example:
        >>> signal_name("data.u")
        'data_u'
    """
    return re.sub(r"[.\[\]:,]", "_", visible(name)).strip() or "signal"


def written_side(names: Sequence[str]) -> str:
    """Names of one side of a mapping as text; a name that would be misread stands in quotes.

    Args:
        names: The names.

    Returns:
        The names, joined by ``+``.

    Example:
        >>> written_side(["BP", "P+"])
        'BP+"P+"'
    """
    return "+".join(_written(name) for name in names)


def _written(name: str) -> str:
    plain = name and name == name.strip() and not name.startswith('"') and "+" not in name and "->" not in name
    return (
        name if plain and not name.endswith("-") and not name.startswith(">") else json.dumps(name, ensure_ascii=False)
    )


def output_side(text: str) -> str:
    """The outputs of a mapping that is text, for a title.

    Args:
        text: The mapping.

    Returns:
        Their names.

    Example:
        >>> output_side("BP+AR -> BC")
        'BC'
    """
    return ", ".join(read_sides(text)[-1])


_QUOTED: Final = re.compile(r'\s*("(?:[^"\\]|\\.)*")\s*(?=\+|->|,|$)', re.DOTALL)


def read_sides(text: str) -> list[list[str]]:
    """The sides of a mapping from text: what stands between arrows, each as its names.

    Args:
        text: Names joined by ``+``, sides joined by ``->``; a name may stand in quotes, as in JSON.

    Returns:
        The names of each side, of which some may be empty.

    Example:
        >>> read_sides('BP + "P+" -> BC')
        [['BP', 'P+'], ['BC']]
    """
    sides: list[list[str]] = [[]]
    at = 0
    while at <= len(text):
        quoted = _QUOTED.match(text, at)
        if quoted is not None and (name := _unquoted(quoted[1])) is not None:
            end = quoted.end()
        else:
            found = re.compile(r"\+|->").search(text, at)
            end = found.start() if found else len(text)
            name = text[at:end].strip()
        sides[-1].append(name)
        arrow = text.startswith("->", end)
        if arrow:
            sides.append([])
        at = end + (2 if arrow else 1)
    return [[] if side == [""] else side for side in sides]


def _unquoted(text: str) -> str | None:
    try:
        found = json.loads(text, strict=False)
    except ValueError:
        return None
    return found if isinstance(found, str) else None
