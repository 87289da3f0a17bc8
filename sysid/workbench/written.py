"""A pipeline as it was read, of any kind: its fields, the text that they stand in, and where that is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Self, TypeVar

from pydantic import BaseModel

from sysid.atomic import write_bytes
from sysid.field_checks import check
from sysid.yaml_files import read_yaml

Config = TypeVar("Config", bound=BaseModel)


@dataclass(frozen=True, kw_only=True, eq=False)
class Written(Generic[Config]):
    """A pipeline and where it was read from.

    Args:
        config: The checked fields.
        text: The YAML as written.
        path: Its file, or the one that it would have.
    """

    config: Config
    text: str
    path: Path

    @classmethod
    def read(cls, kind: type[Config], path: Path) -> Self:
        """Read and check a pipeline.

        Args:
            kind: Its fields.
            path: Its YAML file.

        Returns:
            The pipeline.

        Raises:
            ConfigError: Naming the file, the field and what is wrong with it.
        """
        config = check(kind, read_yaml(path), where=path)
        return cls(config=config, text=path.read_text(encoding="utf-8-sig"), path=path.resolve())

    def keep(self, folder: Path) -> None:
        """Write down what is run.

        Args:
            folder: The run folder.
        """
        write_bytes(folder / "pipeline.yaml", self.text.encode())
