"""Which inputs say anything: one that never changes, or is made of others, leaves its own transfer function open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid.estimation.experiment import Experiment
from sysid.estimation.informative import informative
from sysid.estimation.linear.poles import sections_of
from sysid.models import Domain, Mapping, Scaling, TransferFunction, TransferFunctionModel


@dataclass(frozen=True, kw_only=True, eq=False)
class Determined:
    """The inputs that data determine a response to.

    Args:
        kept: Their places among all inputs; one at least.
    """

    kept: tuple[int, ...]

    @classmethod
    def of(cls, experiments: Sequence[Experiment]) -> Determined:
        """Look at some records.

        Args:
            experiments: The records; masked samples say nothing.

        Returns:
            What they determine.
        """
        seen = [e.inputs if e.usable is None else e.inputs[e.usable] for e in experiments]
        whole = np.concatenate(seen) if sum(map(len, seen)) else np.concatenate([e.inputs for e in experiments])
        return cls(kept=informative(whole) or (0,))

    def narrowed(self, orders: TransferFunction) -> TransferFunction:
        """The structure of the inputs that are kept.

        Args:
            orders: Of all inputs.

        Returns:
            Their structure.
        """
        poles, zeros = (tuple(of[j] for j in self.kept) for of in (orders.poles, orders.zeros))
        delays = None if orders.delays is None else tuple(orders.delays[j] for j in self.kept)
        return replace(orders, poles=poles, zeros=zeros, delays=delays)

    def only(self, experiment: Experiment) -> Experiment:
        """A record with the inputs that are kept.

        Args:
            experiment: With all inputs.

        Returns:
            The record.
        """
        own = list(self.kept)
        history = replace(experiment.history, inputs=experiment.history.inputs[:, own])
        return replace(experiment, inputs=experiment.inputs[:, own], history=history)

    def widened(
        self, model: TransferFunctionModel, orders: TransferFunction, mapping: Mapping, scaling: Scaling
    ) -> TransferFunctionModel:
        """The model over all inputs: the others have no effect.

        Args:
            model: Of the inputs that are kept.
            orders: Of all inputs.
            mapping: With all inputs.
            scaling: Of all inputs.

        Returns:
            The model.
        """
        at = {j: place for place, j in enumerate(self.kept)}
        sections, taps, delays, offsets, scales = [], [], [], [], []
        for j, (poles, zeros) in enumerate(zip(orders.poles, orders.zeros, strict=True)):
            if j in at:
                sections.append(model.sections[at[j]])
                taps.append(model.taps[at[j]])
                delays.append(model.delays[at[j]])
                offsets.append(model.scaling.input_offset[at[j]])
                scales.append(model.scaling.input_scale[at[j]])
                continue
            rates = np.linspace(0.2, 0.5, poles)
            places = rates if orders.domain is Domain.DISCRETE else np.log(rates) / model.sample_time
            sections.append(sections_of(places.astype(np.complex128), orders.domain))
            taps.append(np.zeros(zeros + 1))
            delays.append(0 if orders.delays is None else orders.delays[j])
            offsets.append(scaling.input_offset[j])
            scales.append(scaling.input_scale[j])
        return replace(
            model,
            orders=replace(orders, delays=tuple(delays)),
            sections=tuple(sections),
            taps=tuple(taps),
            scaling=replace(model.scaling, input_offset=tuple(offsets), input_scale=tuple(scales)),
            mapping=mapping,
        )
