"""What each command of the command line does, one file a command.

The arguments of ``..._command`` are those of the command of that name, which ``sysid.workbench.command_line`` describes
to those who type it. A :class:`~sysid.errors.UserError` says what cannot be done as it was asked. What comes back, if
anything, is the exit code: 0, or 1 if everything is done and stored but something could not be tracked.
"""
