"""Parameters with names: how they are trained, and what a fit says of each."""
