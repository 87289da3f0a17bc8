"""Pipelines of kind ``assembly``: models wired into one system, chosen, trained and proven as one.

============  ===================================================================================
``config``    the pipeline's YAML
``members``   the members: where each stands, what it is fitted on, how it is put in its place
``stages``    alone, chosen together, retrained downstream, trained end to end
``growth``    more training data, where the whole is worst
``line``      the places between those that are modelled
``stress``    the whole on many random sequences, against the reference
``document``  what came of it, as tables and charts
``runner``    the run: every result on disk before it is announced
============  ===================================================================================
"""
