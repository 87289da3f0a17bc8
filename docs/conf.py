"""The site: `make docs` builds it, with every page of the gallery run anew."""

import os
import sys
from pathlib import Path

import sysid

sys.path.insert(0, str(Path(__file__).parent))  # for report_pages.py

project = "System-identification workbench"
author = "The system-identification workbench developers"
copyright = author  # noqa: A001 - the name that Sphinx asks for
release = version = sysid.__version__
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx.ext.mathjax",
    "sphinx_copybutton",
    "report_pages",
]
exclude_patterns = ["receivers"]
html_theme = "furo"
html_title = "sysid"
html_theme_options = {"navigation_with_keys": True, "top_of_page_buttons": []}
html_static_path, html_css_files = ["_static"], ["site.css"]
html_search_scorer = str(Path(__file__).with_name("scorer.js"))

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
# Links from a page to files of the repository (README, YAML) are checked by the tests, not here.
suppress_warnings = [
    "myst.xref_missing",
    "mystnb.unknown_mime_type",
    "mystnb.lexer",
    "myst-nb.lexer",
    "misc.highlighting_failure",
]

# A notebook that fails fails the build. The cache spares those that did not change.
nb_execution_mode = os.environ.get("SYSID_NOTEBOOKS", "cache")
nb_execution_raise_on_error = True
nb_execution_timeout = 120
nb_merge_streams = True
nb_render_markdown_format = "myst"

autodoc_typehints = "none"  # they stand in the signatures, and their meaning in the text
autodoc_member_order = "bysource"
autoclass_content = "class"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_rtype = False

# What axe-core finds in the theme's pages, put right in what is written: captions are headings without a level, panels
# have no names, and what scrolls cannot be reached from the keyboard.
ACCESSIBLE = {
    '<p class="caption" role="heading">': '<p class="caption" role="heading" aria-level="2">',
    '<aside class="sidebar-drawer">': '<aside class="sidebar-drawer" aria-label="All pages">',
    '<aside class="toc-drawer">': '<aside class="toc-drawer" aria-label="On this page">',
    '<label class="overlay ': '<label aria-hidden="true" class="overlay ',
    '<div class="highlight"><pre>': '<div class="highlight"><pre tabindex="0">',
    '<div class="table-wrapper ': '<div tabindex="0" class="table-wrapper ',
    '<th class="head"><p></p></th>': "<td></td>",
    '<div id="search-results"></div>': '<h1>Search</h1>\n<div id="search-results"></div>',
}

# The same in what notebooks print: text of ours, the corner of a pandas frame, grey words of Rich.
OUTPUTS = {
    '<div class="output text_html"><pre': '<div class="output text_html"><pre tabindex="0"',
    "<th></th>": "<td></td>",
    "color: #7f7f7f; text-decoration-color: #7f7f7f": "color: inherit",
}


def setup(app):
    """Put the pages right once they are written."""

    def finished(app, error):
        if error is None and app.builder.format == "html":
            for page in Path(app.outdir).rglob("*.html"):
                text = page.read_text(encoding="utf-8")
                for theirs, ours in (ACCESSIBLE | OUTPUTS).items():
                    text = text.replace(theirs, ours)
                page.write_text(text, encoding="utf-8")

    app.connect("build-finished", finished)
