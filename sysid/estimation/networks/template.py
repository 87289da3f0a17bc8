"""A NARX network before its fit: everything but its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sysid.estimation.networks.initialise import Layout
from sysid.estimation.records.experiment import Experiment, unit_range, unit_ranges
from sysid.estimation.records.output_ends import ends_of, ends_of_several, told
from sysid.models import NARX, Mapping, NARXModel, VectorNARX, VectorNARXModel
from sysid.traces import Trace


def layout_of(model: NARXModel | VectorNARXModel) -> Layout:
    """Where the parameters of a network stand.

    Args:
        model: The network.

    Returns:
        The layout.
    """
    return Layout.of(model.network, len(model.mapping.inputs), len(model.mapping.outputs))


def template_of(
    first: Trace,
    mapping: Mapping,
    network: NARX | VectorNARX,
    experiments: Sequence[Experiment],
    *,
    rests: tuple[float, ...],
) -> NARXModel | VectorNARXModel:
    """The model but for its parameters.

    Args:
        first: A trace, for sample time and units.
        mapping: Which channels go in, which come out.
        network: The structure.
        experiments: The records, for the scaling and what holds outputs.
        rests: Outputs at rest.

    Returns:
        The model; its parameters leave every output as it is.

    Raises:
        ConfigError: If limits are to be found, and there are none.
    """
    layout = Layout.of(network, len(mapping.inputs), len(mapping.outputs))
    shared: dict[str, Any] = {
        "theta": layout.centre(),
        "mapping": mapping,
        "sample_time": first.sample_time,
        "input_units": tuple(first.channel(name).unit for name in mapping.inputs),
    }
    units = tuple(first.channel(name).unit for name in mapping.outputs)
    if isinstance(network, VectorNARX):
        return VectorNARXModel(
            network=network,
            scaling=unit_ranges(experiments),
            output_units=units,
            rest_outputs=rests,
            between=ends_of_several(network.limits, experiments, mapping.outputs),
            **shared,
        )
    return NARXModel(
        network=network,
        scaling=unit_range(experiments),
        output_unit=units[0],
        rest_output=rests[0],
        between=ends_of(network.limits, experiments, mapping.output),
        **shared,
    )


def held_told(model: NARXModel | VectorNARXModel) -> list[str]:
    """What holds the outputs of a network, in sentences.

    Args:
        model: The network.

    Returns:
        One an output that is held.
    """
    between = (model.between,) if isinstance(model, NARXModel) else model.between
    units = (model.output_unit,) if isinstance(model, NARXModel) else model.output_units
    held = zip(between, model.mapping.outputs, units, strict=False)  # of none, none
    return [told(sides, name, unit) for sides, name, unit in held if sides != (None, None)]
