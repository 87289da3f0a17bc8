"""What is said of a record of several outputs: one result an output."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from sysid.api.notebook import html_of
from sysid.errors import ConfigError

if TYPE_CHECKING:
    import pandas as pd

One = TypeVar("One")


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PerOutput(Generic[One]):
    """The same of every output; printed, one after the other.

    Args:
        outputs: The results, by output.
    """

    outputs: Mapping[str, One]

    def __getitem__(self, output: str) -> One:
        """What was found of an output.

        Args:
            output: Its name.

        Returns:
            The result.

        Raises:
            ConfigError: If it is none of the outputs.
        """
        if output not in self.outputs:
            raise ConfigError.unknown(f"there is no output {output}", str(output), self.outputs, "name one of them")
        return self.outputs[output]

    def __str__(self) -> str:
        return "\n\n".join(map(str, self.outputs.values()))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return html_of(self)


class _Framed(Protocol):
    def to_frame(self) -> pd.DataFrame:
        """A table."""


def framed(outputs: Mapping[str, _Framed]) -> pd.DataFrame:
    """The tables of all outputs as one.

    Args:
        outputs: What has a table, by output.

    Returns:
        The columns that they have, after ``output``.
    """
    import pandas as pd

    frames = [one.to_frame() for one in outputs.values()]
    for name, frame in zip(outputs, frames, strict=True):
        frame.insert(0, "output", name)
    return pd.concat(frames, ignore_index=True)
