"""Stops by the deceleration controller as command vectors: what an automatic driver asks of the brake.

The controller's signal is a share of the full service brake. A direct-release brake cannot be let off in part: its
handle goes down with the signal in steps and up in one move, when the controller no longer asks for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.models import ARX, ARXModel, Mapping
from sysid.rail.constants import MPH
from sysid.rail.transit.deceleration import COAST, FULL_SERVICE, JERK, RATE, Characteristic, identify_characteristic
from sysid.rail.transit.transit import DecelerationController, TransitVehicle, largest_jerk, stop_trace
from sysid.traces import Channel, Trace

SAMPLE_TIME = 0.1
"""In s."""

CRUISING, STOPPING = 20.0, 36.0
"""Of a stop in s: at 40 mph, and from the command to 20 mph on (ours)."""

LAGS = (0.15, 0.25)
"""Of the cylinder behind the commanded pressure in s, one after the other (ours)."""


def servo() -> ARXModel:
    """The vehicle's brake: two lags from the commanded pressure to the cylinder.

    Returns:
        A model with the mapping ``PC -> BC`` in psi.

    Example:
        >>> import numpy as np
        >>> model = servo()
        >>> float(np.round(model.coefficients.sum(), 9))  # a gain of one: b0 + a1 + a2 = 1
        1.0
    """
    fast, slow = (float(np.exp(-SAMPLE_TIME / lag)) for lag in LAGS)
    return ARXModel(
        orders=ARX(na=2, nb=(1,), nk=(1,)),
        coefficients=np.array([(1.0 - fast) * (1.0 - slow), fast + slow, -fast * slow]),
        intercept=0.0,
        mapping=Mapping.parse("PC -> BC"),
        sample_time=SAMPLE_TIME,
        input_units=("psi",),
        output_unit="psi",
        rest_output=0.0,
    )


def slow_application(vehicle: TransitVehicle) -> Trace:
    """What a vehicle shows of its brake characteristic: the signal goes slowly over its braking range.

    Args:
        vehicle: The plant, fast enough not to come to a stand (some 2000 m/s: on a real one several runs are joined).

    Returns:
        A trace with the channels P (mA) and A (deceleration by the pendulum in m/s2, the grade taken out).
    """
    signals = np.concatenate([np.full(50, COAST), np.linspace(COAST, FULL_SERVICE, 2000)])
    rates = np.empty(len(signals))
    for k, signal in enumerate(signals):
        vehicle.step(float(signal))
        rates[k] = -vehicle.pendulum
    channels = (Channel(name="P", unit="mA"), Channel(name="A", unit="m/s^2"))
    values = np.column_stack([signals, rates])
    return Trace(name="slow", sample_time=vehicle.sample_time, channels=channels, values=values)


def characteristic_of(model: ARXModel) -> Characteristic:
    """The brake characteristic of the nominal vehicle, found from a slow application.

    Args:
        model: Its brake.

    Returns:
        The characteristic.
    """
    return identify_characteristic(slow_application(TransitVehicle(model=model, speed=2000.0)))


@dataclass(frozen=True, kw_only=True)
class StopFigures:
    """One stop from 40 to 20 mph.

    Args:
        error: Mean error of the deceleration as a share of the rate asked for.
        modifier: Of the request, with which the stop was made.
        jerk: Largest jerk as a multiple of the source's limit.
        trace: The stop.
    """

    error: float
    modifier: float
    jerk: float
    trace: Trace


def check_stops(*, friction: float, grade: float, count: int) -> None:
    """Refuse stops that cannot be made.

    Args:
        friction: Of the vehicle's shoes, 1 being nominal.
        grade: Rise over run.
        count: How many stops.

    Raises:
        ConfigError: If the vehicle or the count cannot be.
    """
    if not 1 <= count <= 100 or not -0.06 <= grade <= 0.06 or not 0.2 <= friction <= 3.0:
        raise ConfigError(
            "not such stops", where="stops",
            expected="1 to 100 stops, friction from 0.2 to 3, grades up to 6 %",
            got=f"{count}, {friction:g}, {100.0 * grade:g} %",
        )  # fmt: skip


def learning_stops(
    characteristic: Characteristic, *, friction: float = 1.0, grade: float = 0.0, count: int = 5
) -> list[StopFigures]:
    """Stop again and again, the controller learning from each.

    Args:
        characteristic: What the controller knows of the brake before the first.
        friction: Of the vehicle's shoes, 1 being nominal.
        grade: Rise over run.
        count: How many stops.

    Returns:
        Each stop.

    Raises:
        ConfigError: If the vehicle or the count cannot be.
    """
    check_stops(friction=friction, grade=grade, count=count)
    controller = DecelerationController(characteristic=characteristic, sample_time=SAMPLE_TIME)
    vehicle = TransitVehicle(model=servo(), friction=friction, grade=grade)
    commands = np.repeat([40.0 * MPH, 20.0 * MPH], [round(CRUISING / SAMPLE_TIME), round(STOPPING / SAMPLE_TIME)])
    found = []
    for _ in range(count):
        before, vehicle.speed = controller.modifier, 40.0 * MPH
        trace = stop_trace(vehicle, controller, commands)
        jerk = largest_jerk(trace["A"][round((CRUISING - 1.0) / SAMPLE_TIME) :], SAMPLE_TIME) / JERK
        found.append(StopFigures(error=controller.mean_errors[-1] / RATE, modifier=before, jerk=jerk, trace=trace))
    return found


SPEEDS = (40.0, 30.0, 20.0, 10.0)
"""That are commanded at random, in mph; the first is where it begins."""
HOLD = (20, 90)
"""Shortest and longest time that a speed is commanded, in s."""


def speed_commands(seed: int, duration: float) -> NDArray[np.float64]:
    """Random speed commands in m/s: each other than the one before, held for a random time.

    Args:
        seed: Any integer of at least 0.
        duration: In s.

    Returns:
        Shape ``(n_samples,)``.
    """
    rng = np.random.default_rng(seed)
    parts, present, filled = [], SPEEDS[0], 0
    total = round(duration / SAMPLE_TIME)
    while filled < total:
        count = round(float(rng.uniform(*HOLD)) / SAMPLE_TIME)
        parts.append(np.full(count, present * MPH))
        filled += count
        present = float(rng.choice([speed for speed in SPEEDS if speed != present]))
    return np.concatenate(parts)[:total]


RUNNING = 90.0
"""Released handle in psi gauge."""
FIRST, DEEPEST = 5.8, 25.8
"""Smallest reduction, and that of full service, at 20 mA, in psi."""
STEP = 2.0
"""Between further reductions in psi (ours)."""


def handle_of_signal(signal: NDArray[np.float64]) -> NDArray[np.float64]:
    """The handle of a direct-release brake that follows the controller's signal.

    Args:
        signal: P in mA, shape ``(n_samples,)``.

    Returns:
        Handle in psi gauge, same shape.

    Example:
        >>> handle_of_signal(np.array([70.0, 58.0, 45.0, 50.0, 20.0, 60.0])).tolist()
        [90.0, 84.2, 82.2, 82.2, 64.2, 90.0]
    """
    handle, depth = np.empty(len(signal)), 0.0
    for k, value in enumerate(signal):
        share = (COAST - min(float(value), COAST)) / (COAST - FULL_SERVICE)
        if share <= 0.0:
            depth = 0.0
        else:
            asked = FIRST + STEP * np.floor(max(0.0, share * DEEPEST - FIRST) / STEP)
            depth = max(depth, DEEPEST if share >= 1.0 else float(asked))
        handle[k] = round(RUNNING - depth, 6)
    return handle


def stop_cycle(seed: int, duration: float, *, friction: float = 1.0, grade: float = 0.0) -> NDArray[np.float64]:
    """The handle of a vehicle whose controller follows random speed commands.

    Args:
        seed: Of the commands.
        duration: In s.
        friction: Of the shoes, 1 being nominal.
        grade: Rise over run.

    Returns:
        Handle in psi gauge, one per 0.1 s.
    """
    model, commands = servo(), speed_commands(seed, duration)
    controller = DecelerationController(characteristic=characteristic_of(model), sample_time=SAMPLE_TIME)
    vehicle = TransitVehicle(model=model, friction=friction, speed=float(commands[0]), grade=grade)
    return handle_of_signal(np.array(stop_trace(vehicle, controller, commands)["P"]))
