"""A fit put aside: what Levenberg-Marquardt needs to go on as if it had never been stopped.

A sweep looks at many short fits and goes on with some; those must end where an undisturbed fit would have ended, or
the sweep's choice would depend on how often it looked. Everything that is not recomputed is kept, to the last bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from sysid.errors import ConfigError
from sysid.estimation.least_squares.damping import damping_of
from sysid.estimation.least_squares.evidence import Prior
from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.state import Iteration, State
from sysid.estimation.results.result import Evidence

MEASURED = ("mse", "damping", "effective_parameters", "elapsed_s")
"""Figures of an iteration."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Checkpoint:
    """Where a fit stands, as plain numbers; made by one fit and taken by a later one of the same structure and data.

    Args:
        fields: JSON values.
    """

    fields: Mapping[str, Any]

    @classmethod
    def of(cls, state: State) -> Checkpoint:
        """Put a fit aside.

        Args:
            state: Where it stands.

        Returns:
            The checkpoint.
        """
        prior = state.prior
        return cls(
            fields={
                "theta": state.theta.tolist(),
                "iteration": state.iteration,
                "damping": state.damping.to_dict(),
                "alphas": prior.alphas.tolist(),
                "beta": prior.beta,
                "evidence": None if state.evidence is None else asdict(state.evidence),
                "losses": list(state.losses),
                "curve": [asdict(entry) for entry in state.curve],
            }
        )

    def state(self, provider: AbstractProvider, prior: Prior) -> State:
        """The fit as it stood.

        Args:
            provider: Residuals and Jacobians, as before.
            prior: Centre and groups, as before; the precisions are the checkpoint's.

        Returns:
            The state.

        Raises:
            ConfigError: If the checkpoint is of another structure.
        """
        kept = self.fields
        theta, alphas = np.array(kept["theta"], dtype=np.float64), np.array(kept["alphas"], dtype=np.float64)
        if theta.shape != prior.centre.shape or alphas.shape != prior.alphas.shape:
            raise ConfigError(
                "the checkpoint is of another structure",
                where="resume",
                expected=f"{len(prior.centre)} parameters",
                got=f"{len(theta)} parameters",
                remedy="go on with the structure that was put aside",
            )
        evidence = kept["evidence"]
        return State(
            theta=theta,
            at=provider.linearise(theta),
            damping=damping_of(kept["damping"]),
            iteration=int(kept["iteration"]),
            prior=replace(prior, alphas=alphas, beta=float(kept["beta"])),
            evidence=None if evidence is None else Evidence(**evidence),
            losses=tuple(float(loss) for loss in kept["losses"]),
            # A number that JSON has no word for is kept as a string.
            curve=tuple(
                Iteration(iteration=int(entry["iteration"]), **{name: float(entry[name]) for name in MEASURED})
                for entry in kept["curve"]
            ),
        )
