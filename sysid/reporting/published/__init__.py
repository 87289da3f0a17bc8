"""Figures that others have published: as files, as tables to set beside a run's, and beside a run."""
