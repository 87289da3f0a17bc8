"""What a whole is made of, stage by stage, in words for the report."""

from __future__ import annotations

from collections.abc import Mapping

from sysid.composite import Composite
from sysid.models import Cascade, Ends


def written(composite: Composite, stages: Mapping[str, Cascade]) -> dict[str, list[str]]:
    """What the whole is made of, stage by stage: its networks, where they are others than in the stage before.

    What is fixed stands in the pipeline, and is the same in all stages: it is counted.

    Args:
        composite: What is declared.
        stages: The whole after each stage.

    Returns:
        Of each stage its networks, each with what it reads and its structure, and how many other members there are.
    """
    found, before = {}, dict[str, str]()
    for stage, whole in stages.items():
        now = _members_written(composite, whole)
        if now.keys() != before.keys():
            found[stage] = list(now.values())
        else:
            others = [said for name, said in now.items() if said != before[name]]
            found[stage] = [*others, "the rest as before"] if others else ["all as before"]
        before = now
    return found


def _members_written(composite: Composite, whole: Cascade) -> dict[str, str]:
    """Each network by its output, and how many members are declared."""
    networks = {name for one in composite.members for name in one.outputs}
    declared = len({name for one in composite.fixed for name in one.outputs} & set(whole.outputs))
    found = {}
    for model in whole.models:
        name = Ends.of(model).outputs[0]
        if name in networks:
            found[name] = f"{model.mapping}: {model.structure.label}"
    if declared:
        said = "that the pipeline declares"
        found[said] = f"and {declared} {said}"
    return found
