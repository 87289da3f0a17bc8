"""Pipelines whose product is a data set: somebody acts, and what was done becomes traces to fit and to choose on.

==========  ===================================================================================
``maker``   what a maker has to answer, and how one is found among the installed packages
``config``  the pipeline's YAML
``runner``  the run: steps kept by their content, the data set written and loaded
==========  ===================================================================================
"""
