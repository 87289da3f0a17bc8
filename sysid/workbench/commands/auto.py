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
    """Search for a model and show how it came out; options that were not typed are ``None`` among those given."""
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
