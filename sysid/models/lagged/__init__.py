"""Forms of models with lagged regressors: a compiled pass over past inputs and outputs."""
