"""Pipelines of kind ``assembly``: models wired into one system, chosen, trained and proven as one.

================  ===================================================================================
``config``        the pipeline's YAML
``extending``     a YAML that builds on another one
``stage_config``  what it asks of retraining, training end to end and growing
``proof_config``  what it asks of the finished whole: random sequences, a line, published figures
``members``       the members: where each stands, what it is fitted on, how it is put in its place
``known``         members that are declared and not fitted
``rehearsal``     the whole wired once before anything is fitted
``stages``        alone, chosen together, retrained downstream, trained end to end
``everywhere``    training end to end with one set of weights for all places
``growth``        more training data, where the whole is worst, and training end to end on them
``line``          the places between those that are modelled
``stress``        the whole on many random sequences, against the reference
``document``      what came of it, as tables and charts
``context``       where a run stores, whom it tells, what it loads and fits
``material``      what a run is trained on
``course``        the stages of one start, every fit on disk before it is announced
``starts``        all starts, and which of them the surrogate is, or the mean of which
``finish``        scored, proven, exported, reported and tracked
``runner``        the run, and what it leaves
================  ===================================================================================
"""
