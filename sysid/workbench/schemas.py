"""JSON schemas of the YAML that people write, so that editors complete and check it while they type."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sysid.atomic import replacing

DRAFT = "https://json-schema.org/draft/2020-12/schema"
PIPELINE_FILE = Path("pipelines/pipeline.schema.json")
DATASET_FILE = Path("datasets/dataset.schema.json")


def pipeline_schema() -> dict[str, Any]:
    """The schema of a pipeline of any kind; a file without a ``kind`` is one of fits.

    Returns:
        The schema, draft 2020-12.
    """
    from pydantic.json_schema import models_json_schema

    from sysid.workbench.kinds import DEFAULT, kinds

    configs = {name: kind.load_config() for name, kind in kinds().items()}
    references, definitions = models_json_schema([(config, "validation") for config in configs.values()])
    found = {name: references[config, "validation"] for name, config in configs.items()}
    choices = [
        {"if": {"properties": {"kind": {"const": name}}, "required": ["kind"]}, "then": reference}
        for name, reference in found.items()
        if name != DEFAULT
    ]
    default = {"if": {"properties": {"kind": {"const": DEFAULT}}}, "then": found[DEFAULT]}
    return {
        "$schema": DRAFT,
        "title": "A pipeline",
        "type": "object",
        "properties": {"kind": {"enum": list(configs)}},
        "allOf": [default, *choices],
        "$defs": definitions["$defs"],
    }


def dataset_schema() -> dict[str, Any]:
    """The schema of a ``dataset.yaml``.

    Returns:
        The schema, draft 2020-12.

    Example:
        >>> dataset_schema()["required"]
        ['name', 'sample_time', 'channels', 'source', 'cases']
    """
    from sysid.ingest import DatasetDescription

    return {"$schema": DRAFT, **DatasetDescription.model_json_schema()}


def write_schemas(workspace: Path) -> list[Path]:
    """Write both schemas where the first line of a workspace's files looks for them.

    Args:
        workspace: The workspace.

    Returns:
        The files.
    """
    schemas = {PIPELINE_FILE: pipeline_schema(), DATASET_FILE: dataset_schema()}
    for name, schema in schemas.items():
        with replacing(workspace / name) as draft:
            draft.write_text(json.dumps(schema, indent=1) + "\n", encoding="utf-8")
    return [workspace / name for name in schemas]


def schema_line(file: Path) -> str:
    """The comment that tells an editor where a file's schema is, if one lies in the folder above.

    Args:
        file: A YAML file in a folder of ``datasets/``.

    Returns:
        The line with its end, or nothing.
    """
    found = file.resolve().parent.parent / DATASET_FILE.name
    return f"# yaml-language-server: $schema=../{DATASET_FILE.name}\n" if found.is_file() else ""
