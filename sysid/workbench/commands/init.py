"""``sysid init``: a workspace to begin with."""

from __future__ import annotations

from pathlib import Path

from sysid.references.described import Wish
from sysid.references.sources import source_of
from sysid.workbench.runner.console import console
from sysid.workbench.surrogates.asked import no_options
from sysid.workbench.workspace import make_workspace


def init_command(folder: Path, *, reference: str | None, wish: Wish) -> None:
    """Make a workspace and say what to do next; a reference is read, not run."""
    target = console()
    if reference is None:
        no_options(wish, "the command line", "there is no --reference that ports and times could be of")
        files, commands = make_workspace(folder), ["sysid run tank", "sysid ui"]
    else:
        from sysid.workbench.surrogates.begun import make_reference_workspace

        files, name, notes = make_reference_workspace(folder, source_of(reference), wish)
        commands = [f"sysid run {name} --dry-run", f"sysid surrogate {name} --minutes 60"]
        for note in notes:
            target.print(note, soft_wrap=True, markup=False)
    here = folder.resolve() == Path.cwd()
    target.print(f"Made {len(files)} files {'here' if here else f'in {folder}'}. Next:", soft_wrap=True)
    ways = commands if here else [f"cd {folder}", *commands]
    target.print("\n".join(f"  {one}" for one in ways), soft_wrap=True, markup=False)
