"""Benchmarks in a report: their findings and their page."""
