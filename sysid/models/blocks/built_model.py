"""Models of structures that become equations: they run, and are exported, as the grey box that was built of them."""

from __future__ import annotations

import re
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from typing import Any

from sysid.models.blocks.block_oriented import HammersteinWiener, WienerHammerstein
from sysid.models.blocks.polynomial_narx import PolynomialNARX
from sysid.models.grey_box.grey_box import GreyBox
from sysid.models.grey_box.grey_box_model import GreyBoxModel
from sysid.models.orders.structure import AbstractStructure

BUILT: tuple[type[AbstractStructure], ...] = (HammersteinWiener, WienerHammerstein, PolynomialNARX)
"""Structures that become equations when they are fitted."""


@dataclass(frozen=True, kw_only=True, eq=False)
class BuiltModel(GreyBoxModel):
    """A fitted model of such a structure; its other fields are those of :class:`GreyBoxModel`.

    Args:
        built_of: The structure that was asked for.
    """

    built_of: AbstractStructure

    structure_field = "built_of"

    @property
    def structure(self) -> AbstractStructure:  # type: ignore[override]  # any that becomes equations
        """What was asked for."""
        return self.built_of

    @property
    def equations(self) -> str:
        """The equations with the numbers that were found, for people; weights of networks are not among them."""
        text = self.grey.equations
        for name in sorted(self.parameters, key=len, reverse=True):
            text = _with_number(text, name, self.parameters[name])
        return text

    def _written(self) -> dict[str, Any]:
        return super()._written() | {"equations": self.grey.to_dict()}

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        equations = {key: value for key, value in fields["equations"].items() if key != "kind"}
        return GreyBoxModel._read(fields) | {"grey": GreyBox(**equations)}


def _with_number(text: str, name: str, value: float) -> str:
    return re.sub(rf'(?<![\w"]){re.escape(name)}(?![\w"\[])', f"{value:.6g}" if value >= 0 else f"({value:.6g})", text)
