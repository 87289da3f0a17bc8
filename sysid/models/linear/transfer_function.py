"""Transfer functions: for each input a rational function of its own, discrete or continuous, with a dead time."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened
from sysid.models.channels.history import History
from sysid.models.channels.mapping import Mapping
from sysid.models.channels.scaling import Scaling
from sysid.models.contract.ratio import Ratio
from sysid.models.converting import orthonormal_basis as bases
from sysid.models.converting.continuous import ContinuousStateSpace
from sysid.models.converting.orthonormal_basis import BasisSection, Domain
from sysid.models.converting.realisation import Realisation, parted, realise
from sysid.models.converting.to_control import Matrices
from sysid.models.linear.linear_forms import LinearForms
from sysid.models.linear.polynomial_moves import Polynomials
from sysid.models.linear.state_space import StateSpace
from sysid.models.orders.intersample import HELD, InterSample, intersample_of, marked, moving, to_fields
from sysid.models.orders.lags import MOST, of_samples, whole
from sysid.models.orders.ranges import IntRange
from sysid.models.orders.structure import AbstractStructure

MOST_POLES = 100
"""For each input; beyond some ten the coefficients lose all meaning in double precision."""


@dataclass(frozen=True, kw_only=True)
class TransferFunction(AbstractStructure):
    """Orders of a transfer function, as in MATLAB's ``tfest``: one number for each input, or one for all.

    Args:
        poles: Number of poles.
        zeros: Number of zeros, at most that of the poles.
        delays: Dead time in samples; ``None``, or ``"auto"``, to search for it. That of a continuous one may end
            between samples, as in 2.5. A discrete transfer function without dead time reacts to its input at once, and
            one that is sampled from a plant has a dead time of at least 1: none is found only where that leaves clearly
            less, and is told.
        domain: ``discrete``: ``B(1/q) / F(1/q)``, where ``zeros`` is the degree of ``B``; or ``continuous``:
            ``B(s) / F(s)``.
        intercept: Fit a constant output beside them.
        intersample: What inputs do between samples, for a continuous one: ``zoh``, held, or ``foh``, straight to the
            next sample; for all, or by input as in ``{force: foh}``.

    Raises:
        ConfigError: If the numbers are not those of a transfer function, or differ in length.

    Example:
        >>> TransferFunction(poles=(2,), zeros=(1,), delays=(3,)).label
        'TF [2; 1; 3]'
    """

    poles: Annotated[tuple[int, ...], IntRange(low=1, high=8)]
    zeros: Annotated[tuple[int, ...], IntRange(low=0, high=8)]
    delays: tuple[float, ...] | None = None
    domain: Domain = Domain.DISCRETE
    intercept: bool = True
    intersample: InterSample | Dict[str, str] = HELD

    kind = "TransferFunction"
    per_input = ("poles", "zeros", "delays")

    def __post_init__(self) -> None:
        delays: object = self.delays
        object.__setattr__(self, "delays", None if delays == "auto" else delays)
        self._listed("poles", "zeros", *["delays"] * (self.delays is not None))
        object.__setattr__(self, "domain", _domain(self.domain))
        object.__setattr__(self, "intersample", intersample_of(self.intersample))
        if self.domain is Domain.DISCRETE and self.intersample != HELD:
            raise ConfigError(
                "a discrete transfer function knows nothing of its inputs between samples", where="intersample",
                expected="domain: continuous, or no intersample", got=f"domain: {self.domain.value}",
                remedy="write domain: continuous, or remove intersample",
            )  # fmt: skip
        late = of_samples if self.domain is Domain.CONTINUOUS else whole
        known = self.delays or (0,) * len(self.poles)
        same = len(self.poles) == len(self.zeros) == len(known)
        numbers = all(map(whole, (*self.poles, *self.zeros))) and all(map(late, known))
        if not numbers or not same or not self.poles or not all(map(_proper, self.poles, self.zeros)):
            raise ConfigError(
                "not the orders of a transfer function",
                expected=f"for each input 1 to {MOST_POLES} poles, no more zeros than poles, and a dead time of 0 to "
                f"{MOST:,} samples{', a whole number' * (late is whole)}; or one for all inputs",
                got=f"poles {shortened(list(self.poles))}, zeros {shortened(list(self.zeros))}, "
                f"delays {shortened(self.delays)}",
                remedy="write for example poles: [2, 2], zeros: [1, 1], delays: [1, 1]",
            )
        if self.delays is not None:
            object.__setattr__(self, "delays", tuple(int(k) if k == int(k) else float(k) for k in known))

    @property
    def label(self) -> str:
        """Poles, zeros and dead times; ``?`` where they are to be searched."""
        rows = [self.poles, self.zeros, ("?",) if self.delays is None else [f"{k:.6g}" for k in self.delays]]
        prefix = "TF" if self.domain is Domain.DISCRETE else f"continuous TF{marked(self.intersample)}"  # type: ignore[arg-type]  # brought into this form
        return f"{prefix} [{'; '.join(' '.join(map(str, row)) for row in rows)}]"

    def moving(self, inputs: Sequence[str]) -> tuple[bool, ...]:
        """By input, whether it goes straight from sample to sample.

        Args:
            inputs: Names of the inputs.

        Returns:
            An entry for each.
        """
        return moving(self.intersample, inputs)  # type: ignore[arg-type]  # in this form when it was made

    def check_mapping(self, mapping: Mapping) -> None:
        """Refuse a mapping that has not the inputs that are named; see the base class."""
        super().check_mapping(mapping)
        self.moving(mapping.inputs)

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        found = {
            "kind": self.kind,
            "poles": list(self.poles),
            "zeros": list(self.zeros),
            "delays": None if self.delays is None else list(self.delays),
            "domain": self.domain.value,
            "intercept": self.intercept,
        }
        return found | to_fields(self.intersample)  # type: ignore[arg-type]  # in this form when it was made


def _proper(poles: int, zeros: int) -> bool:
    return zeros <= poles and 0 < poles <= MOST_POLES


def _domain(value: object) -> Domain:
    try:
        return Domain(value)
    except ValueError:
        raise ConfigError(
            "unknown domain",
            expected="discrete or continuous",
            got=shortened(value),
            remedy="choose one of the two",
        ) from None


@dataclass(frozen=True, kw_only=True, eq=False)
class TransferFunctionModel(LinearForms):
    """A fitted transfer function.

    Args:
        orders: The structure, with its dead times.
        sections: For each input the denominators of its sections, ``[1, c1, c2]`` in powers of ``1/q`` or
            ``[c0, c1, 1]`` in powers of ``s``; see :mod:`sysid.models.converting.orthonormal_basis`.
        taps: For each input the weights of its basis's taps, in scaled numbers, shapes ``(zeros_j + 1,)``.
        constant: Scaled output without inputs.
        scaling: Between units and scaled numbers.
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
    """

    orders: TransferFunction
    sections: tuple[tuple[NDArray[np.float64], ...], ...]
    taps: tuple[NDArray[np.float64], ...]
    constant: float
    scaling: Scaling
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_unit: str
    rest_output: float

    structure_field = "orders"

    @property
    def structure(self) -> TransferFunction:
        """The orders."""
        return self.orders

    @property
    def n_parameters(self) -> int:
        """Coefficients of numerators and denominators and, if fitted, the constant."""
        return sum(self.orders.poles) + sum(self.orders.zeros) + len(self.orders.zeros) + self.orders.intercept

    @property
    def delays(self) -> tuple[float, ...]:
        """Dead time of each input in samples; of a continuous one it may end between two."""
        return self.orders.delays or (0,) * len(self.orders.poles)

    def basis(self, j: int) -> tuple[BasisSection, ...]:
        """The basis of one input.

        Args:
            j: Which input.

        Returns:
            Its sections.
        """
        return bases.basis_of(self.sections[j], self.orders.zeros[j], self.orders.domain)

    def numerator(self, j: int) -> NDArray[np.float64]:
        """``B`` of one input, from its unit to the output's.

        Args:
            j: Which input.

        Returns:
            Shape ``(zeros_j + 1,)``, in ascending powers of ``1/q`` or ``s``. With many poles the coefficients of a
            product have fewer correct digits than its factors; the model itself runs on the factors.
        """
        gain = self.scaling.output_scale / self.scaling.input_scale[j]
        return np.asarray(gain * (self.taps[j] @ bases.numerators(self.basis(j))))[: self.orders.zeros[j] + 1]

    def denominator(self, j: int) -> NDArray[np.float64]:
        """``F`` of one input.

        Args:
            j: Which input.

        Returns:
            Shape ``(poles_j + 1,)``, ascending powers; the first (discrete) or last (continuous) one is 1.
        """
        return bases.denominator(self.basis(j))

    def poles(self, j: int) -> NDArray[np.complex128]:
        """Poles of one input, in the z or the s plane.

        Args:
            j: Which input.

        Returns:
            Shape ``(poles_j,)``.
        """
        return np.concatenate([bases.section_poles(d, self.orders.domain) for d in self.sections[j]])

    def zeros(self, j: int) -> NDArray[np.complex128]:
        """Zeros of one input, in the z or the s plane, those at infinity (or z = 0) left out.

        Args:
            j: Which input.

        Returns:
            Shape ``(zeros_j,)`` or fewer.
        """
        b = self.numerator(j)
        return np.asarray(np.roots(b if self.orders.domain is Domain.DISCRETE else b[::-1]), dtype=np.complex128)

    def ratio(self, j: int) -> Ratio:
        """From one input to the output, in ``1/z`` or in ``s``."""
        name, discrete = self.mapping.inputs[j], self.orders.domain is Domain.DISCRETE
        return Ratio(
            B=self.numerator(j), F=self.denominator(j), delay=self.delays[j], discrete=discrete,
            of_numerator=f"B({name}, ", of_denominator=f"F({name}, ",
        )  # fmt: skip

    @property
    def polynomials(self) -> Polynomials:
        """The same in polynomials, in the channels' units."""
        inputs = range(len(self.sections))
        form = self.scaling
        # The scaled inputs' zero lies at their offset: what they hold the output at there is part of the constant.
        return Polynomials(
            numerators=[self.numerator(j) for j in inputs],
            denominators=[self.denominator(j) for j in inputs],
            constant=form.output_offset + form.output_scale * self.constant,
            delays=self.delays,
            sample_time=None if self.orders.domain is Domain.DISCRETE else self.sample_time,
            moving=self.orders.moving(self.mapping.inputs),
        )

    def output_moves(
        self,
        factor: NDArray[np.float64],
        inputs: NDArray[np.float64],
        history: History,
        measured: NDArray[np.float64] | None = None,  # noqa: ARG002 - one step ahead nothing is predicted
    ) -> NDArray[np.float64]:
        """How the free run moves with numerators, denominators and the constant; see the base class."""
        offset = np.asarray(self.scaling.input_offset)
        before = len(history.output)
        u = np.concatenate([history.inputs, inputs]) - offset
        return self.polynomials.moves(factor, u, known=before > 1)[before:]

    @property
    def pole_radius(self) -> float:
        """Magnitude of the largest pole from sample to sample; a pole ``s`` becomes ``exp(s T)``."""
        poles = np.concatenate([self.poles(j) for j in range(len(self.sections))])
        discrete = self.orders.domain is Domain.DISCRETE
        return float(np.max(np.abs(poles) if discrete else np.exp(poles.real * self.sample_time), initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether all poles lie inside the unit circle, or left of the imaginary axis."""
        poles = np.concatenate([self.poles(j) for j in range(len(self.sections))])
        margin = np.abs(poles) - 1.0 if self.orders.domain is Domain.DISCRETE else poles.real
        return bool((margin < 0.0).all())

    def response(self, j: int, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Frequency response of one input, dead time included.

        Args:
            j: Which input.
            frequency: In rad/s, shape ``(n_points,)``.

        Returns:
            Output unit per input unit, shape ``(n_points,)``.
        """
        s = 1j * np.asarray(frequency, dtype=np.float64)
        discrete = self.orders.domain is Domain.DISCRETE
        variable = np.asarray(np.exp(-s * self.sample_time) if discrete else s, dtype=np.complex128)
        gain = self.scaling.output_scale / self.scaling.input_scale[j]
        dead = np.exp(-s * self.sample_time * self.delays[j])
        return np.asarray(gain * dead * (bases.responses(self.basis(j), variable) @ self.taps[j]))

    @cached_property
    def recursion(self) -> StateSpace:
        """The state space that is run and exported: block by block, each input's dead time, then its basis."""
        parts = [self._block(j) for j in range(len(self.sections))]
        if not any(taps.any() for taps in self.taps):
            # Nothing drives it, and the records still said how it leaves the state in which it begins.
            first, n, k = parts[0], len(parts[0].A), int(self.delays[0])
            parts[0] = replace(first, B=np.zeros(n), C=(np.arange(n) >= k).astype(np.float64)[np.newaxis])
        B = np.zeros((sum(len(part.A) for part in parts), len(parts)))
        at = 0
        for j, part in enumerate(parts):
            B[at : at + len(part.A), j] = part.B
            at += len(part.A)
        return StateSpace(
            A=np.ascontiguousarray(scipy.linalg.block_diag(*(part.A for part in parts))),
            B=B,
            C=np.concatenate([part.C[0] for part in parts])[np.newaxis],
            D=np.array([[part.D[0] for part in parts]]),
            constant=np.array([self.constant]),
            scaling=self.scaling,
        )

    def _block(self, j: int) -> Realisation:
        """One input's dead time and basis, with the weighted taps as its output."""
        part = realise(self.basis(j), self.orders.domain)
        k, late = parted(self.delays[j])
        if self.orders.domain is Domain.CONTINUOUS:
            # Over the sample time, states are of one size with those of a dead time, whatever the unit of time is.
            T = self.sample_time
            part = replace(part, B=part.B / T, C=T * part.C)
            part = part.sampled(T, moving=self.orders.moving(self.mapping.inputs)[j], late=late)
        row, direct = self.taps[j] @ part.C, float(self.taps[j] @ part.D)
        n = len(part.A)
        if k == 0:
            return Realisation(A=part.A, B=part.B, C=row[np.newaxis], D=np.array([direct]))
        A, B, C = np.zeros((n + k, n + k)), np.zeros(n + k), np.zeros(n + k)
        A[:k, :k] = np.eye(k, k=-1)
        B[0] = 1.0
        A[k:, k:], A[k:, k - 1] = part.A, part.B
        C[k:], C[k - 1] = row, direct
        return Realisation(A=A, B=B, C=C[np.newaxis], D=np.zeros(1))

    def continuous(self) -> ContinuousStateSpace:
        """The system in continuous time: of a continuous model itself, section by section; see the base class."""
        if self.orders.domain is Domain.DISCRETE:
            return super().continuous()
        parts = [realise(self.basis(j), self.orders.domain) for j in range(len(self.sections))]
        gains = self.scaling.output_scale / np.array(self.scaling.input_scale)
        n, at = sum(len(part.A) for part in parts), 0
        B, C, D = np.zeros((n, len(parts))), np.zeros((1, n)), np.zeros((1, len(parts)))
        for j, (part, taps, gain) in enumerate(zip(parts, self.taps, gains, strict=True)):
            here = slice(at, at + len(part.A))
            B[here, j], C[0, here], D[0, j] = part.B, gain * (taps @ part.C), gain * (taps @ part.D)
            at = here.stop
        A = scipy.linalg.block_diag(*(part.A for part in parts))
        delays = tuple(k * self.sample_time for k in self.delays)
        return ContinuousStateSpace(A=A, B=B, C=C, D=D, delays=delays, mapping=self.mapping)

    @property
    def matrices(self) -> Matrices:
        """A discrete state space of it, in the channels' units."""
        form = self.recursion
        gain, scale = self.scaling.output_scale, np.array(self.scaling.input_scale)
        return form.A, form.B / scale, gain * form.C, gain * form.D / scale

    def _written(self) -> dict[str, Any]:
        return {
            "sections": [[d.tolist() for d in sections] for sections in self.sections],
            "taps": [taps.tolist() for taps in self.taps],
            "constant": self.constant,
            "scaling": self.scaling.to_dict(),
        }

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return {
            "sections": tuple(tuple(np.array(d, dtype=np.float64) for d in part) for part in fields["sections"]),
            "taps": tuple(np.array(taps, dtype=np.float64) for taps in fields["taps"]),
            "constant": fields["constant"],
            "scaling": Scaling.from_dict(fields["scaling"]),
        }
