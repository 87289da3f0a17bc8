"""Data sets that the field makes: valves anywhere in a train, drive cycles, states along a trace."""
