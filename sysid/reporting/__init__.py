"""Stored results in, tables, figures and HTML out; no fit is computed here."""
