"""The sections of the page of a run of fits, each made of stored results alone."""
