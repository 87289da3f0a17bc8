"""Dates and lengths of time in the forms that C, e-mail and pandas write, brought into the usual one."""

from __future__ import annotations

import re

_WEEKDAY = re.compile(r"(?:mon|tue|wed|thu|fri|sat|sun|mo|di|mi|do|fr|sa|so)[a-z]{0,6}\.?,?\s+(?=\S)", re.IGNORECASE)
_MONTH_FIRST = re.compile(
    r"(?P<month>[^\W\d_]{3,9})\.?\s+(?P<day>[0-9]{1,2}),?\s+"
    r"(?:(?P<year>[0-9]{4})(?:,?\s+(?P<clock>\S.*))?|(?P<before>\S.*?)\s+(?P<late>[0-9]{4}))"
)
_DAYS = re.compile(r"(?P<days>[0-9]{1,5}) days?,? \+?(?P<h>[0-9]{1,2})(?P<rest>:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?)")
_DATED = r"[0-9]{4}(?P<by>[-_./])[0-9]{1,2}(?P=by)[0-9]{1,2}|[0-9]{1,2}(?P<to>[-./])[0-9]{1,2}(?P=to)[0-9]{4}"
_MARKED = re.compile(
    rf"(?P<date>{_DATED}|(?:19|20)[0-9]{{6}}(?=-))(?:--?|[_ T]|, )(?P<h>[0-9]{{1,2}})"
    r"(?:(?P<mark>[-_.:])(?P<m>[0-9]{2})(?:(?P=mark)(?P<s>[0-9]{2}))?|(?P<tm>[0-9]{2})(?P<ts>[0-9]{2}))"
    r"(?:(?P<f>[.,:][0-9]{1,9})|[-_](?P<milli>[0-9]{1,3}))?(?P<half>\s?[ap]\.?m\.?)?",
    re.IGNORECASE,
)
_HALF = re.compile(r"(?P<h>[0-9]{1,2})\.(?P<m>[0-9]{2})(?:\.(?P<s>[0-9]{2}))?\s?(?P<half>[ap]\.?m\.?)", re.IGNORECASE)
_LETTERED = re.compile(
    r"(?:(?P<d>[0-9]{1,5})\s?d\s?)?(?:(?P<h>[0-9]{1,5})\s?h\s?)(?P<m>[0-9]{1,2})\s?m(?:in)?\s?"
    r"(?:(?P<s>[0-9]{1,2}(?:[.,][0-9]+)?)\s?s(?:ec)?)?",
    re.IGNORECASE,
)


def _with_marks(packed: str) -> str:
    return f"{packed[:4]}-{packed[4:6]}-{packed[6:]}"


def usual_form(text: str) -> str:
    """A stamp with its day of the week left out, its day before its month, and its days as hours.

    Names of files have other marks in their times than colons, and so have the logs of some, and some countries.

    Args:
        text: Of a cell.

    Returns:
        The same text where it is in none of these forms.

    Example:
        >>> usual_form("Mon Jan  1 23:59:50.100 2024"), usual_form("March 12, 2024 08:15")
        ('1 Jan 2024 23:59:50.100', '12 March 2024 08:15')
        >>> usual_form("2 days 06:00:00"), usual_form("1h02m03.5s"), usual_form("12.5 V")
        ('54:00:00', '1:02:03.5', '12.5 V')
        >>> usual_form("2024-03-12-08-15-00"), usual_form("12.03.2024 08.15"), usual_form("11.59pm")
        ('2024-03-12 08:15:00', '12.03.2024 08:15:00', '11:59:00 pm')
    """
    found = _DAYS.fullmatch(text)
    if found is not None:
        return f"{24 * int(found['days']) + int(found['h'])}{found['rest']}"
    found = _LETTERED.fullmatch(text)
    if found is not None:
        return f"{24 * int(found['d'] or 0) + int(found['h'])}:{found['m']}:{found['s'] or '00'}"
    found = _MARKED.fullmatch(text)
    if found is not None:
        date = found["date"].replace("_", "-") if found["by"] or found["to"] else _with_marks(found["date"])
        beyond = f".{found['milli']:>03}" if found["milli"] else found["f"] or ""
        clock = f"{found['h']}:{found['m'] or found['tm']}:{found['s'] or found['ts'] or '00'}{beyond}"
        return f"{date} {clock}{found['half'] or ''}"
    found = _HALF.fullmatch(text)
    if found is not None:
        return f"{found['h']}:{found['m']}:{found['s'] or '00'} {found['half']}"
    text = _WEEKDAY.sub("", text, count=1) if _WEEKDAY.match(text) else text
    found = _MONTH_FIRST.fullmatch(text)
    if found is None:
        return text
    year, clock = found["year"] or found["late"], found["clock"] or found["before"]
    return f"{found['day']} {found['month']} {year} {clock or ''}".rstrip()
