"""The command line: thin commands that import what they need when they need it.

Exit codes: 0 done, 2 the user's input has to change, 1 ours (a bug, a failed check, or results that are
complete but could not be tracked), 130 stopped by the user (Ctrl-C), 143 ended by SIGTERM, 129 by SIGHUP.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sysid.compilation import tell_of_compiling
from sysid.errors import SysidError
from sysid.workbench.command_line import models, pipelines, records, surrogates, workspaces

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

app = typer.Typer(
    name="sysid",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
for panel, room in {
    "From a record": records,
    "From a pipeline": pipelines,
    "From a slow model": surrogates,
    "With a frozen model": models,
    "Around it": workspaces,
}.items():
    for command in room.commands.registered_commands:
        command.rich_help_panel = panel
        app.registered_commands.append(command)

STOPPED = 130
"""Exit code of who was stopped by Ctrl-C, as a shell has it: 128 and the signal's number."""

RESUMED = ("run", "sweep", "auto", "surrogate")
"""What keeps what is done, and goes on there; of any other command a second one begins anew."""


COMPILING = (
    "note: compiling what computes. It is kept: only the first commands after an installation wait for it, up to half "
    "a minute"
)
"""What a person at a terminal is told, who would wait without a word."""


class _EndedError(SystemExit):
    """Asked to end by the system. No fit takes it for Ctrl-C, which would only end the fit.

    Args:
        signal_number: Of the signal.
    """

    def __init__(self, signal_number: int) -> None:
        super().__init__(128 + signal_number)
        self.exit_code = 128 + signal_number


def main() -> None:
    """Entry point of the command ``sysid``."""
    try:
        _end_in_order()
        code = run_cli(sys.argv[1:])
    except KeyboardInterrupt:  # the second one, while the first was being told
        code = STOPPED
    # A further Ctrl-C meets an interpreter that is already leaving, and would end it with a trace.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(code)


def run_cli(arguments: list[str]) -> int:
    """Run a command and turn what it raises into words and an exit code.

    Args:
        arguments: The words after ``sysid``.

    Returns:
        The exit code.
    """
    # Wherever it stands, as people add it to the end of the command that failed.
    debug = "--debug" in arguments
    from sysid.workbench.runner.console import speak_plainly

    speak_plainly()
    if sys.stderr.isatty():
        tell_of_compiling(lambda: _say(COMPILING))
    with warnings.catch_warnings():
        warnings.showwarning = _note
        warnings.simplefilter("default", FutureWarning)  # once each, whatever the caller's filters say
        return _run(arguments, debug=debug)


def _end_in_order() -> None:
    """A signal that ends the process unwinds it: drafts are removed, workers ended, tracked runs closed.

    Batch systems, containers and ``timeout`` send one, and kill some seconds later. A second one ends it at once.
    """

    def end(number: int, _: object) -> None:
        signal.signal(number, signal.SIG_DFL)
        raise _EndedError(number)

    def dropped(lost: sys.UnraisableHookArgs) -> None:
        # Python drops what is raised while it cleans up (the callback of a weak reference): the signal is sent again.
        if not isinstance(lost.exc_value, _EndedError):
            sys.__unraisablehook__(lost)
            return
        number = lost.exc_value.exit_code - 128
        signal.signal(number, end)
        threading.Timer(0.01, os.kill, (os.getpid(), number)).start()

    sys.unraisablehook = dropped

    for name in ("SIGTERM", "SIGHUP"):
        known = getattr(signal, name, None)
        if known is not None and signal.getsignal(known) is signal.SIG_DFL:  # nohup's stays as it is
            signal.signal(known, end)


def _with_commands_of_fields(words: list[str]) -> None:
    """Add what installed packages bring, where a word is none of ours, or all are to be listed."""
    known = {command.name or "" for command in app.registered_commands} | {
        (command.callback.__name__ if command.callback else "").replace("_", "-") for command in app.registered_commands
    }
    first = next((word for word in words if not word.startswith("-")), None)
    if first in known:
        return
    from importlib.metadata import PackageNotFoundError, distribution

    from sysid.plugins import entry_points

    there = {group.name for group in app.registered_groups}
    found: Iterable[EntryPoint] = ()
    if first:
        found = entry_points("sysid.commands")
    else:
        # A list of all is wanted at once: to look through every installed package takes a tenth of its time.
        with suppress(PackageNotFoundError):
            found = distribution("sysid-workbench").entry_points.select(group="sysid.commands")
    for entry in found:
        if entry.name not in there and first in {None, entry.name}:
            app.add_typer(entry.load(), name=entry.name, rich_help_panel="Of one field")


def _note(message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning as a person reads it: what is warned of, without the line of ours that found it."""
    _say(f"note: {message}")


def _run(arguments: list[str], *, debug: bool) -> int:
    try:
        _with_commands_of_fields(arguments)
        code = app([word for word in arguments if word != "--debug"], prog_name="sysid", standalone_mode=False)
        # Some versions of Typer leave with the code of a keyboard's interruption in place of raising it.
        return _stopped(STOPPED, arguments) if code == STOPPED else code if isinstance(code, int) else 0
    except KeyboardInterrupt:
        return _stopped(STOPPED, arguments)
    except _EndedError as ended:
        return _stopped(ended.exit_code, arguments)
    except BrokenPipeError:
        # The reader of our output went away (sysid ... | head).
        return 0
    except SysidError as error:
        return _refuse(error, debug=debug)
    except Exception as error:  # noqa: BLE001 - the last line of defence: whatever it is, it is named and ends with a code
        return _unexpected(error, arguments, debug=debug)


def _stopped(code: int, arguments: list[str]) -> int:
    """Who ended it, and what the same command does next."""
    by = "stopped" if code == STOPPED else f"ended by {signal.Signals(code - 128).name}"
    again = "the same command without --fresh" if "--fresh" in arguments else "the same command"
    resumed = not {*RESUMED}.isdisjoint(arguments[:1])
    _say(f"{by}; {again} goes on where this one was" if resumed else f"{by}; {again} begins anew")
    return code


def _refuse(error: SysidError, *, debug: bool) -> int:
    """What has to change, in words; notes say what was being done."""
    if debug:
        _trace()
    notes = [f"\n  while:    {note}" for note in getattr(error, "__notes__", ())]
    _say(f"error: {error}{''.join(notes)}")
    return error.exit_code


def _unexpected(error: Exception, arguments: list[str], *, debug: bool) -> int:
    """A usage error, a refusal of the operating system, or a bug of ours, which alone shows its trace unasked."""
    from sysid.workbench.runner.faults import refusal

    if callable(getattr(error, "show", None)):
        return _usage(error, arguments, debug=debug)
    if type(error).__name__ == "Abort":
        return 130
    known = refusal(error)
    if known is not None:
        return _refuse(known, debug=debug)
    _trace()
    _say(f"error: this is a fault in sysid ({type(error).__name__}); please report it with the lines above")
    return 1


def _usage(error: Any, arguments: list[str], *, debug: bool) -> int:
    """A command line that cannot be understood, in the same form as every other error."""
    import shlex

    context = getattr(error, "ctx", None)
    command = context.command_path if context is not None else "sysid"
    if debug:
        _trace()
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
        return int(error.exit_code)
    usage = SysidError(
        error.format_message().rstrip("."),
        expected=context.get_usage().removeprefix("Usage: ") if context is not None else None,
        got=shlex.join(["sysid", *arguments]),
        remedy=f"see {command} --help",
    )
    _say(f"error: {usage}")
    return int(getattr(error, "exit_code", 2))


def _trace() -> None:
    import traceback

    _say(traceback.format_exc().rstrip())


def _say(text: str) -> None:
    from sysid.workbench.runner.console import say

    say(text)


def _version(asked: bool) -> None:
    if asked:
        import sysid

        typer.echo(f"sysid {sysid.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[bool, typer.Option("--debug", help="Show the full trace of an error.")] = False,
    __: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")] = False,
) -> None:
    """Measured records or a slow model in; a small, fast model of known accuracy out, as files that run elsewhere."""
