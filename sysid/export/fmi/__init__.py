"""Surrogates as FMUs: one archive for FMI 2 or 3."""
