"""What the data say before any structure is chosen: impulse responses, frequency responses, coherence."""
