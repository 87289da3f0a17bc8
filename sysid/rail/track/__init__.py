"""The line ahead: terrain features, the driver's track card."""
