"""Beside others: published figures, and one run against another."""
