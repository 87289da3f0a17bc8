"""Transfer functions in discrete and continuous time: starts, dead times, fit, and what is told of them."""
