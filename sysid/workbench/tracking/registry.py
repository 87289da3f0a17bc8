"""Tracked models under names that last: every exported fit a new version, two of which have names of their own.

``candidate`` is the newest export, set by every run; ``champion`` is the one in use, set by a person with ``sysid
promote``. Whoever loads ``models:/<name>@champion`` gets what was last promoted, without a change of their own.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from sysid.errors import ConfigError
from sysid.names import read_sides, slug, told_apart

CANDIDATE = "candidate"
CHAMPION = "champion"


@dataclass(frozen=True, kw_only=True)
class Promotion:
    """What a promotion changed.

    Args:
        name: Name of the registered model.
        version: The version that is the champion now.
        before: The one that was, if any.
        fit: Name of the fit that it comes from.
        run_id: The run that tracks it.
    """

    name: str
    version: str
    before: str | None
    fit: str
    run_id: str

    @property
    def uri(self) -> str:
        """What loads it, now and after the next promotion."""
        return f"models:/{self.name}@{CHAMPION}"


def registered_name(mapping: str) -> str:
    """The name of a mapping's models in the registry, which takes neither slashes nor colons.

    Args:
        mapping: For example ``"BP+AR -> BC"``.

    Returns:
        The name.

    Example:
        >>> registered_name("BP+AR -> BC")
        'bp-ar-to-bc'
    """
    sides = read_sides(mapping)
    fitted = "-to-".join(slug("+".join(side)) for side in sides)
    return told_apart(fitted, [name for side in sides for name in side])


def parsed(address: str) -> tuple[str, str | None, str | None]:
    """The parts of a registered model's address.

    Args:
        address: ``models:/<name>@<alias>`` or ``models:/<name>/<version>``.

    Returns:
        Name, alias and version; one of the latter two is ``None``.

    Raises:
        ConfigError: If it is no such address.

    Example:
        >>> parsed("models:/level@champion"), parsed("models:/level/3")
        (('level', 'champion', None), ('level', None, '3'))
    """
    found = re.fullmatch(r"models:/([^/@]+)(?:@([^/@]+)|/([0-9]+))", address)
    if found is None:
        raise ConfigError(
            "not the address of a registered model",
            expected="models:/<name>@<alias> or models:/<name>/<version>",
            got=address,
            remedy="write for example models:/level@champion",
        )
    return found.group(1), found.group(2), found.group(3)


def register(
    client: Any, mapping: str, *, source: str, run_id: str, model_id: str | None, fit: str, description: str = ""
) -> str:
    """Make a tracked model the newest version of its mapping, and the candidate.

    Args:
        client: An ``MlflowClient``.
        mapping: The mapping.
        source: Where the logged model lies.
        run_id: The run that logged it.
        model_id: Its identifier among logged models.
        fit: Name of the fit.
        description: What the version is, in some sentences.

    Returns:
        The version.
    """
    name = registered_name(mapping)
    if not _found(client, name):
        client.create_registered_model(name, description=f"Exported surrogates of {mapping}.")
    made = client.create_model_version(
        name, source, run_id=run_id, model_id=model_id, tags={"fit": fit}, description=description or None
    )
    version = made.version
    client.set_registered_model_alias(name, CANDIDATE, version)
    return str(version)


def promote(client: Any, name: str, version: str | None = None) -> Promotion:
    """Make a version the champion.

    Args:
        client: An ``MlflowClient``.
        name: Name of the registered model, its mapping, or the pipeline or run that exported it.
        version: The version; by default the candidate, of a pipeline or run the newest that it exported.

    Returns:
        What changed.

    Raises:
        ConfigError: If there is no such model or version.
    """
    known = {model.name: model for model in client.search_registered_models()}
    model = known.get(name) or known.get(registered_name(name))
    if model is None and (of_run := _of_run(client, name)) is not None:
        model, version = known[of_run.name], version or str(of_run.version)
    if model is None:
        raise ConfigError(
            "there is no such model in the registry",
            expected=f"one of {', '.join(sorted(known))}, or a pipeline or run that exported one of them"
            if known
            else "a model registered by sysid run with an export",
            got=name,
            remedy="run a pipeline that exports, or correct the name",
        )
    versions = {str(one.version): one for one in client.search_model_versions(f"name = '{model.name}'")}
    aliases = {alias: str(number) for alias, number in model.aliases.items()}
    chosen = version or aliases.get(CANDIDATE)
    if chosen not in versions:
        raise ConfigError(
            f"the model {model.name} has no such version",
            expected=f"one of {', '.join(sorted(versions, key=int))}",
            got=chosen or f"no version, and none is the {CANDIDATE}",
            remedy="give one of them with --version",
        )
    client.set_registered_model_alias(model.name, CHAMPION, chosen)
    found = versions[chosen]
    fit = found.tags.get("fit", "")
    return Promotion(name=model.name, version=chosen, before=aliases.get(CHAMPION), fit=fit, run_id=str(found.run_id))


def _of_run(client: Any, name: str) -> Any:
    """The newest version that a pipeline exported, or a run of one; ``None`` where there is none.

    Args:
        client: An ``MlflowClient``.
        name: The pipeline's name, the run's, or MLflow's identifier of the run.

    Returns:
        The version of a registered model.

    Raises:
        ConfigError: If it exported several models.
    """
    found = []
    for one in client.search_model_versions():
        tags = client.get_run(one.run_id).data.tags if one.run_id else {}
        if name in {one.run_id, tags.get("pipeline"), tags.get("pipeline_run")} - {None}:
            found.append(one)
    names = sorted({one.name for one in found})
    if len(names) > 1:
        raise ConfigError(
            f"{name} exported several models",
            expected=f"one of {', '.join(names)}",
            got=name,
            remedy="name the model in place of what exported it",
        )
    return max(found, key=lambda one: int(one.version), default=None)


def _found(client: Any, name: str) -> bool:
    return any(model.name == name for model in client.search_registered_models(f"name = '{name}'"))
