"""``sysid auto``: a search for a model, with everybody who listens to it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sysid.api.fitting import load
from sysid.api.looking import mapping_of
from sysid.field_checks import check
from sysid.names import slug
from sysid.workbench.auto.config import AutoConfig
from sysid.workbench.auto.finish import finish_s, time_told
from sysid.workbench.auto.run import auto_of, program_of
from sysid.workbench.commands.simulate import parse_start
from sysid.workbench.fits.data import data_of
from sysid.workbench.kinds import RunRequest
from sysid.workbench.listeners import perform
from sysid.workbench.runner.console import console


def auto_command(source: str, *, given: Mapping[str, Any], fresh: bool, out: Path | None, tracking: bool) -> int:
    """Search for a model and show how it came out.

    Args:
        source: A data set's name or path, or a file with traces.
        given: Options of the search as they were typed; ``None`` for what was not.
        fresh: Do everything again.
        out: The run folder.
        tracking: Whether trials are tracked in MLflow.

    Returns:
        Exit code: 0, or 1 if everything is done and stored but something could not be tracked.

    Raises:
        UserError: If the data cannot be read, the mapping is missing or wrong, or nothing that was tried can be used.
    """
    traces = load(source)
    options = {name: value for name, value in given.items() if value is not None}
    options["mapping"] = mapping_of(traces, options.get("mapping"), option="--mapping ")
    if "start" in options:
        options["start"] = parse_start(options["start"])
    name = f"auto-{slug(traces.name)}"
    config = check(AutoConfig, {"kind": "auto", "name": name, "data": source, **options}, where="sysid auto")
    data = data_of(traces, config.mapping)
    if config.wall_s is not None:
        finish = finish_s(len(data.traces), len(config.mapping.outputs), config.wall_s)
        console().print(time_told(config.wall_s, finish), soft_wrap=True, markup=False)
    words = [word for key, value in given.items() if value is not None for word in (f"--{key}", str(value))]
    request = RunRequest(path=Path(source), typed=source, options=tuple(words), fresh=fresh, out=out, tracking=tracking)
    return perform(program_of(auto_of(config, load=lambda: data), verb="auto"), request)
