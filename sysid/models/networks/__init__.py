"""Models with neurons: NARX and neural state spaces."""
