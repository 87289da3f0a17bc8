"""Structures that become equations: linear blocks with static curves, and polynomials of past samples."""
