"""An assembly in a report: its stored results, and the tables, charts and sentences that are made of them."""
