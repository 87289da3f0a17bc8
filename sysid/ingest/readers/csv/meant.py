"""The encoding of names that are no words in Windows-1252."""

from __future__ import annotations

import re
from collections.abc import Sequence

from sysid.ingest.readers.text_source import seems_garbled

_IN_CHINESE = re.compile(rb"(?:[\xa1-\xa9\xb0-\xd7][\xa1-\xfe])+")
_KOREAN = range(0xB0, 0xC9)
"""How the syllables of Korean begin in its own encoding; words of these alone may be either's."""
_LETTER = "[\u3040-\u30ff\u4e00-\u9fff]"
_IN_JAPANESE = re.compile(rf"(?!.*(?:[A-Za-z]{_LETTER}|{_LETTER}[A-Za-z]))(?:[\0-\x7f]|{_LETTER})+", re.DOTALL)
_IN_CYRILLIC = re.compile(rb"[\xc0-\xdf]*[\xe0-\xff]*")


def meant_encoding(names: Sequence[str]) -> str | None:
    """The encoding in which names that were read in Windows-1252 are words.

    Args:
        names: As they were read.

    Returns:
        The encoding; ``None`` where they may be words as they are, or it is another one.

    Example:
        >>> meant_encoding(["Âðåìÿ, ñ", "Äàâëåíèå"]), meant_encoding(["Ê±¼ä(s)", "µçÑ¹(V)"]), meant_encoding(["Größe"])
        ('cp1251', 'gb18030', None)
    """
    try:
        text = "\n".join(names).encode("cp1252")
    except UnicodeEncodeError:
        return None
    if sum(0x81 <= one <= 0x9F for one in text) > 1 and _IN_JAPANESE.fullmatch(text.decode("cp932", "replace")):
        return "cp932"
    words = re.findall(rb"[\x80-\xff]+", text)
    if not seems_garbled(names):
        return None
    if all(map(_IN_CYRILLIC.fullmatch, words)):
        return "cp1251"
    chinese = all(map(_IN_CHINESE.fullmatch, words)) and any(one not in _KOREAN for word in words for one in word[::2])
    return "gb18030" if chinese else None
