"""Polynomial models: OE, Box-Jenkins, ARMAX, by the prediction error."""
