"""Subspace identification: state spaces from projections of lagged data, without iterations."""
