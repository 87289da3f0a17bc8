"""The engine that every fit shares: Levenberg-Marquardt, damping, evidence, termination, posterior."""
