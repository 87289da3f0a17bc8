"""Traces and a structure in, a FitResult out."""
