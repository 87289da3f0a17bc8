"""How far a whole can be trusted: means of several, their spread, what perturbs it, Monte Carlo."""
