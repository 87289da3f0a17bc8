"""What a fitted linear model answers: step responses, Bode diagrams and poles, as numbers with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.estimators import estimator_of
from sysid.estimation.linear.modes import Mode, modes
from sysid.estimation.uncertainty import Uncertainty
from sysid.extras import need
from sysid.models import AbstractModel
from sysid.models.intersample import HELD
from sysid.models.to_control import Linear
from sysid.reporting.linear_view import LinearView, linear_views
from sysid.reporting.numbers import number, quantity
from sysid.reporting.step_responses import SETTLED, band, gains, settling, step_response, step_responses, stepinfo

if TYPE_CHECKING:
    import pandas as pd

    from sysid.models import TransferFunctionModel

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

    def __str__(self) -> str:
        lines = []
        for (y, u), one, response in zip(self.units, self.info(), self.values.T, strict=True):
            if not response.any():
                lines.append(f"{one['name']}: no effect in the model")
                continue
            gain = _with_interval(one["gain"], one["gain_low"], one["gain_high"], _over(y, u))
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
        gain_low: Lower ends of 95 % intervals of the gain; NaN where the uncertainty is not known.
        gain_high: Upper ends.
        phase_low: Lower ends of 95 % intervals of the phase in degrees.
        phase_high: Upper ends.
    """

    frequency: Matrix
    values: NDArray[np.complex128]
    gain_low: Matrix
    gain_high: Matrix
    phase_low: Matrix
    phase_high: Matrix

    @property
    def gain(self) -> Matrix:
        """Magnitudes, shape ``(n, n_pairs)``."""
        return np.abs(self.values)

    @property
    def phase(self) -> Matrix:
        """Phases in degrees, without jumps, shape ``(n, n_pairs)``."""
        return np.degrees(np.unwrap(np.angle(self.values), axis=0))

    def to_frame(self) -> pd.DataFrame:
        """A row for each pair and frequency.

        Returns:
            Columns ``input``, ``output``, ``frequency`` (rad/s), ``gain``, ``gain_low``, ``gain_high``, ``phase``
            (degrees), ``phase_low`` and ``phase_high``.
        """
        ends = {name: getattr(self, name) for name in ("gain_low", "gain_high")}
        phases = {"phase": self.phase, "phase_low": self.phase_low, "phase_high": self.phase_high}
        return self._frame("frequency", self.frequency, {"gain": self.gain, **ends, **phases})

    def __str__(self) -> str:
        lines = []
        for k, (name, (y, u)) in enumerate(zip(self.names, self.units, strict=True)):
            at = int(np.argmax(self.gain[:, k]))
            peak = _with_interval(self.gain[at, k], self.gain_low[at, k], self.gain_high[at, k], _over(y, u))
            lines.append(f"{name}: largest gain {peak} at {quantity(float(self.frequency[at]), 'rad/s')}")
        w = self.frequency
        return "\n".join([*lines, f"{len(w)} frequencies from {number(float(w[0]))} to {number(float(w[-1]))} rad/s"])

    __repr__ = __str__


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Poles:
    """The poles of linear models, with time constants, natural frequencies and damping.

    Args:
        modes: The slowest first, model by model; each has ``pole``, ``time_constant``, ``natural_frequency``,
            ``damping`` and their ``intervals``.
        models: What they are of.
    """

    modes: tuple[Mode, ...]
    models: Known

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


def _over(y: str, u: str) -> str:
    return y if u == "1" else f"{y}/{u}"


def poles_of(known: Known) -> Poles:
    """The poles of linear models.

    Args:
        known: The models.

    Returns:
        They, with intervals where there is an uncertainty.

    Raises:
        ConfigError: If a model is not linear.
    """
    check_linear(known)
    return Poles(modes=tuple(mode for one in known for mode in modes(*one)), models=known)


def step_of(known: Known, *, samples: int | None = None, seed: int = 0) -> StepResponse:
    """Step responses of linear models, from every input to every output.

    Args:
        known: The models, with one sample time.
        samples: Length; by default until the slowest pole has settled, 3000 at most.
        seed: Of the draws for the intervals.

    Returns:
        The responses.

    Raises:
        ConfigError: If a model is not linear, or no input moves any.
    """
    pairs = _views(known, seed)
    n = samples or max(settling(view) for _, view in pairs)
    values, ends, found = [], [], []
    for model, view in pairs:
        A, B, C, D = _stepped(model, view).matrices
        at, of = slice(view.source, view.source + 1), slice(view.target, view.target + 1)
        y = step_response(A, B[:, at], C[of], D[of, at], n)
        values.append(y)
        drawn = step_responses(view, n)
        ends.append(band(drawn) if len(drawn) else np.full((2, n), np.nan))
        found.append(gains(view))
    low, high = (np.column_stack([one[side] for one in ends]) for side in (0, 1))
    time = known[0][0].sample_time * np.arange(n, dtype=np.float64)
    return StepResponse(
        **_names(pairs), time=time, values=np.column_stack(values), low=low, high=high,
        **dict(zip(("gain", "gain_low", "gain_high"), np.array(found).T, strict=True)),
    )  # fmt: skip


def _stepped(model: AbstractModel, view: LinearView) -> Linear:
    """The model of a step, which stands between samples, whatever the inputs of its records do there."""
    if not view.discrete:
        transfer = cast("TransferFunctionModel", model)
        return replace(transfer, orders=replace(transfer.orders, intersample=HELD))
    return cast("Linear", model)


def bode_of(known: Known, *, frequency: Any = None, points: int = 200, seed: int = 0) -> Bode:
    """Frequency responses of linear models, from every input to every output.

    Args:
        known: The models, with one sample time.
        frequency: In rad/s; by default four decades up to the Nyquist frequency.
        points: How many by default.
        seed: Of the draws for the intervals.

    Returns:
        The responses.

    Raises:
        ConfigError: If a model is not linear, no input moves any, or a frequency is none.
    """
    pairs = _views(known, seed)
    nyquist = np.pi / known[0][0].sample_time
    w = nyquist * np.logspace(-4.0, 0.0, points) if frequency is None else _frequencies(frequency)
    columns, gains, phases = [], [], []
    for _, view in pairs:
        with np.errstate(divide="ignore", invalid="ignore"):  # of an integrator at 0 rad/s
            responses = view.responses(w)
        shown, drawn = responses[0], responses[1:]
        columns.append(shown)
        none = np.full((2, len(w)), np.nan)
        gains.append(band(np.abs(drawn)) if len(drawn) else none)
        phase = np.unwrap(np.angle(shown))
        phases.append(np.degrees(band(phase + np.angle(drawn / shown))) if len(drawn) else none)
    bands = {"gain": gains, "phase": phases}
    ends: dict[str, Any] = {
        f"{name}_{end}": np.column_stack([one[side] for one in found])
        for name, found in bands.items()
        for side, end in enumerate(("low", "high"))
    }
    return Bode(**_names(pairs), frequency=w, values=np.column_stack(columns), **ends)


def _frequencies(given: Any) -> Matrix:
    try:
        w = np.atleast_1d(np.asarray(given, dtype=np.float64))
    except (TypeError, ValueError):
        w = np.empty(0)
    if w.ndim != 1 or not len(w) or not np.isfinite(w).all() or (w < 0.0).any():
        raise ConfigError(
            "not frequencies",
            where="frequency",
            expected="finite numbers in rad/s, 0 or more",
            got=type(given).__name__,
            remedy="give an array such as np.logspace(-2, 1); hertz times 2 pi are rad/s",
        )
    return w


def check_linear(known: Known) -> None:
    """Refuse what has no transfer function."""
    for model, _ in known:
        if not estimator_of(model.structure).linear:
            raise ConfigError(
                "a model that is not linear has no step response, Bode diagram or poles of its own",
                where=str(model.mapping),
                expected="ARX, TF, OE, ARMAX, BJ, SS",
                got=model.structure.label,
                remedy="simulate the step that is meant, from the level where it happens; or fit a linear structure",
            )


def _views(known: Known, seed: int) -> list[tuple[AbstractModel, LinearView]]:
    check_linear(known)
    pairs = [(model, view) for model, known_by in known for view in linear_views(model, known_by, seed)]
    if not pairs:
        raise ConfigError(
            "there is no input to respond to",
            where=", ".join(str(model.mapping) for model, _ in known),
            expected="a model with an input that moves it",
            remedy="ask for its poles",
        )
    return pairs


def _names(pairs: Sequence[tuple[AbstractModel, LinearView]]) -> dict[str, Any]:
    ends = [(model.ends, view) for model, view in pairs]
    outputs = tuple(end.outputs[view.target] for end, view in ends)
    inputs = tuple(end.inputs[view.source] for end, view in ends)
    several = len(set(outputs)) > 1
    return {
        "names": tuple(f"{y} from {u}" if several else u for y, u in zip(outputs, inputs, strict=True)),
        "inputs": inputs,
        "outputs": outputs,
        "units": tuple((end.output_units[view.target], view.unit) for end, view in ends),
    }
