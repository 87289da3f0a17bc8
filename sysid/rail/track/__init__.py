"""The line: profile, terrain features, the driver's track card."""
