"""What goes into a model and comes out: names, units, scaling, levels at rest, and what came before."""
