"""Data sets by name: their description, their files or generator, and the cache of what was made."""
