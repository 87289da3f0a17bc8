"""Transfer functions by a measured frequency response: its record, the fit, and the dead time as a time."""
