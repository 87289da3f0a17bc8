"""Pipelines of tests, which are in no file."""

from sysid.field_checks import check
from sysid.workbench.fits.config import PipelineConfig
from sysid.yaml_files import parse_yaml


def parse_pipeline(text: str, *, where: object = "text") -> PipelineConfig:
    return check(PipelineConfig, parse_yaml(text, where=where), where=where)
