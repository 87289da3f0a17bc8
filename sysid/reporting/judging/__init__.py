"""A judgement in a report: its stored results and its tables."""
