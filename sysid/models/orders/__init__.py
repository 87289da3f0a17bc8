"""What is chosen before a fit: lags, neurons, limits, what inputs do between samples, and what a sweep tries of it."""
