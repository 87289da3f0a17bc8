"""Models of equations: what somebody wrote, what is known of its parameters, how it runs, and where it begins."""
