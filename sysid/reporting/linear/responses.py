"""What a fitted linear model answers: step responses, Bode diagrams and poles, as numbers with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.linear.modes import Mode
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.extras import need
from sysid.models import AbstractModel
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.reporting.linear.step_responses import (
    SETTLED,
    stepinfo,
)
from sysid.reporting.linear_views import LinearView
from sysid.reporting.numbers import number, quantity
from sysid.units import per

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Matrix = NDArray[np.float64]
Known = Sequence[tuple[AbstractModel, Uncertainty | None]]
"""Models, each with the uncertainty of its parameters where there is one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Response:
    """Columns of one response for each pair of input and output.

    Args:
        names: Of each column: the input; of several outputs, the output from the input.
        inputs: The input of each column.
        outputs: The output of each column.
        units: Output unit over input unit, of each column.
    """

    names: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: tuple[tuple[str, str], ...]

    def _frame(self, axis: str, at: Matrix, columns: dict[str, Matrix]) -> pd.DataFrame:
        need("pandas", "a frame")
        import pandas as pd

        return pd.concat(
            [
                pd.DataFrame({"input": u, "output": y, axis: at, **{name: one[:, k] for name, one in columns.items()}})
                for k, (u, y) in enumerate(zip(self.inputs, self.outputs, strict=True))
            ],
            ignore_index=True,
        )

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class StepResponse(_Response):
    """Change of the outputs after a step of one unit in an input, all else at rest.

    Args:
        time: Seconds after the step, shape ``(n,)``.
        values: Shape ``(n, n_pairs)``, in the output's unit for one unit of the input.
        low: Lower ends of 95 % intervals; NaN where the uncertainty is not known.
        high: Upper ends.
        gain: Static gain of each pair; infinite of what integrates, NaN of what is unstable.
        gain_low: Lower ends of 95 % intervals of the gain.
        gain_high: Upper ends.
    """

    time: Matrix
    values: Matrix
    low: Matrix
    high: Matrix
    gain: Matrix
    gain_low: Matrix
    gain_high: Matrix

    def info(self) -> list[dict[str, Any]]:
        """What a step comes to, pair by pair, as ``stepinfo`` has it.

        Returns:
            For each ``name``, ``gain``, ``gain_low``, ``gain_high``, ``rise_time`` (s, from 10 to 90 %),
            ``settling_time`` (s, to within 2 %) and ``overshoot`` (percent); NaN where a response does not settle.
        """
        return [
            {
                "name": name,
                "gain": float(self.gain[k]),
                "gain_low": float(self.gain_low[k]),
                "gain_high": float(self.gain_high[k]),
                **stepinfo(self.time, self.values[:, k], float(self.gain[k])),
            }
            for k, name in enumerate(self.names)
        ]

    def to_frame(self) -> pd.DataFrame:
        """A row for each pair and sample.

        Returns:
            Columns ``input``, ``output``, ``time`` (s), ``value``, ``low`` and ``high``.
        """
        return self._frame("time", self.time, {"value": self.values, "low": self.low, "high": self.high})

    def plot(self) -> Figure:
        """The responses with their bands.

        Returns:
            A figure of matplotlib's, one panel a pair.
        """
        from sysid.reporting.figures.linear_figures import step_figure

        return step_figure(self)

    def __str__(self) -> str:
        lines = []
        for (y, u), one, response in zip(self.units, self.info(), self.values.T, strict=True):
            if not response.any():
                lines.append(f"{one['name']}: no effect in the model")
                continue
            gain = _with_interval(one["gain"], one["gain_low"], one["gain_high"], per(y, u))
            said = f"{one['name']}: gain {gain}"
            if np.isfinite(one["settling_time"]):
                said += (
                    f", rises in {quantity(one['rise_time'], 's')}, settles in {quantity(one['settling_time'], 's')}"
                )
                said += f", overshoots by {number(one['overshoot'])} %" if one["overshoot"] > 100.0 * SETTLED else ""
            else:
                said += ", does not settle" if not np.isfinite(one["gain"]) else ", settles later than is shown"
            lines.append(said)
        return "\n".join(lines)

    __repr__ = __str__


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Bode(_Response):
    """Frequency responses of a model, from each input to each output.

    Args:
        frequency: In rad/s, shape ``(n,)``.
        values: Complex, shape ``(n, n_pairs)``, output unit over input unit.
        phase: In degrees, with all turns from zero frequency on, those of a dead time too, shape ``(n, n_pairs)``.
        gain_low: Lower ends of 95 % intervals of the gain; NaN where the uncertainty is not known.
        gain_high: Upper ends.
        phase_low: Lower ends of 95 % intervals of the phase in degrees.
        phase_high: Upper ends.
    """

    frequency: Matrix
    values: NDArray[np.complex128]
    phase: Matrix
    gain_low: Matrix
    gain_high: Matrix
    phase_low: Matrix
    phase_high: Matrix

    @property
    def gain(self) -> Matrix:
        """Magnitudes, shape ``(n, n_pairs)``."""
        return np.abs(self.values)

    def to_frame(self) -> pd.DataFrame:
        """A row for each pair and frequency.

        Returns:
            Columns ``input``, ``output``, ``frequency`` (rad/s), ``gain``, ``gain_low``, ``gain_high``, ``phase``
            (degrees), ``phase_low`` and ``phase_high``.
        """
        ends = {name: getattr(self, name) for name in ("gain_low", "gain_high")}
        phases = {"phase": self.phase, "phase_low": self.phase_low, "phase_high": self.phase_high}
        return self._frame("frequency", self.frequency, {"gain": self.gain, **ends, **phases})

    def plot(self, *, unit: str = HERTZ.value) -> Figure:
        """Gain and phase with their bands.

        Args:
            unit: Of the frequencies that are drawn: ``"Hz"``, or ``"rad/s"``, as ``frequency`` has them.

        Returns:
            A figure of matplotlib's, one column a pair.

        Raises:
            ConfigError: If it is another unit.
        """
        from sysid.reporting.figures.linear_figures import bode_figure

        return bode_figure(self, FrequencyUnit.of(unit))

    def __str__(self) -> str:
        lines = []
        for k, (name, (y, u)) in enumerate(zip(self.names, self.units, strict=True)):
            if not self.gain[:, k].any():
                lines.append(f"{name}: no effect in the model")
                continue
            at = int(np.argmax(self.gain[:, k]))
            peak = _with_interval(self.gain[at, k], self.gain_low[at, k], self.gain_high[at, k], per(y, u))
            lines.append(f"{name}: largest gain {peak} at {quantity(float(HERTZ.told(self.frequency[at])), 'Hz')}")
        w = HERTZ.told(self.frequency)
        return "\n".join([*lines, f"{len(w)} frequencies from {number(float(w[0]))} to {number(float(w[-1]))} Hz"])

    __repr__ = __str__


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Poles:
    """The poles of linear models, with time constants, natural frequencies and damping.

    Args:
        modes: The slowest first, model by model; each has ``pole``, ``time_constant``, ``natural_frequency``,
            ``damping`` and their ``intervals``; ``of`` says which input, and of several models which output, it is of.
        views: From each input to each output, with the poles that the uncertainty allows.
    """

    modes: tuple[Mode, ...]
    views: tuple[LinearView, ...]

    def __iter__(self) -> Any:
        return iter(self.modes)

    def __len__(self) -> int:
        return len(self.modes)

    def to_frame(self) -> pd.DataFrame:
        """A row for each real pole or pair.

        Returns:
            Columns ``of``, ``pole`` (complex, of a pair the upper one), ``time_constant`` (s), ``natural_frequency``
            (rad/s), ``damping``, and of these three the ends ``_low`` and ``_high`` of 95 % intervals.
        """
        need("pandas", "a frame")
        import pandas as pd

        rows = [
            {"of": mode.of, "pole": mode.pole}
            | {key: np.nan if getattr(mode, key) is None else getattr(mode, key) for key in SAID}
            | {
                f"{key}_{end}": mode.intervals.get(key, (np.nan, np.nan))[side]
                for key in SAID
                for side, end in enumerate(("low", "high"))
            }
            for mode in self.modes
        ]
        ends = [f"{key}_{end}" for key in SAID for end in ("low", "high")]
        return pd.DataFrame(rows, columns=["of", "pole", *SAID, *ends])

    def plot(self) -> Figure:
        """Poles and zeros of every input, with the cloud of poles that the uncertainty allows.

        Returns:
            A figure of matplotlib's, one panel a pair.

        Raises:
            ConfigError: If there is no input, and so no zero and no panel.
        """
        from sysid.reporting.figures.linear_figures import pole_zero_figure

        if not self.views:
            raise ConfigError(
                "there is no input, and so nothing to draw by input",
                expected="a model with an input that moves it",
                remedy="print the poles, or have them as numbers: to_frame()",
            )
        return pole_zero_figure(self.views)

    def __str__(self) -> str:
        return "\n".join(map(_said, self.modes)) or "no poles: the output is a sum of past inputs"

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


SAID = {"time_constant": "s", "natural_frequency": "rad/s", "damping": "1"}
"""What is said of a pole, with its unit."""


def _said(mode: Mode) -> str:
    pair = f" ± {number(abs(mode.pole.imag), digits=5)}i" if mode.pole.imag else ""
    found = [
        f"{key.replace('_', ' ')} {_with_interval(value, *mode.intervals.get(key, (np.nan, np.nan)), unit)}"
        for key, unit in SAID.items()
        if (value := getattr(mode, key)) is not None
    ]
    if mode.rate is None:
        found = ["no continuous form"]
    elif mode.rate == 0.0:
        found = ["integrates"]
    of = f"{mode.of}: " if mode.of else ""
    return f"{of}{number(mode.pole.real, digits=5)}{pair}: {', '.join(found)}"


def _with_interval(value: float, low: float, high: float, unit: str) -> str:
    ends = f" (95 %: {number(low)} to {number(high)})" if np.isfinite(low) and np.isfinite(high) else ""
    return f"{quantity(value, unit)}{ends}"
