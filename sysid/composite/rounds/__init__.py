"""Rounds of training the whole end to end, rehearsed, and how long they take."""
