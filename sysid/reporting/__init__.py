"""Stored results in, tables, figures and HTML out; no fit is computed here."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sysid.lazy_names import imported_when_asked

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

__getattr__, __all__ = imported_when_asked(__file__)
"""Matplotlib takes longer to import than ``sysid --help`` may take to answer."""
