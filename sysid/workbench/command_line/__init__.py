"""The command line: its words, by what a person wants to do; what they do stands in ``commands``."""
