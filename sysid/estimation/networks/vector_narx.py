"""Networks of several outputs: channels that act on each other within a sample, fitted as one in free run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.networks.joint import CascadeFit, Joint, JointTraining
from sysid.estimation.networks.member_layout import JointLayout, MemberLayout
from sysid.estimation.networks.training import FitProgress
from sysid.models import Cascade, Scaling, VectorMapping, VectorNARX, VectorNARXModel, VectorScaling
from sysid.models.cascade_program import Limit, Part
from sysid.traces import Trace


def fit_vector_narx(
    traces: Sequence[Trace],
    mapping: VectorMapping,
    network: VectorNARX,
    training: JointTraining | None = None,
    *,
    rest: Dict[str, float | str] | None = None,
    limits: Dict[str, Limit] | None = None,
    targets: Dict[str, float] | None = None,
    selection: Sequence[Trace] = (),
    initial: VectorNARXModel | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> CascadeFit:
    """Fit a network of several outputs in free run, from random starts.

    Args:
        traces: Estimation traces; a run over each begins at rest.
        mapping: Which channels go in, which come out.
        network: The structure.
        training: How to train; 500 iterations of one start by default.
        rest: Levels at rest, as for :class:`~sysid.models.Cascade`; by default the mean of the traces' first samples.
        limits: Limits of outputs.
        targets: For each output the error in its unit that counts as one; by default a hundredth of its range, so that
            all outputs count alike.
        selection: Traces that choose among starts and states.
        initial: A model of the same structure whose parameters are the first start.
        on_progress: Called after every iteration.

    Returns:
        The fit; its model is a cascade with the network as its one member.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the structure does not fit the mapping, or ``initial`` has another structure or mapping.
    """
    training = training or JointTraining(max_iterations=500, patience=50)
    template = _template(traces, mapping, network)
    _check_initial(initial, template)
    cascade = Cascade(models=(initial or template,), rest=rest or {}, limits=limits or {})
    # Scaled to -1 to 1, a range is two scales wide.
    errors = targets or {
        name: 0.02 * scale for name, scale in zip(mapping.outputs, template.scaling.output_scale, strict=True)
    }
    provider = training.provider(cascade, traces, errors)
    records = [{name: trace[name] for name in (*mapping.inputs, *mapping.outputs)} for trace in traces]
    layout = JointLayout.of(provider.members, records)
    starts: list[tuple[int | None, NDArray[np.float64]]] = []
    if initial is not None:
        starts.append((None, layout.in_basis(provider.theta)))
    starts += [
        (seed, layout.draw(seed)) for seed in range(training.seed, training.seed + training.starts - len(starts))
    ]
    joint = Joint(provider=provider, layout=layout, training=training, selection=selection, on_progress=on_progress)
    return joint.fit(starts)


def _check_initial(initial: VectorNARXModel | None, template: VectorNARXModel) -> None:
    if initial is not None and (initial.network, initial.mapping) != (template.network, template.mapping):
        raise ConfigError(
            "the initial model has another structure",
            where="initial",
            expected=f"{template.mapping} {template.network.label}",
            got=f"{initial.mapping} {initial.network.label}",
            remedy="give a model with the same channels, delays and neurons, or leave initial out",
        )


def _template(traces: Sequence[Trace], mapping: VectorMapping, network: VectorNARX) -> VectorNARXModel:
    """The model that holds its outputs."""
    inputs = [trace.columns(mapping.inputs) for trace in traces]
    scalings = [Scaling.to_unit_range(inputs, [trace[name] for trace in traces]) for name in mapping.outputs]
    model = VectorNARXModel(
        network=network,
        theta=np.zeros(network.parameter_count(len(mapping.inputs), len(mapping.outputs))),
        scaling=VectorScaling(
            input_offset=scalings[0].input_offset,
            input_scale=scalings[0].input_scale,
            output_offset=tuple(scaling.output_offset for scaling in scalings),
            output_scale=tuple(scaling.output_scale for scaling in scalings),
        ),
        mapping=mapping,
        sample_time=traces[0].sample_time,
        input_units=tuple(traces[0].channel(name).unit for name in mapping.inputs),
        output_units=tuple(traces[0].channel(name).unit for name in mapping.outputs),
        rest_outputs=tuple(float(np.mean([trace[name][0] for trace in traces])) for name in mapping.outputs),
    )
    part = Part.of(model)
    return model.with_theta(MemberLayout.of(model, part).centre()) if part else model
