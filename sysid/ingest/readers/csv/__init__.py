"""Tables of text: from the bytes of a file to a head, a clock and cells (:mod:`~sysid.ingest.readers.csv.text`)."""
