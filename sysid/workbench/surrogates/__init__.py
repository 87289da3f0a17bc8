"""From a slow model to a surrogate that stands in its place, proven on experiments that taught it nothing.

=========  =====================================================================================================
``plan``   what is run for how long, as a pipeline of kind ``experiment`` that a person can change
``proof``  the surrogate against its reference on new experiments, and in its place
``make``   the whole: experiment, search, proof; what is done is not done again
=========  =====================================================================================================
"""
