"""Pipelines of kind ``experiment``: a slow model is run as designed, and a data set comes of it.

==========  ==============================================================================
``config``  the YAML
``run``     the run: what has been run is found, the rest is run, the data set is written
``python``  :func:`sysid.experiment`
==========  ==============================================================================
"""
