"""Runs that fit a measured frequency response: their results, and the page of these."""
