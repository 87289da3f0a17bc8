"""Pipelines that judge models by what their errors do where they are used.

=============  ===================================================================================
``judge``      what a judge has to answer, and how one is found among the installed packages
``config``     the pipeline's YAML
``sources``    the models: of run folders, of bundles, of the registry
``runner``     the run: steps kept by their content, one document, results, report, tracking
``logged``     what is tracked with the fits that were judged
=============  ===================================================================================
"""
