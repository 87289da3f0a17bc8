"""Estimation of grey boxes: parameters of equations, weights within them, and the states before each record."""
