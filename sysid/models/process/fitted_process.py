"""Fitted process models: a continuous transfer function that is known by gain, time constants and dead time."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from sysid.models.channels.history import History
from sysid.models.channels.scaling import Scaling
from sysid.models.converting import orthonormal_basis as bases
from sysid.models.converting.orthonormal_basis import Domain
from sysid.models.linear.transfer_function import TransferFunction, TransferFunctionModel
from sysid.models.process.process_run import run
from sysid.models.process.process_type import DAMPING, DEAD_TIME, GAIN, ProcessType
from sysid.models.process.structure import ProcessModel, shown

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class FittedProcess(TransferFunctionModel):
    """A fitted process model; its other fields are those of :class:`TransferFunctionModel`.

    Args:
        process: What was asked for.
        values: For each input the values of its parameters, in the order of its type's names, in the channels' units
            and seconds.
    """

    process: ProcessModel
    values: tuple[tuple[float, ...], ...]

    structure_field = "process"

    @classmethod
    def of(
        cls,
        process: ProcessModel,
        values: Sequence[Array],
        *,
        constant: float,
        level: Array,
        scaling: Scaling,
        **channels: Any,
    ) -> Self:
        """The model of some parameters.

        Args:
            process: The structure, a type for each input.
            values: Of each input.
            constant: Output without inputs, in its unit.
            level: Of each input the value that is counted from, in its unit: 0 but for what integrates.
            scaling: Whose scales are taken.
            channels: Mapping, sample time, units and output at rest.

        Returns:
            The model.
        """
        sample_time, types = channels["sample_time"], process.types
        form = Scaling(
            input_offset=tuple(map(float, level)), input_scale=scaling.input_scale,
            output_offset=constant, output_scale=scaling.output_scale,
        )  # fmt: skip
        sections = tuple(kind.sections(own) for kind, own in zip(types, values, strict=True))
        zeros = tuple(int(kind.zero) for kind in types)
        taps: list[Array] = []
        for kind, own, of, n, scale in zip(types, values, sections, zeros, form.input_scale, strict=True):
            rows = bases.numerators(bases.basis_of(of, n, Domain.CONTINUOUS))[:, : n + 1]
            own_taps = np.linalg.solve(rows.T, kind.polynomials(own)[0] * scale / form.output_scale)
            taps.append(np.asarray(own_taps, dtype=np.float64))
        late = tuple(
            int(np.ceil(kind.at(own, DEAD_TIME).real / sample_time - 1e-9))
            for kind, own in zip(types, values, strict=True)
        )
        return cls(
            orders=TransferFunction(
                poles=tuple(kind.order for kind in types), zeros=zeros, delays=late, domain=Domain.CONTINUOUS,
                intercept=process.intercept,
            ),
            sections=sections, taps=tuple(taps), constant=0.0, scaling=form, process=process,
            values=tuple(tuple(map(float, own)) for own in values), **channels,
        )  # fmt: skip

    @property
    def structure(self) -> ProcessModel:  # type: ignore[override]  # by which it is known
        """What was asked for."""
        return self.process

    @property
    def n_parameters(self) -> int:
        """Parameters that were not given, and the constant."""
        return sum(not self._fixed(name, of) for name, of, _ in self._named) + self.process.intercept

    @property
    def parameters(self) -> dict[str, float]:
        """Every parameter by its name, those that were given too: times in seconds, gains in the channels' units."""
        return {shown(name, of, self.mapping.inputs): value for name, of, value in self._named}

    @property
    def _named(self) -> list[tuple[str, str, float]]:
        rows = zip(self.process.types, self.mapping.inputs, self.values, strict=True)
        return [
            (name, of, value) for kind, of, own in rows for name, value in zip(kind.names, own, strict=True)
        ]  # fmt: skip

    def _fixed(self, name: str, of: str) -> bool:
        known = self.process.known(name, of)
        return known is not None and known.fixed

    def unit_of(self, name: str, j: int) -> str:
        """The unit of a parameter of one input.

        Args:
            name: Of the parameter.
            j: Which input.

        Returns:
            Output over input for the gain, for one that integrates per second; ``s`` for times; ``1`` for damping.
        """
        if name != GAIN:
            return "1" if name == DAMPING else "s"
        below = [self.input_units[j]] * (self.input_units[j] not in {"", "1"}) + ["s"] * self.process.types[
            j
        ].integrates
        return "/".join([self.output_unit or "1", *(f"({one})" if "/" in one or "*" in one else one for one in below)])

    @property
    def units(self) -> dict[str, str]:
        """By parameter its unit, with those of the constant and of the level of what integrates; ``1`` for none."""
        inputs = self.mapping.inputs
        found = {"constant": self.output_unit}
        for j, (kind, of, unit) in enumerate(zip(self.process.types, inputs, self.input_units, strict=True)):
            found |= {shown(name, of, inputs): self.unit_of(name, j) for name in kind.names}
            found[shown("level", of, inputs)] = unit
        return found

    def dead_time(self, j: int) -> float:
        """The dead time of an input in seconds.

        Args:
            j: Which input.

        Returns:
            The dead time.
        """
        return float(self.process.types[j].at(np.array(self.values[j]), DEAD_TIME).real)

    @property
    def delays(self) -> tuple[float, ...]:
        """Dead time of each input in samples, as it is."""
        return tuple(self.dead_time(j) / self.sample_time for j in range(len(self.values)))

    def output_moves(
        self,
        factor: Array,
        inputs: Array,
        history: History,
        measured: Array | None = None,  # noqa: ARG002 - one step ahead nothing is predicted
    ) -> Array:
        """How the free run moves with the parameters, then the constant or the level; see the base class."""
        before = len(history.output)
        u = np.concatenate([history.inputs, inputs]) - np.asarray(self.scaling.input_offset)
        found = []
        for j, (kind, values) in enumerate(zip(self.process.types, self.values, strict=True)):
            x, own = u[:, j], np.array(values)
            slopes = run(kind, own, x, x[0], self.sample_time).slopes
            if before > 1:  # what the output stood at is known, whatever the gain was
                slopes[:, 0] -= x[0] * (not kind.integrates)
            found.append(slopes)
        found.append(moves_of_level(self.process.types, self.values, len(u), self.sample_time))
        return np.asarray((np.concatenate(found, axis=1) @ factor)[before:])

    def _written(self) -> dict[str, Any]:
        orders = {key: value for key, value in self.orders.to_dict().items() if key != "kind"}
        return {**super()._written(), "orders": orders, "values": [list(own) for own in self.values]}

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return {
            **TransferFunctionModel._read(fields),
            "orders": TransferFunction(**fields["orders"]),
            "values": tuple(tuple(own) for own in fields["values"]),
        }


def moves_of_level(
    types: Sequence[ProcessType], values: Sequence[Sequence[float]], n: int, sample_time: float
) -> Array:
    """How the output moves with the constant; of what integrates with the level of its input that it stands at.

    Args:
        types: Of each input.
        values: Of each input.
        n: Samples.
        sample_time: Seconds.

    Returns:
        Shape ``(n, 1)``: what a constant does, or what the first input that integrates does with a level above 0.
    """
    for kind, own in zip(types, values, strict=True):
        if kind.integrates:
            return -run(kind, np.array(own), np.ones(n), 1.0, sample_time).output[:, np.newaxis]
    return np.ones((n, 1))
