"""Options of training whole cascades."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from sysid.errors import ConfigError
from sysid.estimation.least_squares.damping import DAMPINGS
from sysid.estimation.networks.together.provider import CascadeProvider
from sysid.estimation.networks.training import check_choice
from sysid.models import Cascade
from sysid.models.orders.typed_fields import TypedFields
from sysid.traces import Trace

AUTO: Literal["auto"] = "auto"
"""In the place of windows: where the start is far off, of lengths by the records."""


def _check_windows(given: object) -> Literal["auto"] | tuple[int, ...]:
    """What may be asked of windows: numbers of samples, or ``auto``."""
    if given == AUTO:
        return AUTO
    if isinstance(given, list | tuple):
        whole = [one for one in given if type(one) is int and one > 1]
        if len(whole) == len(given) and whole == sorted(set(whole)):
            return tuple(whole)
    raise ConfigError(
        "these are no windows to train on",
        where="windows",
        got=given,
        expected=f"{AUTO}, or numbers of samples above 1, each larger than the one before, as in [200, 800, 2400]",
        remedy="correct them, or leave them out; windows: [] is for none",
    )


@dataclass(frozen=True, kw_only=True)
class JointTraining(TypedFields):
    """How the members of a cascade are trained together, in free run of the whole.

    Args:
        max_iterations: Levenberg-Marquardt iterations of a start that is never dropped.
        max_time_s: Wall time of the whole fit in seconds. A fit that it ends cannot be repeated exactly.
        tolerance: Relative improvement over ``patience`` iterations below which a start has converged.
        patience: Iterations over which improvement is judged.
        checkpoints: How often the selection traces are looked at on the way; the best state seen is kept.
        stride: Every so-manieth sample counts in the loss.
        moves: A sample counts as well where a target has moved by more than so many of its errors since the last that
            counted, and so does the one before it: what comes with a jump is not missed (``counted_rows.py``).
        leverage: How many times as long as their median, at the start, a row of the Jacobian may be before it counts
            less: where sensitivities explode, the few rows that do would forbid every step (``leverage.py``).
        robust_scale: Root mean squared residual of a trace, in the errors that count as one, from which on it counts by
            its logarithm (Cauchy loss): a few traces on which the free run is lost do not rule it (``robust_loss.py``).
        windows: Samples of the windows, the shortest first, on which a second start is trained before it is raced with
            the members as they were: each window is begun with what is measured (``joint_record.py``). ``auto`` takes
            them by the records, and only where the free run of the start is far off (``leading_windows.py``); none for
            no second start.
        damping: How far a step may go, as in :class:`~sysid.estimation.Training`.
        workers: Records that are worked on at the same time.
    """

    max_iterations: int = 100
    max_time_s: float = float("inf")
    tolerance: float = 1e-3
    patience: int = 20
    checkpoints: int = 10
    stride: int = 1
    moves: float = float("inf")
    leverage: float = float("inf")
    robust_scale: float = float("inf")
    windows: Literal["auto"] | tuple[int, ...] = "auto"
    damping: str = "marquardt"
    workers: int = 2

    def __post_init__(self) -> None:
        check_choice("damping", self.damping, tuple(DAMPINGS))
        for name in ("max_iterations", "patience", "checkpoints", "stride", "workers"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{name} is too small", where=name, expected="1 or more", got=getattr(self, name))
        object.__setattr__(self, "windows", _check_windows(self.windows))
        for name in ("moves", "leverage", "robust_scale"):
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"{name} is too small", where=name, expected="above 0", got=getattr(self, name))

    def provider(
        self,
        cascade: Cascade,
        traces: Sequence[Trace],
        errors: Dict[str, float],
        trained: Sequence[str] | None = None,
    ) -> CascadeProvider:
        """Residuals and Jacobians of a whole as these options have them count; every option that the provider has.

        Args:
            cascade: The whole.
            traces: Estimation traces.
            errors: For each target the error in its unit that counts as one.
            trained: Outputs of the members that are trained; all by default.

        Returns:
            The provider.

        Raises:
            ChannelError: If a trace lacks an input or a target, or a name is no output of the cascade.
            ConfigError: If a member that would have to pass on sensitivities cannot.
        """
        return CascadeProvider(
            cascade=cascade,
            traces=tuple(traces),
            errors=errors,
            trained=None if trained is None else tuple(trained),
            stride=self.stride,
            moves=self.moves,
            leverage=self.leverage,
            robust_scale=self.robust_scale,
            workers=self.workers,
        )
