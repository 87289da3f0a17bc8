"""The workspace of two tanks that assemblies are run in."""

from tests.workbench.assembly.conftest import workspace

__all__ = ["workspace"]
