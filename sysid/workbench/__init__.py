"""Configuration, steps, tracking and the command line."""
