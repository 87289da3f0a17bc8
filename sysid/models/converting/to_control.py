"""Linear models as objects of python-control, for Bode and step responses, pole-zero maps and controller design.

They relate deviations from an operating point: python-control has no place for a model's constant. The package is
imported when a function is called, because it takes half a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.extras import need
from sysid.models.channels.mapping import Mapping
from sysid.names import distinct, signal_name

Polynomials = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Numerator and denominator."""

Matrices = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""A, B, C and D of a discrete state space in the channels' units."""


class Linear(Protocol):
    """What a linear model tells of itself."""

    @property
    def mapping(self) -> Mapping:
        """Its channels."""

    @property
    def sample_time(self) -> float:
        """Seconds."""

    @property
    def matrices(self) -> Matrices:
        """The recursion that is run, from deviations to deviations."""


def transfer_function(ratios: Sequence[Polynomials], mapping: Mapping, sample_time: float) -> Any:
    """Ratios of polynomials as ``control.TransferFunction``.

    Args:
        ratios: For each input the polynomials, in falling powers of ``z``, or of ``s``.
        mapping: Its channels.
        sample_time: Seconds; 0 in continuous time.

    Returns:
        One row, one column per input. The polynomials of many poles carry fewer digits than :func:`state_space`.
    """
    need("control", "an object of python-control")
    import control

    return control.TransferFunction(
        [[num for num, _ in ratios]],
        [[den for _, den in ratios]],
        sample_time,
        **signals(mapping),
    )


def state_space(model: Linear) -> Any:
    """A linear model as a discrete ``control.StateSpace`` in the channels' units: exactly the recursion that is run.

    Args:
        model: The model. A continuous one is sampled, its inputs held, its dead times exact.

    Returns:
        The state space, with the model's sample time.
    """
    need("control", "an object of python-control")
    import control

    A, B, C, D = model.matrices
    return control.StateSpace(A, B, C, D, model.sample_time, **signals(model.mapping))


def of_wired(models: Sequence[Any], inputs: Sequence[str], outputs: Sequence[str], sample_time: float) -> Any:
    """Linear models wired by the names of their channels as one ``control.StateSpace``.

    Args:
        models: The models.
        inputs: Channels that none of them writes.
        outputs: Channels that they write.
        sample_time: Seconds.

    Returns:
        The state space in the channels' units, from the inputs to every output.

    Raises:
        ConfigError: If a model is not linear.
    """
    need("control", "an object of python-control")
    import control

    for model in models:
        if not hasattr(model, "matrices"):
            raise ConfigError(
                "a model that is not linear has no state space of python-control",
                where=str(model.mapping),
                expected="ARX, VectorARX, TF, OE, ARMAX, BJ, SS",
                got=model.structure.label,
                remedy="fit that output by a linear structure too",
            )
    parts = [model.matrices for model in models]
    written = [name for model in models for name in model.mapping.outputs]
    reads = np.zeros((sum(len(model.mapping.inputs) for model in models), len(written) + len(inputs)))
    for row, name in enumerate(name for model in models for name in model.mapping.inputs):
        reads[row, written.index(name) if name in written else len(written) + list(inputs).index(name)] = 1.0
    inner, outer = np.split(reads, [len(written)], axis=1)
    A, B, C, D = (scipy.linalg.block_diag(*blocks) for blocks in zip(*parts, strict=True))
    # What is read at the same sample comes in a chain: y = C x + D (inner y + outer u) can always be solved for y.
    solved = np.linalg.inv(np.eye(len(written)) - D @ inner)
    C, D = solved @ C, solved @ D @ outer
    B, A = B @ (inner @ D + outer), A + B @ inner @ C
    at = [written.index(name) for name in outputs]
    known = signals(Mapping(inputs=tuple(inputs), outputs=tuple(outputs)))
    return control.StateSpace(A, B, C[at], D[at], sample_time, **known)


def signals(mapping: Mapping) -> dict[str, list[str]]:
    """The names of the channels as python-control takes them, which has no dots in names."""
    names = distinct((*mapping.inputs, *mapping.outputs), signal_name)
    return {side: [names[name] for name in getattr(mapping, side)] for side in ("inputs", "outputs")}


def delayed(ratio: Polynomials, seconds: float, order: int) -> Polynomials:
    """A continuous transfer function behind a dead time.

    Args:
        ratio: In falling powers of ``s``.
        seconds: The dead time.
        order: Of the Padé approximation that stands for it.

    Returns:
        The two as one.
    """
    need("control", "an object of python-control")
    import control

    if not seconds:
        return ratio
    num, den = control.pade(seconds, order)
    return np.convolve(ratio[0], num), np.convolve(ratio[1], den)


def in_powers_of_z(B: NDArray[np.float64], F: NDArray[np.float64]) -> Polynomials:
    """Polynomials in ``1/z`` as polynomials in ``z`` of the same ratio, descending.

    Args:
        B: Numerator, the newest lag first.
        F: Denominator, likewise.

    Returns:
        The two, of equal length.
    """
    n = max(len(B), len(F))
    return np.pad(B, (0, n - len(B))), np.pad(F, (0, n - len(F)))
