"""Pictures of transfer functions: Bode and step responses and poles and zeros, with what is uncertain about them."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sysid.estimation.uncertainty import Uncertainty
from sysid.models import Domain, TransferFunctionModel
from sysid.models.to_control import state_space
from sysid.reporting.style import PALETTE, TARGET, new_figure, styled

DRAWS = 200
"""Parameters drawn from their distribution for a band."""
BAND = (2.5, 97.5)
"""Percentiles of a band."""


def bode_figure(model: TransferFunctionModel, uncertainty: Uncertainty, *, seed: int = 0, points: int = 200) -> Figure:
    """Magnitude and phase of every input, with 95 % bands.

    Args:
        model: The model.
        uncertainty: Of its numerators and denominators, as its fit gives it.
        seed: Of the draws for the bands.
        points: Frequencies, up to the Nyquist frequency.

    Returns:
        One column per input.
    """
    top = np.pi / model.sample_time
    frequency = top * np.logspace(-4.0, 0.0, points)
    with styled():
        figure = new_figure(7.6, 4.2)
        axes = figure.subplots(2, len(model.mapping.inputs), sharex=True, squeeze=False)
        for j, name in enumerate(model.mapping.inputs):
            drawn = _drawn_responses(model, uncertainty, j, frequency, seed)
            shown = model.response(j, frequency)
            above, below = axes[0, j], axes[1, j]
            above.fill_between(frequency, *np.percentile(np.abs(drawn), BAND, axis=0), color="#DDDDDD", label="95 %")
            above.loglog(frequency, np.abs(shown), color=PALETTE[0], label=name)
            phase = np.unwrap(np.angle(shown))
            around = phase + np.angle(drawn / shown)
            below.fill_between(frequency, *np.degrees(np.percentile(around, BAND, axis=0)), color="#DDDDDD")
            below.semilogx(frequency, np.degrees(phase), color=PALETTE[0])
            above.set_ylabel(f"gain [{model.output_unit}/{model.input_units[j]}]")
            below.set_ylabel("phase [degrees]")
            below.set_xlabel("frequency [rad/s]")
            above.legend(loc="lower left")
        return figure


def step_figure(model: TransferFunctionModel, *, samples: int = 300) -> Figure:
    """Response of the output to a step of one unit in every input, through python-control.

    Args:
        model: The model.
        samples: Length.

    Returns:
        The figure.
    """
    import control

    system = state_space(model)
    time = np.arange(samples) * model.sample_time
    with styled():
        figure = new_figure(7.6, 3.0)
        axes = figure.subplots()
        for j, name in enumerate(model.mapping.inputs):
            response = control.step_response(system[0, j], time)
            label = f"{name}, 1 {model.input_units[j]}"
            axes.step(time, np.squeeze(response.outputs), where="post", color=PALETTE[j % len(PALETTE)], label=label)
        axes.set_xlabel("time [s]")
        axes.set_ylabel(f"{model.mapping.output} [{model.output_unit}]")
        axes.legend()
        return figure


def pole_zero_figure(model: TransferFunctionModel, uncertainty: Uncertainty, *, seed: int = 0) -> Figure:
    """Poles and zeros of every input, with the cloud of poles that the uncertainty allows.

    Args:
        model: The model.
        uncertainty: Of its numerators and denominators.
        seed: Of the draws.

    Returns:
        One panel per input.
    """
    discrete = model.orders.domain is Domain.DISCRETE
    with styled():
        figure = new_figure(7.6, 3.8)
        axes = figure.subplots(1, len(model.mapping.inputs), squeeze=False)[0]
        for j, name in enumerate(model.mapping.inputs):
            _, F = _drawn(model, uncertainty, j, seed)
            cloud = np.concatenate([np.roots(f if discrete else f[::-1]) for f in F])
            axes[j].plot(cloud.real, cloud.imag, ".", color="#BBBBBB", markersize=2, label=f"{DRAWS} draws")
            for roots, marker, kind in ((model.poles(j), "x", "poles"), (model.zeros(j), "o", "zeros")):
                axes[j].plot(roots.real, roots.imag, marker, color=PALETTE[0], fillstyle="none", label=kind)
            if discrete:
                angle = np.linspace(0.0, 2.0 * np.pi, 200)
                axes[j].plot(np.cos(angle), np.sin(angle), color=TARGET, linewidth=0.6)
                axes[j].set_aspect("equal")
            else:
                axes[j].axvline(0.0, color=TARGET, linewidth=0.6)
            axes[j].set_title(name)
            axes[j].legend(loc="lower left")
        return figure


def _drawn(
    model: TransferFunctionModel, uncertainty: Uncertainty, j: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Numerators and denominators of one input drawn from their joint distribution, ascending powers."""
    name = model.mapping.inputs[j]
    b = [i for i, text in enumerate(uncertainty.names) if text.startswith(f"B({name}, ")]
    f = [i for i, text in enumerate(uncertainty.names) if text.startswith(f"F({name}, ")]
    chosen = np.array(b + f)
    covariance = np.nan_to_num(uncertainty.covariance[np.ix_(chosen, chosen)])
    draws = np.random.default_rng(seed).multivariate_normal(
        uncertainty.values[chosen], covariance, size=DRAWS, method="eigh"
    )
    ones = np.ones((DRAWS, 1))
    B, rest = draws[:, : len(b)], draws[:, len(b) :]
    parts = (ones, rest) if model.orders.domain is Domain.DISCRETE else (rest, ones)
    return B, np.concatenate(parts, axis=1)


def _drawn_responses(
    model: TransferFunctionModel, uncertainty: Uncertainty, j: int, frequency: NDArray[np.float64], seed: int
) -> NDArray[np.complex128]:
    B, F = _drawn(model, uncertainty, j, seed)
    s = 1j * frequency
    x = np.exp(-s * model.sample_time) if model.orders.domain is Domain.DISCRETE else s
    powers = x ** np.arange(max(B.shape[1], F.shape[1]))[:, np.newaxis]
    dead = np.exp(-s * model.sample_time * model.delays[j])
    return np.asarray(dead * (B @ powers[: B.shape[1]]) / (F @ powers[: F.shape[1]]), dtype=np.complex128)
