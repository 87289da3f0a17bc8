"""Pipelines of kind fits: configuration, data, steps, stored results."""
