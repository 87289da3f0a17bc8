"""Structures that become equations: block-oriented models and polynomial NARX, started from linear fits."""
