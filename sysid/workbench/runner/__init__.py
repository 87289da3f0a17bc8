"""The runner of steps: store, resume, events, screen, plan."""
