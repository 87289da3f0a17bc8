"""The two-way end-of-train device: head end and tail unit."""
