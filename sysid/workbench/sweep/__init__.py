"""Pipelines of kind sweep: ranges, samplers, workers, trials."""
