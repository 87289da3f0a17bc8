"""Finding a model without being told which: linear first, then a search over structures within a time.

=============  =====================================================================================
``config``     the pipeline's YAML
``parts``      what is fitted and what chooses: selection traces, or a part held out by a declared rule
``look``       what is in the record that the search goes by
``families``   one row a kind of structure: what is tried of it first, and what next to a good one
``plan``       which structures are tried, in which order, and when nothing is gained any more
``budget``     minutes or iterations: what is left of them, and what fits into that
``refit``      the chosen structure on all of the record
``run``        the steps
``python``     :func:`sysid.auto`
=============  =====================================================================================

Trials are those of a sweep: same workers, same files, same record, same pictures.
"""
