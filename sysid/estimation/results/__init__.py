"""What an estimator gives back: the fit, its starts, how well its parameters are determined."""
