"""Stored results in, tables, figures and HTML out; no fit is computed here."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sysid.reporting.benchmarks.page import publish_benchmarks as publish_benchmarks
    from sysid.reporting.comparing.against import compare_runs as compare_runs
    from sysid.reporting.comparing.against_page import write_comparison as write_comparison
    from sysid.reporting.figures.fit_figures import case_figure as case_figure
    from sysid.reporting.kinds import read_run as read_run
    from sysid.reporting.kinds import results_json_schema as results_json_schema
    from sysid.reporting.pdf import write_pdf as write_pdf
    from sysid.reporting.publication import publish_run as publish_run
    from sysid.reporting.published.tables import PublishedFigure as PublishedFigure
    from sysid.reporting.published.tables import PublishedTable as PublishedTable
    from sysid.reporting.published.tables import published_names as published_names
    from sysid.reporting.published.tables import read_published as read_published
    from sysid.reporting.report import write_report as write_report
    from sysid.reporting.results import Results as Results
    from sysid.reporting.results import parse_results as parse_results
    from sysid.reporting.results import read_results as read_results
    from sysid.reporting.results import write_results as write_results
    from sysid.reporting.signals import CaseSignals as CaseSignals
    from sysid.reporting.signals import read_signals as read_signals

# Loaded when first asked for: matplotlib takes longer to import than `sysid --help` may take to answer.
_HOME = {
    "CaseSignals": "signals",
    "PublishedFigure": "published.tables",
    "PublishedTable": "published.tables",
    "Results": "results",
    "case_figure": "figures.fit_figures",
    "compare_runs": "comparing.against",
    "parse_results": "results",
    "publish_benchmarks": "benchmarks.page",
    "publish_run": "publication",
    "published_names": "published.tables",
    "read_published": "published.tables",
    "read_results": "results",
    "read_run": "kinds",
    "read_signals": "signals",
    "results_json_schema": "kinds",
    "write_comparison": "comparing.against_page",
    "write_pdf": "pdf",
    "write_report": "report",
    "write_results": "results",
}

__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
