"""The published reports as pages of the site: they lie beside the documentation, and its links lead to them."""

import re
import shutil
from pathlib import Path

from markdown_it import MarkdownIt

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r"\[([^\]]+)\]\((?:\.\./)+(reports/[\w/-]+)\.md\)")
"""A link of a page to a report: Sphinx knows no documents outside of its own folder."""
THEIRS = {
    re.compile(r'href="((?:\.\./)*)\.\./docs/([^"]+)\.md'): r'href="\1../\2.html',
    re.compile(r'href="(?!\w+:)([^"]+)\.md"'): r'href="\1.html"',
    re.compile(r'href="bundle"'): 'href="bundle/MODEL_CARD.html"',
    re.compile(r"<table>"): '<div class="table-wrapper docutils container"><table class="docutils">',
    re.compile(r"</table>"): "</table></div>",
    re.compile(r"<th></th>"): "<td></td>",
}
"""What a report's links and tables become on the site; conf.py puts the rest right, as on every page."""


def link_to_reports(_app, docname, source):
    """Write a page's links to reports as what they are on the site."""
    up = "../" * docname.count("/")
    source[0] = LINK.sub(rf'<a class="reference internal" href="{up}\2.html">\1</a>', source[0])


def report_pages(app):
    """Every page of the published reports, and what it draws."""
    if app.builder.format != "html":
        return
    markdown = MarkdownIt("commonmark", {"html": True}).enable("table")
    for page in sorted(ROOT.glob("reports/**/*.md")):
        body = markdown.render(page.read_text(encoding="utf-8"))
        for theirs, ours in THEIRS.items():
            body = theirs.sub(ours, body)
        name = page.relative_to(ROOT).with_suffix("").as_posix()
        title = re.search(r"<h1>(.*?)</h1>", body)
        yield name, {"title": title[1] if title else name, "body": body}, "page.html"
        folder = Path(app.outdir) / page.relative_to(ROOT).parent
        folder.mkdir(parents=True, exist_ok=True)
        for picture in [*page.parent.glob("*.svg"), *page.parent.glob("line.json")]:
            shutil.copy(picture, folder)


def setup(app):
    """Sphinx's way of asking for it."""
    app.connect("source-read", link_to_reports)
    app.connect("html-collect-pages", report_pages)
    return {"parallel_read_safe": True}
