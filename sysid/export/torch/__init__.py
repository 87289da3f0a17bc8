"""Surrogates as PyTorch modules, and the two formats that these are written in."""
