"""The train around the brake: what a surrogate's error does to a train, and the functions of four sources.

==================  ======================================================================
``vehicle``         mass, running resistance, brake rigging, notch curves
``coupler``         slack, draft gears with friction, the stop behind them
``train``           vehicles in order; trains from files
``track``           grade, curvature, superelevation, speed limits; tracks from files
``motion``          a train in motion, advanced in chunks, with its energies and peak forces
``brake``           the brake as a port: reference physics or recorded traces
``surrogate``       the brake as a port: fitted models for every car
==================  ======================================================================

Import from the modules: they are kept apart so that nothing compiles before it is needed.
"""
