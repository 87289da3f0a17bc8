"""Pipelines of kind ``response``: a transfer function of a measured frequency response.

==========  ==============================================================================
``config``  the YAML
``steps``   functions of what is asked that give a fit, its files and its record
``run``     the run: the file read, orders compared or fitted, exported, reported, tracked
==========  ==============================================================================
"""
