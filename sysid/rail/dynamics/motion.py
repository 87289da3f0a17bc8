"""A train in motion: state that may be advanced in chunks, and the record of what it did."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, StabilityError
from sysid.rail.constants import GRAVITY
from sysid.rail.dynamics import kernel
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train

CURVE_RESISTANCE = 6.85
"""Curve resistance in N per kg times radius in m: 0.8 lb per short ton and degree of curve, as the American Railway
Engineering Association recommends, a degree being a radius of 1,746.4 m: 0.8 * 4.448 / 907.18 * 1746.4."""

STEP = 1e-2
"""Step in s (ours): half of it changes the peak forces of a braked loaded train by less than half a percent."""

TURN_SPEED = 1e-3
"""Speed in m/s over which a friction turns round (ours): a braked train creeps by less than that."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """What a train did, one row per sample (its end).

    Args:
        time: In s, shape ``(n_samples,)``.
        positions: Of the centres in m, shape ``(n_samples, n_vehicles)``.
        speeds: In m/s, same shape.
        forces: Of the couplers in N, positive in draft, in each sample's last step, ``(n_samples, n_vehicles - 1)``.
        works: Done on the train in J since the beginning, in the order of :data:`sysid.rail.dynamics.kernel.WORKS`.
    """

    time: NDArray[np.float64]
    positions: NDArray[np.float64]
    speeds: NDArray[np.float64]
    forces: NDArray[np.float64]
    works: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.time)

    @staticmethod
    def joined(parts: list[Motion]) -> Motion:
        """Motions that follow each other as one."""
        return Motion(
            time=np.concatenate([part.time for part in parts]),
            positions=np.concatenate([part.positions for part in parts]),
            speeds=np.concatenate([part.speeds for part in parts]),
            forces=np.concatenate([part.forces for part in parts]),
            works=np.concatenate([part.works for part in parts]),
        )


@dataclass(frozen=True, kw_only=True)
class Peak:
    """A largest coupler force.

    Args:
        force: In N, positive in draft.
        coupler: Number from 1: the one behind vehicle ``coupler``; 0 where a single vehicle has none.
        time: In s.
    """

    force: float
    coupler: int
    time: float


@dataclass(frozen=True, kw_only=True)
class Energies:
    """Energy of a train in J.

    Args:
        kinetic: Of its speed.
        stored: In its couplers.
        potential: Of its height.
    """

    kinetic: float
    stored: float
    potential: float


class MovingTrain:
    """The longitudinal motion of a train, advanced sample by sample or many samples at once.

    Args:
        train: The vehicles.
        track: The line.
        speed: At the beginning in m/s: one number, or one per vehicle.
        position: Of the first vehicle's centre in m; the others stand behind it with their couplers at rest.
        sample_time: In s, a whole number of steps.
        time_step: In s.

    Raises:
        ConfigError: If a speed does not fit.
        StabilityError: If a sample does not hold a whole number of steps.

    Example:
        >>> from sysid.rail.dynamics.train import heavy_haul
        >>> train = MovingTrain(train=heavy_haul(pairs=1), track=TrackProfile.level(), speed=10.0)
        >>> motion = train.advance(np.zeros((10, 3)))
        >>> bool(9.98 < motion.speeds[-1].mean() < 10.0)
        True
    """

    def __init__(
        self,
        *,
        train: Train,
        track: TrackProfile,
        speed: NDArray[np.float64] | float = 0.0,
        position: float = 0.0,
        sample_time: float = 0.1,
        time_step: float = STEP,
    ) -> None:
        n = len(train.vehicles)
        steps = round(sample_time / time_step) if time_step > 0.0 else 0
        if steps < 1 or not np.isclose(steps * time_step, sample_time, rtol=1e-9, atol=0.0):
            raise StabilityError(
                "a sample does not hold a whole number of time steps",
                where="sample_time",
                expected=f"a multiple of {time_step:g} s",
                got=f"{sample_time:g} s",
                remedy="choose a time_step that divides the sample time",
            )
        speeds = np.asarray(speed, dtype=np.float64)
        if speeds.shape not in {(), (n,)} or not np.isfinite(speeds).all():
            raise ConfigError(
                "the speed does not fit the train",
                where="speed",
                expected=f"one number in m/s, or {n} of them",
                got=f"shape {speeds.shape}",
            )
        self.train, self.track = train, track
        self.sample_time, self._steps, self._time_step = sample_time, steps, time_step
        self._fleet, self._line = _fleet(train), _line(track)
        self.state = _initial(train, track, np.array(np.broadcast_to(speeds, (n,))), position)
        self._work = _scratch(n)

    @property
    def time(self) -> float:
        """Seconds since the beginning."""
        return float(self.state.clock[0])

    @property
    def speed(self) -> float:
        """Of the centre of mass in m/s."""
        return float(self.train.masses @ self.state.speed / self.train.mass)

    @property
    def energies(self) -> Energies:
        """Energy now, from positions and speeds alone."""
        masses, state = self.train.masses, self.state
        extensions = state.position[:-1] - state.position[1:] - self.train.spacings
        return Energies(
            kinetic=float(0.5 * masses @ state.speed**2),
            stored=sum(self.train.coupler(j).energy(float(d)) for j, d in enumerate(extensions)),
            potential=float(GRAVITY * masses @ self.track.elevation(state.position)),
        )

    @property
    def momentum(self) -> float:
        """In N s, from the speeds alone."""
        return float(self.train.masses @ self.state.speed)

    @property
    def works(self) -> dict[str, float]:
        """Done on the train in J since the beginning, by what did it."""
        return dict(zip(kernel.WORKS, (float(work) for work in self.state.work), strict=True))

    @property
    def impulse(self) -> float:
        """Of all external forces in N s since the beginning."""
        return float(self.state.impulse[0])

    def peak(self, *, draft: bool) -> Peak:
        """The largest draft or buff force so far.

        Args:
            draft: Whether draft or buff.

        Returns:
            The peak; its force is 0 if there was none.
        """
        forces = self.state.peak[:, 0 if draft else 2]
        if not len(forces):
            return Peak(force=0.0, coupler=0, time=0.0)
        at = int(np.argmax(forces) if draft else np.argmin(forces))
        return Peak(force=float(forces[at]), coupler=at + 1, time=float(self.state.peak[at, 1 if draft else 3]))

    def advance(self, cylinder_pressures: NDArray[np.float64], *, notch: NDArray[np.int64] | int = 0) -> Motion:
        """Advance by as many samples as there are rows of pressures.

        Args:
            cylinder_pressures: Pa gauge, shape ``(n_samples, n_vehicles)``, held within each sample.
            notch: For all powered vehicles one number, one per sample, or one per sample and vehicle.

        Returns:
            What the train did.

        Raises:
            ConfigError: If pressures or notches do not fit the train.
            StabilityError: If a step cannot be solved.
        """
        n = len(self.train.vehicles)
        pressures = np.ascontiguousarray(cylinder_pressures, dtype=np.float64)
        if pressures.ndim != 2 or pressures.shape[1] != n or not np.isfinite(pressures).all():
            raise ConfigError(
                "the cylinder pressures do not fit the train",
                where="cylinder_pressures",
                expected=f"finite Pa gauge, shape (n_samples, {n})",
                got=f"shape {pressures.shape}",
            )
        drive = kernel.Drive(pressure=pressures, notch=self._notches(notch, len(pressures)))
        began = self.time
        trail, tension = np.empty((len(pressures), 2, n)), np.empty((len(pressures), n - 1))
        totals = np.empty((len(pressures), len(kernel.WORKS)))
        done = kernel.advance(
            self.state, drive, self._fleet, self._line, self._work, self._steps, self._time_step, TURN_SPEED, GRAVITY,
            trail, tension, totals,
        )  # fmt: skip
        if done < len(pressures):
            raise StabilityError(
                "a step of the train could not be solved",
                where=f"at {self.time:.3f} s",
                expected="speeds and coupler forces of a train",
                got=f"speeds from {self.state.speed.min():.3g} to {self.state.speed.max():.3g} m/s",
                remedy="check masses, couplers and pressures, or take a smaller time_step",
            )
        time = began + self.sample_time * np.arange(1, len(pressures) + 1, dtype=np.float64)
        return Motion(time=time, positions=trail[:, 0], speeds=trail[:, 1], forces=tension, works=totals)

    def _notches(self, notch: NDArray[np.int64] | int, samples: int) -> NDArray[np.int64]:
        n, given = len(self.train.vehicles), np.asarray(notch)
        if given.dtype.kind != "i" or given.shape not in {(), (samples,), (samples, n)}:
            raise ConfigError(
                "the notches do not fit the record",
                where="notch",
                expected=f"whole numbers: one, {samples}, or shape ({samples}, {n})",
                got=f"{given.dtype}, shape {given.shape}",
            )
        full = np.zeros((samples, n), dtype=np.int64)
        for i in self.train.powered:
            full[:, i] = given[:, i] if given.ndim == 2 else given
            curves = self.train.vehicles[i].notches
            low, high = (0, 0) if curves is None else (curves.lowest, curves.highest)
            if full[:, i].min(initial=0) < low or full[:, i].max(initial=0) > high:
                raise ConfigError(
                    "there is no such notch",
                    where=f"vehicle {i + 1}",
                    expected=f"{low} to {high}",
                    got=f"{full[:, i].min()} to {full[:, i].max()}",
                )
        return full


def _fleet(train: Train) -> kernel.Fleet:
    vehicles, n = train.vehicles, len(train.vehicles)
    families: list[object] = []
    curves = np.full(n, -1, dtype=np.int64)
    for i in train.powered:
        family = vehicles[i].notches
        known = [k for k, other in enumerate(families) if other is family]
        curves[i] = known[0] if known else len(families)
        if not known:
            families.append(family)
    sets = [vehicles[i].notches for i in (int(np.argmax(curves == k)) for k in range(len(families)))]
    tables = [family.table() for family in sets if family is not None] or [np.zeros((1, 2))]
    shape = tuple(max(table.shape[axis] for table in tables) for axis in (0, 1))
    forces = np.zeros((len(tables), *shape))
    for k, table in enumerate(tables):
        forces[k, : table.shape[0], : table.shape[1]] = table
        forces[k, : table.shape[0], table.shape[1] :] = table[:, -1:]
    riggings = [vehicle.rigging for vehicle in vehicles]
    return kernel.Fleet(
        mass=train.masses,
        davis=np.array([[v.davis.a, v.davis.b, v.davis.c] for v in vehicles]),
        gain=np.array([0.0 if r is None else r.gain for r in riggings]),
        spring=np.array([0.0 if r is None else r.spring_pressure for r in riggings]),
        shoe=np.array(
            [(1.0, 1.0, 1.0) if r is None else (r.shoe.base, r.shoe.reference, r.shoe.slope) for r in riggings]
        ),
        curves=curves,
        spacing=train.spacings,
        coupler=np.array([train.coupler(j).row for j in range(n - 1)]).reshape(n - 1, 8),
        forces=forces,
        zero_notch=np.array([-family.lowest for family in sets if family is not None] or [0], dtype=np.int64),
        speed_step=np.array([family.speed_step for family in sets if family is not None] or [1.0]),
    )


def _line(track: TrackProfile) -> kernel.Track:
    return kernel.Track(
        starts=np.array(track.starts),
        grade=np.array(track.grades),
        elevation=track.elevations,
        curve=CURVE_RESISTANCE * np.array(track.curvatures),
    )


def _initial(train: Train, track: TrackProfile, speed: NDArray[np.float64], position: float) -> kernel.State:
    n = len(train.vehicles)
    places = position - train.offsets
    return kernel.State(
        position=places,
        speed=speed,
        rate=np.zeros(n),
        segment=np.maximum(np.searchsorted(track.starts, places, side="right") - 1, 0).astype(np.int64),
        work=np.zeros(len(kernel.WORKS)),
        impulse=np.zeros(1),
        peak=np.zeros((n - 1, 4)),
        clock=np.zeros(1),
    )


def _scratch(n: int) -> kernel.Work:
    return kernel.Work(
        end=np.zeros(n),
        at=np.zeros(n, dtype=np.int64),
        residual=np.zeros(n),
        diagonal=np.zeros(n),
        off=np.zeros(max(n - 1, 0)),
        pull=np.zeros(max(n - 1, 0)),
        rub=np.zeros(max(n - 1, 0)),
        parts=np.zeros((n, 5)),
    )
