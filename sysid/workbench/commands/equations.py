"""``sysid equations``: what is fixed in an assembly, as equations."""

from __future__ import annotations

import sys

from sysid.errors import ConfigError
from sysid.workbench.fits.config import find_pipeline
from sysid.workbench.kinds import DEFAULT


def equations_command(pipeline: str) -> None:
    """Print the fixed submodels of an assembly as equations, for a pipe or its YAML file."""
    from sysid.field_checks import check
    from sysid.workbench.assembly.config import AssemblyConfig
    from sysid.workbench.assembly.extending import read_joined
    from sysid.workbench.assembly.fixed_words import equations_text

    path = find_pipeline(pipeline)
    joined = read_joined(path)
    kind = joined.data.get("kind", DEFAULT)
    declared = check(AssemblyConfig, joined.data, where=joined.origins).composite.fixed if kind == "assembly" else ()
    fixed = [one for one in declared if not one.bounds]  # what limits says stands there
    if not fixed:
        raise ConfigError(
            "nothing is fixed in the pipeline",
            where=path,
            expected="a pipeline of kind assembly with fixed",
            got="fixed: none" if kind == "assembly" else f"kind: {kind}",
            remedy="name an assembly, and add what is known to it: docs/assemblies/known.md",
        )
    sys.stdout.write(equations_text(fixed))
