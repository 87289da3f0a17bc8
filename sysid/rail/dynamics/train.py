"""A train: vehicles in order, front first, and the couplers between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.rail.dynamics.coupler import Coupler
from sysid.rail.dynamics.vehicle import Davis, NotchCurves, Rigging, Shoe, Vehicle, diesel_electric, modified_davis
from sysid.yaml_files import read_yaml


@dataclass(frozen=True, kw_only=True, eq=False)
class Train:
    """Vehicles from front to rear.

    Args:
        vehicles: At least one.
        couplers: One between each two; a single one serves everywhere.
        name: For people.

    Raises:
        ConfigError: If there is no vehicle or the number of couplers does not fit.

    Example:
        >>> train = heavy_haul(pairs=50)
        >>> len(train.vehicles), round(train.mass / 1e3), round(train.length)
        (101, 12180, 993)
    """

    vehicles: tuple[Vehicle, ...]
    couplers: tuple[Coupler, ...] = field(default_factory=lambda: (Coupler(),))
    name: str = "train"

    def __post_init__(self) -> None:
        object.__setattr__(self, "vehicles", tuple(self.vehicles))
        object.__setattr__(self, "couplers", tuple(self.couplers))
        gaps = len(self.vehicles) - 1
        if gaps < 0 or len(self.couplers) not in {1, gaps}:
            raise ConfigError(
                "vehicles and couplers do not make a train",
                where=f"train {self.name}",
                expected=f"at least one vehicle, and one coupler or {max(gaps, 0)}",
                got=f"{len(self.vehicles)} vehicles and {len(self.couplers)} couplers",
                remedy="give one coupler for all, or one between each two vehicles",
            )

    @cached_property
    def masses(self) -> NDArray[np.float64]:
        """In kg, front first, shape ``(n,)``."""
        return np.array([vehicle.mass for vehicle in self.vehicles])

    @property
    def mass(self) -> float:
        """In kg."""
        return float(self.masses.sum())

    @cached_property
    def lengths(self) -> NDArray[np.float64]:
        """In m, front first, shape ``(n,)``."""
        return np.array([vehicle.length for vehicle in self.vehicles])

    @property
    def length(self) -> float:
        """In m, couplers at rest."""
        return float(self.lengths.sum())

    @cached_property
    def spacings(self) -> NDArray[np.float64]:
        """Distance of neighbouring centres at rest in m, shape ``(n - 1,)``."""
        return np.asarray(0.5 * (self.lengths[:-1] + self.lengths[1:]))

    @cached_property
    def offsets(self) -> NDArray[np.float64]:
        """How far each centre lies behind the first vehicle's in m, couplers at rest, shape ``(n,)``."""
        return np.concatenate([[0.0], np.cumsum(self.spacings)])

    def coupler(self, index: int) -> Coupler:
        """The coupler behind vehicle ``index`` (from 0)."""
        return self.couplers[0] if len(self.couplers) == 1 else self.couplers[index]

    @property
    def powered(self) -> tuple[int, ...]:
        """Indices (from 0) of the vehicles with notches."""
        return tuple(i for i, vehicle in enumerate(self.vehicles) if vehicle.notches is not None)


LOCOMOTIVE_MASS, WAGON_MASS, VEHICLE_LENGTH = 180e3, 120e3, 9.83
"""Of the example train. The pitch in m is Lvag + Lcti of the dissertation's Appendix C; the masses in kg are ours, of
the size of a heavy-haul train's."""


def locomotive(*, mass: float = LOCOMOTIVE_MASS, length: float = VEHICLE_LENGTH, **power: Any) -> Vehicle:
    """A six-axle diesel-electric locomotive whose air brake is bailed off.

    Args:
        mass: In kg.
        length: In m.
        power: Options of :func:`sysid.rail.dynamics.vehicle.diesel_electric`.

    Returns:
        The vehicle.
    """
    return Vehicle(
        mass=mass, length=length, davis=modified_davis(mass, 6), notches=diesel_electric(**power), name="locomotive"
    )


def wagon(*, mass: float = WAGON_MASS, length: float = VEHICLE_LENGTH, rigging: Rigging | None = None) -> Vehicle:
    """A four-axle wagon with one cylinder.

    Args:
        mass: In kg.
        length: In m.
        rigging: Its brake.

    Returns:
        The vehicle.
    """
    return Vehicle(mass=mass, length=length, davis=modified_davis(mass, 4), rigging=rigging or Rigging())


def heavy_haul(*, pairs: int = 50, locomotives: int = 1, mass: float = WAGON_MASS, name: str = "heavy haul") -> Train:
    """Wagon pairs behind locomotives: the mechanical side of ``sysid.airbrake.consist.Consist(pairs=...)``.

    Args:
        pairs: Number of wagon pairs.
        locomotives: Number at the front; the air brake's consist has one.
        mass: Of each wagon in kg.
        name: For people.

    Returns:
        The train.
    """
    return Train(vehicles=(*[locomotive()] * locomotives, *[wagon(mass=mass)] * (2 * pairs)), name=name)


POSSIBLE = {"mass": (500.0, 1e6, "kg", "tonnes times 1000"), "length": (1.0, 100.0, "m", "millimetres over 1000")}
"""Of one vehicle of a file (ours): from a trolley to the heaviest of wagons. What does not lie within was written in
another unit, or is a whole train."""


class _Group(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    count: int = Field(default=1, ge=1, le=500)
    name: str = "wagon"
    mass: float = Field(gt=0)
    length: float = Field(gt=0)
    axles: int = Field(default=4, ge=2, le=16)
    davis: tuple[float, float, float] | None = None
    brake: Literal["none"] | dict[str, float | dict[str, float]] = Field(default_factory=dict)
    power: dict[str, float] | None = None


class _TrainFile(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    name: str
    description: str = ""
    coupler: dict[str, float] = Field(default_factory=dict)
    vehicles: tuple[_Group, ...] = Field(min_length=1)


def _made(kind: Any, values: dict[str, Any], where: str) -> Any:
    try:
        return kind(**values)
    except TypeError as error:
        raise ConfigError(
            "a field is not known here",
            where=where,
            expected=f"fields of {kind.__name__}",
            got=", ".join(values),
            remedy=str(error),
        ) from None


def _check_possible(group: _Group, where: str) -> None:
    for name, (least, most, unit, instead) in POSSIBLE.items():
        if not least <= (value := getattr(group, name)) <= most:
            raise ConfigError(
                f"no vehicle has such a {name}",
                where=f"{where}, {name}",
                expected=f"{least:g} to {most:,.0f} {unit}, of one vehicle",
                got=f"{value:g} {unit}",
                remedy=f"write {instead}; count says how many vehicles there are",
            )


def _rigging(group: _Group, where: str) -> Rigging | None:
    if group.brake == "none":
        return None
    values = dict(group.brake)
    shoe = values.pop("shoe", {})
    if not isinstance(shoe, dict):
        raise ConfigError("the shoe is not described", where=where, expected="fields of Shoe", got=shoe)
    return _made(Rigging, {**values, "shoe": _made(Shoe, shoe, where)}, where)  # type: ignore[no-any-return]


def _notches(group: _Group, where: str) -> NotchCurves | None:
    if group.power is None:
        return None
    values: dict[str, Any] = dict(group.power)
    if float(values.get("notches", 0.5)).is_integer():
        values["notches"] = int(values["notches"])
    return _made(diesel_electric, values, where)  # type: ignore[no-any-return]


def read_train(path: Path) -> Train:
    """Read a train from YAML.

    Args:
        path: A file with ``name``, ``coupler`` (fields of :class:`Coupler`) and ``vehicles``: groups, front first, with
            ``count``, ``mass`` (kg), ``length`` (m), ``axles`` or ``davis`` [a, b, c], ``brake`` (fields of
            :class:`Rigging`, or ``none``) and ``power`` (arguments of :func:`diesel_electric`). Masses and lengths
            have to be :data:`POSSIBLE` ones.

    Returns:
        The train.

    Raises:
        ConfigError: If the file cannot be read or a value cannot be used.
    """
    file = check(_TrainFile, read_yaml(path), where=path)
    vehicles: list[Vehicle] = []
    for group in file.vehicles:
        where = f"{path}, vehicles, {group.name}"
        _check_possible(group, where)
        if group.davis is None:
            davis = modified_davis(group.mass, group.axles)
        else:
            davis = Davis(a=group.davis[0], b=group.davis[1], c=group.davis[2])
        vehicle = Vehicle(
            mass=group.mass,
            length=group.length,
            davis=davis,
            rigging=_rigging(group, where),
            notches=_notches(group, where),
            name=group.name,
        )
        vehicles += [vehicle] * group.count
    coupler = _made(Coupler, dict(file.coupler), f"{path}, coupler")
    return Train(vehicles=tuple(vehicles), couplers=(coupler,), name=file.name)
