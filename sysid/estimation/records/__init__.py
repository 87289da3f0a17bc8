"""Records as estimators see them: what counts, what says anything, where they begin and between what they stand."""
