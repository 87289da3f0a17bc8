"""Process models: plants by gain, time constants, damping, zero and dead time."""
