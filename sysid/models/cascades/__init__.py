"""Models wired output to input, and how they run as one."""
