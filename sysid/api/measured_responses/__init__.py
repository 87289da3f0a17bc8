"""Measured frequency responses from Python: what is fitted, by which orders, and what is left out to judge it."""
