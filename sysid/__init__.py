"""The system-identification workbench: reference traces in, frozen surrogates of known accuracy out."""

__version__ = "0.1.0"
