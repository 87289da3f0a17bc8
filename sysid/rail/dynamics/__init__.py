"""The train in motion: vehicles, couplers, brakes at every car."""
