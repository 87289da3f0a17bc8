"""Dates and lengths of time in the forms that C, e-mail and pandas write, brought into the usual one."""

from __future__ import annotations

import re
from datetime import date, timedelta

_WEEKDAY = re.compile(r"(?:mon|tue|wed|thu|fri|sat|sun|mo|di|mi|do|fr|sa|so)[a-z]{0,6}\.?,?\s+(?=\S)", re.IGNORECASE)
_MONTH_FIRST = re.compile(
    r"(?P<month>[^\W\d_]{3,9})\.?\s+(?P<day>[0-9]{1,2}),?\s+"
    r"(?:(?P<year>[0-9]{4})(?:,?\s+(?P<clock>\S.*))?|(?P<before>\S.*?)\s+(?P<late>[0-9]{4}))"
)
_DAYS = re.compile(r"(?P<days>[0-9]{1,5}) days?,? \+?(?P<h>[0-9]{1,2})(?P<rest>:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?)")
_DATED = (
    r"[0-9]{4}(?P<by>[-_./])[0-9]{1,2}(?P=by)[0-9]{1,2}|[0-9]{1,2}(?P<to>[-./])[0-9]{1,2}(?P=to)[0-9]{4}"
    r"|[0-9]{1,2}(?P<of>[-./])[^\W\d_]{3,9}(?P=of)[0-9]{2,4}"
)
_MARKED = re.compile(
    rf"(?P<date>{_DATED}|(?:19|20)[0-9]{{6}}(?=-))(?:--?|[_ T]|, )(?P<h>[0-9]{{1,2}})"
    r"(?:(?P<mark>[-_.:])(?P<m>[0-9]{2})(?:(?P=mark)(?P<s>[0-9]{2}))?|(?P<tm>[0-9]{2})(?P<ts>[0-9]{2}))"
    r"(?:(?P<f>[.,:][0-9]{1,9})|[-_](?P<milli>[0-9]{1,3}))?(?P<half>\s?[ap]\.?m\.?)?",
    re.IGNORECASE,
)
_HALF = re.compile(r"(?P<h>[0-9]{1,2})\.(?P<m>[0-9]{2})(?:\.(?P<s>[0-9]{2}))?\s?(?P<half>[ap]\.?m\.?)", re.IGNORECASE)
_OF_YEAR = re.compile(
    r"(?P<year>(?:19|20)[0-9]{2})[-:](?P<day>[0-3][0-9]{2})(?:(?:[T ]|(?<=:[0-9]{3}):)(?P<clock>\S.*))?"
)
_DAYS_AND_HOURS = re.compile(r"(?P<days>[0-9]{1,5})\.(?P<h>[0-9]{2})(?P<rest>:[0-9]{2}:[0-9]{2}(?:\.[0-9]+)?)")
"""As .NET writes a length of time."""
_IN_ASIA = re.compile(
    r"(?P<date>[0-9]{4}\s?[年년]\s?[0-9]{1,2}\s?[月월]\s?[0-9]{1,2})\s?[日일](?:\s?\([^)]*\))?\s*"
    r"(?P<half>上午|下午|午前|午後|오전|오후)?\s*(?P<clock>[0-9].*)?"
)
_NOON = {**dict.fromkeys(("上午", "午前", "오전"), " AM"), **dict.fromkeys(("下午", "午後", "오후"), " PM")}
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
        >>> usual_form("2024-072T08:15:00"), usual_form("1.06:00:00"), usual_form("2024年3月12日 下午8时15分")
        ('2024-03-12 08:15:00', '30:00:00', '2024-3-12 8:15 PM')
        >>> usual_form("2024-03-12-08-15-00"), usual_form("12.03.2024 08.15"), usual_form("11.59pm")
        ('2024-03-12 08:15:00', '12.03.2024 08:15:00', '11:59:00 pm')
    """
    found = _DAYS.fullmatch(text) or _DAYS_AND_HOURS.fullmatch(text)
    if found is not None:
        return f"{24 * int(found['days']) + int(found['h'])}{found['rest']}"
    found = _OF_YEAR.fullmatch(text)
    if found is not None and 0 < int(found["day"]) <= 366:
        stamp = date(int(found["year"]), 1, 1) + timedelta(days=int(found["day"]) - 1)
        return f"{stamp} {found['clock'] or ''}".rstrip()
    found = _IN_ASIA.fullmatch(text)
    if found is not None:
        day, clock = re.sub(r"\s?[年년月월]\s?", "-", found["date"]), found["clock"] or ""
        clock = re.sub(r"\s?[时時点點시分분]\s?(?=[0-9])", ":", clock).rstrip("秒초分분时時点點시 ")
        clock = f"{clock}:00" if clock.isdecimal() else clock
        return f"{day} {clock}{_NOON.get(found['half'], '')}".rstrip()
    found = _LETTERED.fullmatch(text)
    if found is not None:
        return f"{24 * int(found['d'] or 0) + int(found['h'])}:{found['m']}:{found['s'] or '00'}"
    found = _MARKED.fullmatch(text)
    if found is not None:
        day = (
            found["date"].replace("_", "-") if found["by"] or found["to"] or found["of"] else _with_marks(found["date"])
        )
        beyond = f".{found['milli']:>03}" if found["milli"] else found["f"] or ""
        clock = f"{found['h']}:{found['m'] or found['tm']}:{found['s'] or found['ts'] or '00'}{beyond}"
        return f"{day} {clock}{found['half'] or ''}"
    found = _HALF.fullmatch(text)
    if found is not None:
        return f"{found['h']}:{found['m']}:{found['s'] or '00'} {found['half']}"
    text = _WEEKDAY.sub("", text, count=1) if _WEEKDAY.match(text) else text
    found = _MONTH_FIRST.fullmatch(text)
    if found is None:
        return text
    year, clock = found["year"] or found["late"], found["clock"] or found["before"]
    return f"{found['day']} {found['month']} {year} {clock or ''}".rstrip()
