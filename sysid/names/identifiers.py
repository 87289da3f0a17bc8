"""Names of files, of C's variables, in XML, of trackers' keys and of an FMU's signals, made of any name."""

from __future__ import annotations

import re
from typing import Final

from sysid.names.fitting import ascii_of, shortened, told_apart
from sysid.names.shown import visible
from sysid.names.sides import read_sides

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
    plain = re.sub(r"[^a-z0-9]+", "-", ascii_of(name).lower()).strip("-") or "fit"
    return shortened(f"{plain}-0" if plain in WINDOWS_DEVICES else plain, LONGEST_FILE)


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
    plain = re.sub(r"[^0-9a-z]+", "_", ascii_of(name).lower()).strip("_") or "channel"
    plain = f"c{plain}" if plain[0].isdigit() or plain in C_WORDS else plain
    return shortened(plain, LONGEST_IDENTIFIER, "_")


def xml_name(name: str) -> str:
    """A name as XML has it in one line, such as of a variable of an FMU; not empty.

    Args:
        name: Any name.

    Returns:
        The name, of characters that XML 1.0 has.
    """
    return visible(name).strip() or "channel"


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
