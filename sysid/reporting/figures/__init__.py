"""Pictures: plain functions of stored numbers."""
