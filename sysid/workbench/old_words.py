"""Words of the release before: read for one release, with a word about the new one.

A group of fields that has renamed some says so in :attr:`Words.OLD`; everything else happens here.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, model_validator

from sysid.field_checks import FieldError

STRICT = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)
"""A field that is not known is an error; nothing changes once it is read."""

TRAINING = {
    "prelude": "pretraining",
    "prelude_iterations": "pretraining_iterations",
    "committee": "ensemble",
    "leave_out": "input_subsets",
}
"""Options of a network's training."""

TRAINING_VALUES = {"basis": {"levels and rates": "incremental"}}
"""Values of a network's training that are words."""

JOINT_TRAINING = {"looks": "checkpoints", "soft_margin": "robust_scale"}
"""Options of training several models as one."""

ASSEMBLY = {
    "known": "fixed",
    "begin": "warm_start",
    "grow": "active_learning",
    "line": "interpolation",
    "stress": "monte_carlo",
    "lessons": "ablation",
}
"""Parts of a pipeline of kind ``assembly``."""


class OldWordWarning(FutureWarning):
    """A word that the next release no longer reads."""


class Words(BaseModel):
    """A group of fields that still reads their old names."""

    model_config = STRICT

    OLD: ClassVar[Mapping[str, str]] = {}
    """New name of each old one."""

    OLD_VALUES: ClassVar[Mapping[str, Mapping[str, str]]] = {}
    """New value of each old one, by the new name of the field."""

    @model_validator(mode="before")
    @classmethod
    def _read_old_words(cls, data: Any) -> Any:
        return with_new_values(with_new_words(data, cls.OLD), cls.OLD_VALUES)


def with_new_words(data: Any, old: Mapping[str, str]) -> Any:
    """The same fields under their new names; each old one is told once, as a warning.

    Args:
        data: Fields by name; what is no mapping is given back as it is.
        old: New name of each old one.

    Returns:
        A mapping with new names alone.

    Raises:
        FieldError: If a field stands there under both of its names.

    Example:
        >>> with_new_words({"seed": 1}, {"sead": "seed"})
        {'seed': 1}
    """
    if not isinstance(data, Mapping) or not any(word in data for word in old):
        return data
    both = [(word, new) for word, new in old.items() if word in data and new in data]
    if both:
        raise FieldError(
            f"{both[0][1]} stands there under its old name too",
            expected=both[0][1],
            got=" and ".join(both[0]),
            remedy=f"take {both[0][0]} out",
        )
    for word in old:
        if word in data:
            tell_old_word(word, old[word])
    return {old.get(key, key) if isinstance(key, str) else key: value for key, value in data.items()}


def with_new_values(data: Any, old: Mapping[str, Mapping[str, str]]) -> Any:
    """The same fields with their new values; each old one is told once, as a warning.

    Args:
        data: Fields by name; what is no mapping is given back as it is.
        old: New value of each old one, by field.

    Returns:
        A mapping with new values alone.

    Example:
        >>> with_new_values({"basis": "plain"}, {"basis": {"flat": "plain"}})
        {'basis': 'plain'}
    """
    if not isinstance(data, Mapping):
        return data
    renamed: dict[str, str] = {}
    for field, values in old.items():
        value = data.get(field)
        if isinstance(value, str) and value in values:
            tell_old_word(value, values[value])
            renamed[field] = values[value]
    return {**data, **renamed} if renamed else data


def tell_old_word(old: str, new: str) -> None:
    """A warning about a word of the release before.

    Args:
        old: The word.
        new: What it is called now.
    """
    warnings.warn(
        f"{old} is called {new} now; the next release no longer reads the old word", OldWordWarning, stacklevel=3
    )
