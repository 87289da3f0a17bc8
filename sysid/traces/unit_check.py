"""Whether a record is in the units in which it is read."""

from __future__ import annotations

from collections.abc import Mapping

from sysid.errors import ConfigError
from sysid.traces.trace import Trace
from sysid.units import is_same_unit


def check_units(units: Mapping[str, str], trace: Trace) -> None:
    """Refuse a record whose numbers would be taken for others.

    Args:
        units: The unit of each channel that is read, of which the record may lack some.
        trace: The record.

    Raises:
        ConfigError: If a channel is in another unit.
    """
    there = {channel.name: channel.unit for channel in trace.channels}
    for name, unit in units.items():
        if name in there and not is_same_unit(there[name], unit):
            raise ConfigError(
                "the record has a channel in another unit than the model",
                where=f"trace {trace.name}, channel {name}",
                expected=unit,
                got=there[name],
                remedy=f"read it in {unit}: the channel's unit in a dataset.yaml converts it; sysid.data takes numbers "
                f"as they are, so bring them to {unit} first and say units={{{name!r}: {unit!r}}}",
            )
