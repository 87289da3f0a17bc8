"""Reference physics: command vector in, traces of a compiled air-brake model out.

====================  ==================================================================
``command``           the driver's handle over time
``sequences``         seeded random commands
``consist``           what a train is made of, with the constants of Appendix C
``variant``           the printed listing, the physical valve, and every switch between them
``flow``              flow coefficient and its table
``simulate``          the way in: ``simulate(command, consist=..., variant=...)``
``machine``           a train under way, advanced in chunks
``constants``         from consist and variant to the kernel's numbers
``kernel``            the compiled scheme
``reference``         the same step, written plainly, to test the kernel by
``generate``          the door to data sets
``as_function``       the same as a function of arrays, for a reference as anybody's is
====================  ==================================================================

Import from the modules: they are kept apart so that nothing compiles before it is needed.
"""
