"""The train around the brake: what a surrogate's error does to a train, and the functions of four sources.

==================  ==============================================================================
``constants``       numbers that several files share
``vehicle``         mass, running resistance, brake rigging, notch curves
``coupler``         slack, draft gears with friction, the stop behind them
``train``           vehicles in order; trains from files
``track``           grade, curvature, superelevation, speed limits; tracks from files
``motion``          a train in motion, advanced in chunks, with its energies and peak forces
``kernel``          the compiled step; ``reference`` is the same step written plainly
``brake``           the brake as a port: reference physics or recorded traces
``surrogate``       the brake as a port: fitted models for every car
``cascade_brake``   the brake as a port: a whole assembly from the handle to the cylinder
``port``            from fitted models to a brake, by their channels
``equalising``      the equalising reservoir that a handle makes
``drive``           a driver, a train and a brake, sample by sample
``terrain``         correlation of the track with patterns over the train (US 9,120,493)
``features``        crests and sags: where they begin, how severe they are
``handling``        what to do about them; sub-trains of distributed power
``card``            the track card and how it is read ahead
``notch``           what a notch would do, how good that is, which to take
``ato``             constant speed and automatic stop by the card; the full-notch driver
``deceleration``    jerk-limited request; brake characteristic from a trace, and its inverse
``transit``         a vehicle whose deceleration controller learns from stop to stop
``ring``            the last minute of a pressure
``brake_computer``  the state machine at the head of a two-way end-of-train device
``tail_unit``       its valve, telemetry and self-test; trains braked from both ends
``bench``           that self-test on a volume with leaks, and both ends beside one
``annotate``        states of the brake along any trace; errors and weights by state
``cycles``          what a driver does with the handle on a hilly line
``stop_cycles``     what the deceleration controller does with it
``cycle_maker``     both as data sets: pipelines of kind ``drive-cycles``
``valve_traces``    traces of single valves anywhere in a train
``scenarios``       runs by which a brake is judged, and their figures; ``scenario_catalogue`` has them
``judge``           a brake against the reference; how large an error may be
``consequence``     the judge of pipelines of that kind; ``consequence_tables`` says what it found
==================  ==============================================================================

Import from the modules: they are kept apart so that nothing compiles before it is needed.
"""
