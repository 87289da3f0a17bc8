"""Models and traces in, figures of merit out."""
