"""Process models of records: gain, time constants, damping, zero and dead time by the least error of the free run."""
