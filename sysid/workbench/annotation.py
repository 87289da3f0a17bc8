"""Annotators: what says in which state each sample of a trace is, found by name among the installed packages.

An annotator is an object registered in the entry-point group ``sysid.annotators``. It adds a channel of whole numbers,
each of which is a state with a name. What the states are is its own business.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
from pydantic import BaseModel, Field

from sysid.errors import ConfigError
from sysid.plugins import find_plugin
from sysid.traces import Trace, TraceSet
from sysid.validation import CaseResult, Evaluation
from sysid.validation.annotator import Annotator
from sysid.validation.metrics import figures
from sysid.workbench.old_words import STRICT

GROUP = "sysid.annotators"


class AnnotateConfig(BaseModel):
    """States along the traces of a pipeline.

    Args:
        by: Name of the annotator.
        weights: What a sample counts in the loss of a fit, by the name of its state; 1 where a state is not named.
    """

    model_config = STRICT

    by: str
    weights: dict[str, float] = Field(default_factory=dict)


def find_annotator(name: str, *, where: object) -> Annotator:
    """The annotator of a name.

    Args:
        name: For example ``"brake-states"``.
        where: Who asks for it, for errors.

    Returns:
        The annotator.

    Raises:
        ConfigError: If none of that name is installed.
    """
    annotator: Annotator = find_plugin(GROUP, name, what="annotator", where=where)
    return annotator


def annotated_set(traces: TraceSet, annotator: Annotator) -> TraceSet:
    """A data set with the states of every trace.

    Args:
        traces: The data set.
        annotator: What knows the states.

    Returns:
        The data set with one channel more.

    Raises:
        ChannelError: If a trace lacks a channel that the annotator needs.
    """
    return dataclasses.replace(traces, traces=tuple(annotator(trace) for trace in traces))


def weighted(trace: Trace, annotator: Annotator, weights: Mapping[str, float]) -> Trace:
    """A trace whose samples weigh by their state, one on average.

    Args:
        trace: An annotated trace.
        annotator: That annotated it.
        weights: By the name of the state; 1 where a state is not named.

    Returns:
        The trace with weights; the same without, where no weight is given.

    Raises:
        ConfigError: If a name is no state, or a weight is negative or leaves nothing.
    """
    if not weights:
        return trace
    strangers = sorted(set(weights) - set(annotator.labels))
    if strangers or min(weights.values()) < 0.0:
        raise ConfigError(
            "the weights cannot be used",
            where="annotate, weights",
            expected=f"numbers from 0 on for {', '.join(annotator.labels)}",
            got=", ".join(f"{name}: {value:g}" for name, value in weights.items()),
            remedy="correct the name or the number",
        )
    table = np.array([weights.get(label, 1.0) for label in annotator.labels])
    of_samples = table[trace[annotator.channel].astype(np.int64)]
    mean = float(of_samples[trace.usable_samples].mean())
    if mean <= 0.0:
        raise ConfigError(
            f"no sample of {trace.name} is left to fit",
            where="annotate, weights",
            expected="a weight above 0 for a state that occurs",
            got=", ".join(f"{name}: {value:g}" for name, value in weights.items()),
        )
    # The evidence takes samples for as many observations as there are: on average each stays one.
    return dataclasses.replace(trace, weights=of_samples / mean)


def by_state(evaluation: Evaluation, traces: TraceSet, annotator: Annotator) -> Evaluation:
    """An evaluation with the figures of the free run state by state.

    Args:
        evaluation: On annotated traces.
        traces: These.
        annotator: That annotated them.

    Returns:
        The same with ``by_state`` in each case.
    """

    def split(case: CaseResult) -> CaseResult:
        trace, scored = traces[case.case], slice(case.first, None)
        states, counted = trace[annotator.channel][scored].astype(np.int64), trace.usable_samples[scored]
        found = {}
        for number, label in enumerate(annotator.labels):
            chosen = counted & (states == number)
            if chosen.any():
                one = figures(case.target, case.simulated, case.free_run.unit, chosen)
                found[label] = (one, float(chosen.sum() / counted.sum()))
        return dataclasses.replace(case, by_state=found)

    return Evaluation(cases={name: split(case) for name, case in evaluation.cases.items()})
