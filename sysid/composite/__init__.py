"""Several models as one system: fitted each alone, chosen together, trained through each other, proven as a whole."""
