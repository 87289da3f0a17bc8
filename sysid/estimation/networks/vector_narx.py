"""Networks of several outputs: channels that act on each other within a sample, fitted as one in free run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.posterior import Posterior, calibrate, laplace
from sysid.estimation.networks.together.fit import Joint
from sysid.estimation.networks.together.layout import JointLayout
from sysid.estimation.networks.together.options import JointTraining
from sysid.estimation.networks.together.result import CascadeFit
from sysid.estimation.networks.training import FitProgress
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.records.output_ends import ends_of_several, told
from sysid.estimation.results.result import FitResult, Loop
from sysid.models import (
    AbstractStructure,
    Cascade,
    Mapping,
    Scaling,
    Start,
    StartKind,
    VectorNARX,
    VectorNARXModel,
    VectorScaling,
    beginning,
)
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.traces import Trace

DEFAULT = JointTraining(max_iterations=500, patience=50)


def fit_vector_narx(
    traces: Sequence[Trace],
    mapping: Mapping,
    network: VectorNARX,
    training: JointTraining | None = None,
    *,
    start: Start | None = None,
    rest_output: Dict[str, float] | None = None,
    targets: Dict[str, float] | None = None,
    selection: Sequence[Trace] = (),
    initial: FitResult | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit a network of several outputs in free run, from random starts.

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which come out.
        network: The structure.
        training: How to train; 500 iterations of one start by default.
        start: What stands before each record; at rest by default. Where nothing is known of what came before it, a run
            begins where all lags are measured.
        rest_output: Outputs at rest by name, in their units; the mean of the traces' first samples where not given.
        targets: For each output the error in its unit that counts as one; by default a hundredth of its range, so that
            all outputs count alike.
        selection: Traces that choose among starts and states.
        initial: A fit of the same structure whose parameters are the first start.
        on_progress: Called after every iteration.

    Returns:
        The fit; its errors are mean squares over the outputs, in the targets.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the structure does not fit the mapping, or ``initial`` has another structure or mapping.
    """
    training = training or DEFAULT
    template = _template(traces, mapping, network, rest_output or {})
    begun = None if initial is None else initial.model
    _check_initial(begun, template)
    cascade = Cascade(models=(begun or template,))
    # Scaled to -1 to 1, a range is two scales wide.
    errors = targets or {
        name: 0.02 * scale for name, scale in zip(mapping.outputs, template.scaling.output_scale, strict=True)
    }
    begin = start or Start()
    from_record = begin.kind in {StartKind.MEASURED, StartKind.ESTIMATED}
    rests, lags = np.array(template.rest_outputs), template.lags

    def record(trace: Trace) -> Experiment:
        return Experiment.from_trace(trace, mapping, begin, rests).from_measured(lags)

    def scored(model: Cascade, trace: Trace) -> tuple[dict[str, NDArray[np.float64]], int]:
        one, inputs = model.models[0], trace.columns(mapping.inputs)
        begun = beginning(one, inputs, trace.columns(mapping.outputs), begin, trace.usable_samples)
        run = one.simulate(inputs[begun.first :], begun.history)
        return dict(zip(mapping.outputs, run.T, strict=True)), begun.first

    provider = training.provider(
        cascade,
        traces,
        errors,
        begins=lambda trace: {} if begin.kind is StartKind.REST else _first(trace, mapping),
        measured=record if from_record else None,
    )
    records = [{name: trace[name] for name in (*mapping.inputs, *mapping.outputs)} for trace in traces]
    layout = JointLayout.of(provider.members, records)
    starts: list[tuple[int | None, NDArray[np.float64]]] = []
    if begun is not None:
        starts.append((None, layout.in_basis(provider.theta)))
    starts += [
        (seed, layout.draw(seed)) for seed in range(training.seed, training.seed + training.starts - len(starts))
    ]
    joint = Joint(
        provider=provider,
        layout=layout,
        training=training,
        selection=selection,
        on_progress=on_progress,
        scored=scored if from_record else None,
    )
    fit = joint.fit(starts)
    found = _result(fit)
    held = zip(mapping.outputs, template.output_units, template.between, strict=False)  # of none, none
    notes = [told(sides, name, unit) for name, unit, sides in held if sides != (None, None)]
    return replace(found, notes=(*found.notes, *notes), posterior=_posterior(fit, layout, traces, selection, begin))


def _posterior(
    fit: CascadeFit, layout: JointLayout, traces: Sequence[Trace], selection: Sequence[Trace], start: Start
) -> Posterior | None:
    """Of the network's weights; none of a start that was kept as it was given."""
    model = fit.model.models[0]
    if fit.solution is None:
        return None
    runs, others = ([Experiment.for_model(trace, model, start) for trace in some] for some in (traces, selection))
    found = laplace(fit.solution.state, model, layout.to_plain, runs, copies=1)
    return None if found is None else calibrate(found, model, others)


def check_vector_initial(structure: AbstractStructure, initial: AbstractStructure, n_inputs: int) -> None:
    """Refuse a fit that a network of several outputs cannot start from.

    Args:
        structure: What is to be fitted.
        initial: What the initial fit is of.
        n_inputs: Inputs of the mapping.

    Raises:
        ConfigError: If it has another structure.
    """
    del n_inputs
    if structure != initial:
        raise _other_structure(structure.label, initial.label)


def _first(trace: Trace, mapping: Mapping) -> dict[str, float]:
    """The outputs at the first sample that is not masked."""
    usable = trace.usable_samples
    row = int(np.argmax(usable)) if usable.any() else 0
    return {name: float(trace[name][row]) for name in mapping.outputs}


def _result(fit: CascadeFit) -> FitResult:
    """A fit of a cascade of one member as the fit of that member."""
    history = dict(fit.history)
    history["mse"] = history.pop("loss")
    sizes = ", ".join(f"{name} {error:.3g}" for name, error in fit.errors.items())
    return FitResult(
        model=fit.model.models[0],
        status=fit.status,
        loop=Loop.CLOSED,
        history=history,
        train_time_s=fit.train_time_s,
        seed=fit.seed,
        evidence=fit.evidence,
        attempts=fit.attempts,
        notes=(*fit.notes, *fit.warnings, f"Errors that weigh the same: {sizes}."),
        warnings=fit.warnings,
    )


def _check_initial(initial: object, template: VectorNARXModel) -> None:
    if initial is None:
        return
    structure, mapping = getattr(initial, "structure", None), getattr(initial, "mapping", None)
    if (structure, mapping) != (template.network, template.mapping):
        label = getattr(structure, "label", type(initial).__name__)
        raise _other_structure(f"{template.mapping} {template.network.label}", f"{mapping} {label}")


def _other_structure(expected: str, got: str) -> ConfigError:
    return ConfigError(
        "the initial fit has another structure",
        where="initial",
        expected=expected,
        got=got,
        remedy="give a fit with the same channels, delays and neurons, or leave initial out",
    )


def _template(
    traces: Sequence[Trace], mapping: Mapping, network: VectorNARX, rest: Dict[str, float]
) -> VectorNARXModel:
    """The model that holds its outputs."""
    inputs = [trace.columns(mapping.inputs) for trace in traces]
    scalings = [Scaling.to_unit_range(inputs, [trace[name] for trace in traces]) for name in mapping.outputs]
    model = VectorNARXModel(
        network=network,
        theta=np.zeros(network.parameter_count(len(mapping.inputs), len(mapping.outputs))),
        scaling=VectorScaling.of(scalings),
        mapping=mapping,
        sample_time=traces[0].sample_time,
        input_units=tuple(traces[0].channel(name).unit for name in mapping.inputs),
        output_units=tuple(traces[0].channel(name).unit for name in mapping.outputs),
        rest_outputs=tuple(
            rest[name] if name in rest else float(np.mean([trace[name][0] for trace in traces]))
            for name in mapping.outputs
        ),
    )
    records = [
        (t.columns(mapping.inputs)[t.usable_samples], t.columns(mapping.outputs)[t.usable_samples]) for t in traces
    ]
    model = replace(model, between=ends_of_several(network.limits, records, mapping.outputs))
    columns = ColumnRecursion.of(model)
    return model.with_theta(Layout.of_member(model, columns).centre()) if columns else model
