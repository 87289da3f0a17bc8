"""Files on disk in, a TraceSet in the units that were asked for out."""
