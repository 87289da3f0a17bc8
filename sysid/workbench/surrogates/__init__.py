"""From a slow model to a surrogate that stands in its place, proven on experiments that taught it nothing.

=========  =====================================================================================================
``asked``  what a surrogate is asked for by: a reference, what is said beside it, or a pipeline
``plan``   what is run for how long, as a pipeline of kind ``experiment`` that a person can change
``proof``  the surrogate against its reference on new experiments, and in its place
``grow``   rounds of experiments that are added where the surrogate is worst, and their control
``grown``  the model of the chosen round as a pipeline of fits
``begun``  a workspace that begins with an FMU
``told``   what a reader has to know beside the proof
``known``  fits that are asked for in place of a search
``make``   the whole: experiment, search, growth, proof; what is done is not done again
=========  =====================================================================================================
"""
