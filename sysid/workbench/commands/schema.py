"""``sysid schema``: what editors need to complete and check the YAML, and programs to read results.json."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from sysid.workbench.runner.console import console
from sysid.workbench.schemas import write_schemas


def schema_command(folder: Path) -> None:
    """Write the schemas of data sets and pipelines into a workspace, in place of older ones."""
    for file in write_schemas(folder):
        console().print(f"Wrote {file}", soft_wrap=True)


def print_results_schema() -> None:
    """Print the JSON schema of results.json, for a pipe or a file."""
    from sysid.reporting import results_json_schema

    sys.stdout.write(json.dumps(results_json_schema(), indent=1) + "\n")
