"""A figure as a small inline SVG element: what matplotlib draws, without what a browser does not need."""

from __future__ import annotations

import io
import re
import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING, Final

from sysid.names import visible

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# A reader's machine need not have the font that the layout was computed with.
_FONT_STACK: Final = "'DejaVu Sans',Verdana,Geneva,sans-serif"
_REFERENCE: Final = re.compile(r"#([^)]+)")
_TOKEN: Final = re.compile(r"[A-Za-z]|[-+]?\d*\.?\d+(?:e[-+]?\d+)?")
_PAIRS: Final = {"M": 1, "L": 1, "Q": 2, "C": 3}
FAR: Final = 1e6
"""Points; nothing farther off is drawn, and an outline that runs away may come with 300 digits."""
_SHARED: Final = ("style", "clip-path")
PIXELS: Final = 1.75
"""On the screen, for each point of a figure: one as wide as the page fills it."""
MODEL: Final = "model-"
"""What is called so is a line that a page may hide: its name becomes a class."""


def svg(figure: Figure, *, title: str, description: str, name: str) -> str:
    """A figure as an inline SVG element, the same text every time it is made.

    Args:
        figure: The figure.
        title: Read aloud as the figure's name.
        description: Read aloud as what it shows.
        name: Unique within the page; letters, digits and dashes. Begins every id.

    Returns:
        The element, without XML declaration, with ``role="img"``, scaling to the width it is given.
    """
    from sysid.reporting.figures.style import styled

    buffer = io.StringIO()
    with styled():
        figure.savefig(buffer, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    root = ET.fromstring(buffer.getvalue())  # noqa: S314 - our own drawing, made an instant ago
    _plain_names(root)
    _without(root, {"metadata", "style"})
    _short_ids(root, name)
    for element in root.iterfind(".//*"):
        _shorten(element)
    _share(root)
    _unwrap(root)
    whole = described(root.get("viewBox", ""), title=title, description=description, name=name)
    whole.extend(root)
    root = whole
    for element in root.iter():
        element.tail = "\n"
    return ET.tostring(root, encoding="unicode").strip()


def described(box: str, *, title: str, description: str, name: str) -> ET.Element:
    """An empty SVG element with its words.

    Args:
        box: Its ``viewBox``.
        title: As for :func:`svg`.
        description: Likewise.
        name: Likewise.

    Returns:
        The element.
    """
    style = f"stroke-linejoin:round;stroke-linecap:butt;font-family:{_FONT_STACK};max-width:{_widest(box)}px"
    labels = f"{name}-title {name}-desc"
    root = ET.Element("svg", {"role": "img", "aria-labelledby": labels, "viewBox": box, "style": style})
    for tag, text in (("title", title), ("desc", description)):
        ET.SubElement(root, tag, {"id": f"{name}-{tag}"}).text = visible(text, lines=True)
    return root


def as_file(drawing: str) -> bytes:
    """A drawing as a file of its own: outside a page a name space says that it is one, or no program draws it.

    Args:
        drawing: What :func:`svg` gives.

    Returns:
        The content of the file.
    """
    return drawing.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1).encode()


def _widest(box: str) -> int:
    """Pixels at most on the screen: a small figure, and its letters, are not blown up to the width of the page."""
    return round(PIXELS * float(box.split()[2])) if box else 0


def _plain_names(root: ET.Element) -> None:
    """Names without name spaces: inline in HTML an SVG needs none, and plain href is SVG 2."""
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
        for key in [key for key in element.attrib if key.startswith("{")]:
            element.set(key.rpartition("}")[2], element.attrib.pop(key))
        if element.text is not None and not element.text.strip():
            element.text = None


def _without(root: ET.Element, tags: set[str]) -> None:
    """Drop what is not drawn; a style element would reach beyond the figure."""
    for child in list(root):
        _without(child, tags)
        if child.tag in tags or (child.tag == "defs" and not len(child)):
            root.remove(child)


def _short_ids(root: ET.Element, name: str) -> None:
    """Ids are unique in a figure only; in one page with others each figure needs its own. Most are never used."""
    used: dict[str, str] = {}
    for element in root.iter():
        for key in ("href", "clip-path"):
            found = _REFERENCE.search(element.get(key, ""))
            if found:
                used.setdefault(found.group(1), f"{name}-{len(used)}")
    for element in root.iter():
        own = element.attrib.pop("id", None)
        if own is not None and own.startswith(MODEL):
            element.set("class", own)
        if own in used:
            element.set("id", used[own])
        for key in ("href", "clip-path"):
            if key in element.attrib:
                element.set(key, _REFERENCE.sub(lambda match: f"#{used[match.group(1)]}", element.attrib[key]))


def _shorten(element: ET.Element) -> None:
    """A hundredth of a point cannot be seen; six decimals and repeated words multiply the size."""
    fields = element.attrib
    if "d" in fields:
        fields["d"] = relative_path(fields["d"])
    for key in ("x", "y", "width", "height"):
        if key in fields:
            fields[key] = _hundredths(round(100.0 * float(fields[key])))
    if "transform" in fields:
        if fields["transform"].startswith("rotate(-0 "):
            del fields["transform"]
        else:
            fields["transform"] = re.sub(r"(\.\d\d)\d+", r"\1", fields["transform"])
    if "style" in fields:
        rules = [rule.strip().replace(": ", ":", 1) for rule in fields["style"].split(";")]
        fields["style"] = ";".join(rule for rule in rules if rule and not rule.startswith("font-family:"))


def _share(root: ET.Element) -> None:
    """What all children of a group have in common is said once: hundreds of markers repeat it otherwise."""
    for group in root.iter("g"):
        children = list(group)
        if len(children) < 2 or any(child.tag != "use" for child in children):
            continue
        for key in _SHARED:
            values = {child.get(key) for child in children}
            if len(values) == 1 and None not in values and key not in group.attrib:
                group.set(key, str(values.pop()))
                for child in children:
                    del child.attrib[key]


def _unwrap(parent: ET.Element) -> None:
    """Put the children of groups that say nothing in the place of their group."""
    for child in list(parent):
        _unwrap(child)
        if child.tag == "g" and not child.attrib:
            place = list(parent).index(child)
            parent.remove(child)
            for offset, grandchild in enumerate(child):
                parent.insert(place + offset, grandchild)


def relative_path(path: str) -> str:
    """The same outline from point to point, in hundredths of a unit.

    Rounded are the points, not the steps between them, so that nothing adds up along a line.

    Args:
        path: Absolute commands ``M``, ``L``, ``Q``, ``C`` and ``z``, as matplotlib writes them.

    Returns:
        Relative commands.

    Example:
        >>> relative_path("M 10.0 20.0 L 10.123456 20.0 L 11.5 19.25 z")
        'M10 20h.12l1.38-.75z'
    """
    tokens = _TOKEN.findall(path)
    parts: list[str] = []
    here = start = (0, 0)
    place = 0
    while place < len(tokens):
        command = tokens[place]
        place += 1
        if command in "zZ":
            parts.append("z")
            here = start
            continue
        count = 2 * _PAIRS[command]
        numbers = [round(100.0 * min(max(float(token), -FAR), FAR)) for token in tokens[place : place + count]]
        place += count
        points = list(zip(numbers[0::2], numbers[1::2], strict=True))
        parts.append(_step(command, points, here))
        here = points[-1]
        start = here if command == "M" else start
    return "".join(parts)


def _step(command: str, points: list[tuple[int, int]], here: tuple[int, int]) -> str:
    if command == "M":
        return "M" + _joined([*points[0]])
    steps = [coordinate - from_ for point in points for coordinate, from_ in zip(point, here, strict=True)]
    if command == "L" and steps[1] == 0:
        return "h" + _hundredths(steps[0])
    if command == "L" and steps[0] == 0:
        return "v" + _hundredths(steps[1])
    return command.lower() + _joined(steps)


def _joined(hundredths: list[int]) -> str:
    """Numbers with a space between them where none of them begins with a sign."""
    texts = [_hundredths(number) for number in hundredths]
    return texts[0] + "".join(text if text.startswith("-") else f" {text}" for text in texts[1:])


def _hundredths(number: int) -> str:
    """A number of hundredths, as short as it can be written.

    Example:
        >>> [_hundredths(n) for n in (0, 5, -250, 1234, 300)]
        ['0', '.05', '-2.5', '12.34', '3']
    """
    whole, rest = divmod(abs(number), 100)
    decimals = f".{rest:02d}".rstrip("0") if rest else ""
    digits = f"{whole or ''}{decimals}" or "0"
    return f"-{digits}" if number < 0 else digits
