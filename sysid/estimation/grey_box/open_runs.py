"""How far what records leave open of a fit moves its free run, on commands that the system may be given next.

Pieces of a curve that no sample reached, a scale between two blocks, coefficients that stand for each other: a fit of
more parameters than its records show has some of these as a rule, and most move nothing that anybody will see. So it is
asked of runs: the part of their variance that is due to the parameters (linearised, as that of intervals), over pieces
of the records' inputs in another order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sysid.errors import TraceError
from sysid.estimation.networks.posterior import Posterior
from sysid.estimation.parameters.findings import Findings
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import Loop
from sysid.estimation.stability.other_commands import OtherCommands
from sysid.models import AbstractModel
from sysid.traces import Trace

COMMANDS, SEED = 20, 20
"""Sequences that are run, and their seed."""

FAR = 0.01
"""Share of an output's range by which a run may be moved, where the noise is less."""

RARE = 0.01
"""Share of the samples on which it may be moved further: other pieces reach a little beyond what was recorded."""


@dataclass(frozen=True, kw_only=True)
class OpenRuns:
    """How far free runs are open.

    Args:
        share: Of the samples, on which an output may be moved by more than the noise and :data:`FAR`.
    """

    share: float

    @classmethod
    def of(cls, model: AbstractModel, posterior: Posterior, traces: Sequence[Trace]) -> OpenRuns | None:
        """What a posterior says of the runs of its model.

        Args:
            model: The model.
            posterior: Of its parameters.
            traces: What it was fitted to.

        Returns:
            What was found; ``None`` where the traces are too short to make commands of.
        """
        try:
            commands = OtherCommands.of(traces, model.mapping.inputs, model.mapping.outputs)
        except TraceError:
            return None
        several = model.structure.several_outputs
        low, high = commands.output_range
        noise = np.sqrt(np.atleast_1d(posterior.noise.of(Loop.CLOSED)))
        limit, far = np.maximum(noise, FAR * (high - low)), []
        for one in commands.draw(COMMANDS, SEED):
            output = one.targets if several else one.targets[:, 0]
            run = Experiment(inputs=one.inputs, output=output, history=one.history(several=several))
            variance = posterior.parameter_variance(model, run, Loop.CLOSED).reshape(len(one.inputs), -1)
            far.append(~(variance <= limit**2).all(axis=1))  # what explodes is open, as NaN is
        return cls(share=float(np.mean(np.concatenate(far))))

    def told(self, findings: Findings) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """What a fit says of it.

        Args:
            findings: What is known of its parameters.

        Returns:
            Notes and warnings: a warning where runs are open, a note where parameters alone are.
        """
        left = findings.left_open
        if self.share > RARE:
            which = f"{left} parameters apart from the others" if left else "its parameters well enough"
            return (), (
                f"On commands that are made of the record's own inputs in another order, {100.0 * self.share:.2g} % of "
                f"the free run is open by more than the noise and {100.0 * FAR:g} % of the output's range: the record "
                f"does not tell {which}. A simpler curve, fewer pieces, states or terms would do; or record more of "
                "the range.",
            )
        if not left:
            return (), ()
        return (
            f"The record does not tell {left} parameters apart from the others, which hardly moves the free run on "
            "commands made of its own inputs; beyond their range it is open.",
        ), ()
