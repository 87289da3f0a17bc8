"""What the records of a fit leave open and what the fit leaves out of them, told for every kind of structure."""
