"""Process models as they are asked for: a type for each input, and what is known of its parameters."""

from __future__ import annotations

import re
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from sysid.errors import ConfigError
from sysid.models.channels.mapping import Mapping
from sysid.models.grey_box.declared import Parameter, parameters_from
from sysid.models.orders.lags import per_input
from sysid.models.orders.ranges import Among
from sysid.models.orders.structure import AbstractStructure
from sysid.models.process.process_type import DEAD_TIME, GAIN, ZERO, ProcessType

_OF_INPUT = re.compile(r"(\w+)\((.+)\)")
USUAL = ("P1D", "P1DZ", "P2D", "P2DZ", "P2DU", "P2DZU", "P3D", "P1DI", "P2DI")


@dataclass(frozen=True, kw_only=True)
class ProcessModel(AbstractStructure):
    r"""A process model, as MATLAB's ``idproc`` and ``procest``: gain, time constants and dead time of each input.

    .. math:: K \frac{1 + T_z s}{s\,(1 + T_{p1} s)(1 + T_{p2} s)(1 + T_{p3} s)}\, e^{-T_d s}

    The letters of the type say what there is: ``P1`` to ``P3`` the poles beside an integrator, ``D`` the dead time,
    ``Z`` the zero, ``I`` the integrator, and ``U`` a pair that may swing, :math:`1 + 2 \zeta T_w s + (T_w s)^2`, in
    place of the first two poles. Times are in seconds; the dead time need not be a whole number of samples.

    Args:
        type: The type, such as ``P1D``, ``P2DU`` or ``P1DI``: one for each input, or one for all.
        parameters: What is known: by name the start, or ``{start:, low:, high:, fixed:, unit:}``. ``Tp1`` is that of
            every input that has one, ``Tp1(steam)`` that of one input. What is not named is found from the records.
        intercept: Fit a constant output beside them; of a plant that integrates, the level of its input at which the
            output stands.

    Raises:
        ConfigError: If a type is none, or a parameter is of no input.

    Example:
        >>> ProcessModel(type="P1D", parameters={"Td": {"start": 2, "fixed": True}}).label
        'P1D'
    """

    type: Annotated[tuple[str, ...] | str, Among(choices=USUAL)]
    parameters: tuple[Parameter, ...] | Dict[str, Any] = ()
    intercept: bool = True

    kind = "ProcessModel"
    per_input = ("type",)

    def __post_init__(self) -> None:
        types = tuple(ProcessType.parse(one) for one in per_input(self.type))
        if not types:
            raise ConfigError(
                "no type of process model", where="type", expected="P1D, or one for each input", got="none",
                remedy="write for example type: P1D",
            )  # fmt: skip
        object.__setattr__(self, "type", tuple(map(str, types)))
        object.__setattr__(self, "parameters", parameters_from(self.parameters))
        names = list(dict.fromkeys(name for one in types for name in one.names))
        for one in self.declared:
            self._check_parameter(one, names)

    def _check_parameter(self, one: Parameter, names: Sequence[str]) -> None:
        plain, _ = _name_of(one)
        where = f"parameters, {one.name}"
        if plain not in names:
            raise ConfigError.unknown(
                f"{plain} is no parameter of {self.label}", plain, names, "remove it", where="parameters"
            )
        if one.per is not None or one.prior is not None:
            raise ConfigError(
                "a process model has one value of each parameter, and no prior", where=where,
                expected="start, low, high, fixed, unit", got="per" if one.per else "prior",
                remedy="write the same as a grey box, which knows both",
            )  # fmt: skip
        least = -1.0 if plain in {GAIN, ZERO} else 0.0 if plain == DEAD_TIME else 1e-300
        if least >= 0.0 and not one.start >= least:
            raise ConfigError(
                f"{plain} is {'not negative' if least == 0.0 else 'above 0'}", where=where,
                expected="seconds", got=one.start, remedy="correct the start",
            )  # fmt: skip

    @property
    def declared(self) -> tuple[Parameter, ...]:
        """What is known of parameters, as it was written."""
        return self.parameters  # type: ignore[return-value]  # brought into this form when it was made

    @property
    def types(self) -> tuple[ProcessType, ...]:
        """The type of each input."""
        return tuple(map(ProcessType.parse, self.type))

    @property
    def label(self) -> str:
        """The types."""
        return " ".join(self.type)

    def known(self, name: str, of: str) -> Parameter | None:
        """What is known of a parameter.

        Args:
            name: Of the parameter.
            of: The input.

        Returns:
            What was said of that input, or of all; ``None`` where nothing was.
        """
        found = {_name_of(one): one for one in self.declared}
        return found.get((name, of)) or found.get((name, ""))

    def check_mapping(self, mapping: Mapping) -> None:
        """Refuse types that are not one for each input, and parameters of no input; see the base class."""
        super().check_mapping(mapping)
        types = self.types * (len(mapping.inputs) if len(self.type) == 1 else 1)
        own = dict(zip(mapping.inputs, types, strict=True))
        for one in self.declared:
            plain, of = _name_of(one)
            if of and of not in own:
                raise ConfigError.unknown(
                    f"{of} is no input of the mapping", of, mapping.inputs, "remove it", where="parameters"
                )
            if of and plain not in own[of].names:
                raise ConfigError.unknown(
                    f"{plain} is no parameter of {own[of]}", plain, own[of].names, "remove it", where="parameters"
                )

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "kind": self.kind,
            "type": list(self.type),
            "parameters": {one.name: one.to_dict() for one in self.declared},
            "intercept": self.intercept,
        }


def _name_of(one: Parameter) -> tuple[str, str]:
    """The parameter and the input that a name is of; the latter empty where it is of all."""
    found = _OF_INPUT.fullmatch(one.name)
    return (found[1], found[2]) if found else (one.name, "")


def shown(name: str, of: str, inputs: Sequence[str]) -> str:
    """What a parameter of an input is called: by its name alone where there is one input.

    Args:
        name: Of the parameter.
        of: The input.
        inputs: All inputs.

    Returns:
        The name.

    Example:
        >>> shown("K", "steam", ["steam"]), shown("K", "steam", ["steam", "feed"])
        ('K', 'K(steam)')
    """
    return name if len(inputs) == 1 else f"{name}({of})"
