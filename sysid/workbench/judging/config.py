"""The YAML of a pipeline that judges: which models, by which judge, with which options."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from sysid.field_checks import FieldError, FolderName
from sysid.workbench.old_words import STRICT


class PartConfig(BaseModel):
    """One model, from where it lies: give one of ``run``, ``bundle``, ``model`` and ``line``.

    Args:
        run: A pipeline that was run, by name, or its run folder.
        fit: Name of a fit of that run, or ``best``.
        bundle: Folder or zip of an exported model.
        model: A registered model, such as ``models:/level@champion``.
        line: Folder with the ``line.json`` that an assembly with ``interpolation`` leaves: ``reports/whole-train``.
        options: What the judge wants to know of it.
    """

    model_config = STRICT

    run: str | None = None
    fit: str = "best"
    bundle: str | None = None
    model: str | None = None
    line: str | None = None
    options: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one(self) -> PartConfig:
        given = [name for name in ("run", "bundle", "model", "line") if getattr(self, name) is not None]
        if len(given) != 1 or (self.fit != "best" and self.run is None):
            raise FieldError(
                "it is not said where a model lies",
                expected="one of run (with fit), bundle, model and line",
                got=", ".join(given) or "none of them",
                remedy="write for example {run: tank, fit: best}",
            )
        return self


def _either_form(schema: dict[str, Any]) -> None:
    """A single part may be written without the word parts, and an editor shall not mark it."""
    schema.update(required=["name"], additionalProperties=True)


class SubjectConfig(BaseModel):
    """What is judged: one model, or several that are used together.

    Args:
        name: In tables.
        parts: The models; a single one can be written without the word parts.
    """

    model_config = ConfigDict(**STRICT, json_schema_extra=_either_form)

    name: str = Field(min_length=1)
    parts: tuple[PartConfig, ...] = Field(min_length=1)

    @model_validator(mode="before")
    @classmethod
    def _single(cls, value: Any) -> Any:
        if isinstance(value, dict) and "parts" not in value:
            rest = {key: entry for key, entry in value.items() if key != "name"}
            return {"name": value.get("name", ""), "parts": [rest]}
        return value


class JudgementConfig(BaseModel):
    """A pipeline that judges.

    Args:
        kind: Name of the judge.
        name: Name of the run folder; letters, digits, dots, dashes and underscores.
        description: What it is for.
        subjects: What is judged.
        options: The judge's own.
    """

    model_config = STRICT

    kind: str
    name: FolderName
    description: str = ""
    subjects: tuple[SubjectConfig, ...] = Field(min_length=1)
    options: dict[str, Any] = Field(default_factory=dict)

    @field_validator("subjects")
    @classmethod
    def _named(cls, subjects: tuple[SubjectConfig, ...]) -> tuple[SubjectConfig, ...]:
        names = [subject.name for subject in subjects]
        if len(set(names)) < len(names):
            raise FieldError(
                "two subjects have one name",
                expected="a name of its own for each",
                got=", ".join(names),
                remedy="rename one of them",
            )
        return subjects
