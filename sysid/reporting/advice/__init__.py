"""What was found in records before any fit, as it is stored and as it is said."""
