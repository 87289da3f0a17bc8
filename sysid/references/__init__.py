"""Slow models that can be asked for more data: FMUs, Python functions, external programs.

**A reference is code.** An FMU holds a compiled library and a program is a program: both run with your rights. Only
what a pipeline or a command names is run, never something that is found beside it.

=============  =====================================================================================
``config``     what a reference is, as it stands in YAML: its ports, sample time and limits
``kinds``      the table of kinds: what loads each
``worker``     the process that a reference runs in
``runs``       many runs at once, each with its own time limit, kept by their content
``design``     which experiments to run: excitations within ranges, parameters spread over theirs
``events``     departures from the start as an excitation
``candidates`` new experiments, round by round, for active learning
``described``  what an FMU's model description proposes
``guessed``    how far an input of an FMU may move where its description does not say: a guess
``hysteresis`` one of our own: the oscillator of Bouc and Wen
=============  =====================================================================================

Nothing is imported here: the process that a reference runs in needs little of it.
"""
