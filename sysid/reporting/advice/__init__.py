"""What is in a record, for people: words, a section of the report, a picture."""
