"""A sweep in a report: its record, tables, pictures and section."""
