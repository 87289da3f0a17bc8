"""Several models that are trained through each other, as one."""
