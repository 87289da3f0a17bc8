"""Neural state spaces: how their weights stand, begin and are trained."""
