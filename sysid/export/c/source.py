"""A surrogate as C99 text: one header, one source, nothing but libm."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

import sysid
from sysid.export.c.equations import equation_values
from sysid.export.flags import MEANING
from sysid.export.forms.incremental import IncrementalForm
from sysid.export.forms.layout import EquationState, HiddenState
from sysid.export.forms.programs import ProgramForm
from sysid.export.forms.stage import Level, Side, Stage
from sysid.export.forms.state_space import StateSpaceForm
from sysid.export.heeded import heeded
from sysid.export.surrogate import Surrogate
from sysid.export.templating import c_real, render
from sysid.kernels.neurons import Neuron
from sysid.models.grey_box.state_search import PATIENCE, SHORTER, SLOWLY

PASSED_OVER = "where the inputs say: what init is given of it is passed over"
"""The level at rest of an output whose states do not heed one."""
SHORT = 16
"""Terms up to which a sum is written out term by term: tables and a loop take longer."""


def c_files(surrogate: Surrogate) -> dict[str, str]:
    """The header and the source.

    Args:
        surrogate: What to write.

    Returns:
        Text by file name.
    """
    stages = [_stage(surrogate, stage) for stage in surrogate.stages]
    layers = [stage["neuron"] for stage in stages if stage["kind"] == "lagged" and stage["neurons"]]
    values = {
        "s": surrogate,
        "p": surrogate.identifier,
        "P": surrogate.identifier.upper(),
        "version": sysid.__version__,
        "meaning": MEANING,
        "stages": stages,
        "any_tanh": any(stage["neurons"] and stage["neuron"].name == "tanh" for stage in stages),
        "neurons": _functions(stages),
        "any_layers": any(layers),
        "any_tanh_layers": any(neuron.name == "tanh" for neuron in layers),
        "any_dots": not all(stage["short"] for stage in stages),
        "any_sums": any(stage["adds"] for stage in stages),
        "rest_lines": _rest_lines(surrogate),
        "rest_spaces": _rest_spaces(surrogate),
        "rest_equations": [
            {"stage": at, "first": stage.first, "sources": stage.sources, "targets": stage.targets}
            for at, stage in enumerate(surrogate.stages)
            if isinstance(stage.state, EquationState) and stages[at]["n"]
        ],
        "equations": [stage for stage in stages if stage["kind"] == "equations"],
        "late": [{**asdict(late), "name": surrogate.channels[late.column].name} for late in surrogate.late],
        "levels": [level_text(surrogate, port.level) for port in surrogate.channels],
        "slowly": SLOWLY,
        "shorter": SHORTER,
        "patience": PATIENCE,
        "levels_in_words": [
            _words(port.level) if says else PASSED_OVER
            for port, says in zip(surrogate.outputs, heeded(surrogate), strict=True)
        ],
        "places": _places(surrogate),
    }
    return {f"{surrogate.identifier}.{end}": render(f"surrogate.{end}.j2", **values) for end in ("h", "c")}


def _functions(stages: Sequence[Dict[str, Any]]) -> list[Neuron]:
    """Kinds of neurons that are called one by one; a layer of tanh over lagged regressors has a function of its own."""
    kinds = {
        stage["neuron"].name: stage["neuron"]
        for stage in stages
        if stage["neurons"] and not (stage["kind"] == "lagged" and stage["neuron"].name == "tanh")
    }
    return list(kinds.values())


def level_text(surrogate: Surrogate, level: Level) -> str:
    """A level at rest as an expression over ``inputs``."""
    if isinstance(level, str):
        return f"inputs[{[port.name for port in surrogate.inputs].index(level)}]"
    return f"R({c_real(level)})"


def _places(surrogate: Surrogate) -> dict[str, int]:
    """By channel the output that says where it begins: itself, or the one that it follows."""
    own = {port.name: place for place, port in enumerate(surrogate.outputs)}
    return own | {name: own[led] for name, led in surrogate.following(own).items()}


def _words(level: Level) -> str:
    return f"{level} at the first sample" if isinstance(level, str) else c_real(level)


def _stage(surrogate: Surrogate, stage: Stage) -> dict[str, Any]:
    """The numbers and expressions of one stage."""
    form, n = stage.form, stage.form.n_inputs
    ends = form.ends
    outputs = [
        {
            "name": name,
            "unit": unit,
            "target": target,
            "offset": offset,
            "scale": scale,
            "sides": [_side(surrogate, side) for side in sides],
            "told": told,
            "flag": "IN_DOUBT" if doubt else "AT_LIMIT",
        }
        for name, unit, target, offset, scale, sides, told, doubt in zip(
            ends.outputs,
            ends.output_units,
            stage.targets,
            form.offset[n:],
            form.scale[n:],
            stage.limits,
            stage.told,
            stage.doubts,
            strict=True,
        )
    ]
    common = {
        "title": f"{stage.model.mapping}, {stage.model.label}",
        "first": stage.first,
        "lost": stage.first_remainder,
        "low": form.low if np.isfinite(form.low) else None,
        "high": form.high if np.isfinite(form.high) else None,
        "outputs": outputs,
        "limited": stage.limited,
    }
    for output in outputs:  # the others are at no bound, and at a limit that nobody is told of
        output["raises"] = bool(output["sides"] and output["told"]) or stage.bounded
    if isinstance(form, ProgramForm):
        own = equation_values(stage, surrogate.stages.index(stage))
        return common | own | {"scaled": _scaled(stage, [i in _read_now(form) for i in range(form.n_inputs)])}
    return common | (_state_space(stage) if isinstance(form, StateSpaceForm) else _lagged(stage))


def _read_now(form: ProgramForm) -> set[int]:
    """Inputs whose sample of now is read, or kept."""
    now = {channel for parts in form.given for channel, lag, _ in parts if lag == 0}
    return now | {channel for channel, depth in enumerate(form.depths) if depth}


def _side(surrogate: Surrogate, side: Side) -> dict[str, Any]:
    limit = f"R({c_real(side.value)})" if side.column is None else f"known[{side.column}]"
    name = "" if side.column is None else surrogate.channels[side.column].name
    return {"sign": ">" if side.upper else "<", "limit": limit, "name": name}


def _lagged(stage: Stage) -> dict[str, Any]:
    form, layout = stage.lagged
    incremental = IncrementalForm.of(form)
    late = [source > stage.targets[-1] for source in stage.sources]
    used = [
        not later and (bool(line.length) or 0 in own)
        for later, line, own in zip(late, layout.inputs, form.lags, strict=False)
    ]

    def sample(channel: int, lag: int) -> str:
        return f"past[{layout.lines[channel].column(lag)}]" if lag else f"u{channel}"

    terms = (*incremental.inputs, *incremental.outputs)
    newest = ["" if later else f"u{i}" for i, later in enumerate(late)] + [f"y[{j}]" for j in range(form.n_outputs)]
    return {
        "kind": "lagged",
        "n": len(terms),
        "neurons": form.neurons,
        "neuron": form.neuron,
        "short": not form.neurons and len(terms) <= SHORT,
        "adds": form.adds,
        "weights": incremental.hidden_weights.T,
        "gates": incremental.gates.T if form.gated else [],
        "bias": form.hidden_bias,
        "readout": form.readout,
        "linear": incremental.linear,
        "constant": form.constant,
        "scaled": _scaled(stage, used),
        "terms": [
            sample(t.channel, t.lag) + ("" if t.older is None else f" - {sample(t.channel, t.older)}") for t in terms
        ],
        "last": [layout.column(form.n_inputs + j, 1) - form.n_inputs for j in range(form.n_outputs)],
        "lines": [
            {"first": line.first, "length": line.length, "newest": newest[i]}
            for i, line in enumerate(layout.lines)
            if line.length
        ],
    }


def _state_space(stage: Stage) -> dict[str, Any]:
    form = stage.state_space
    return {
        "kind": "space",
        "short": False,
        "n": form.n_state,
        "neurons": len(form.state_neurons) + len(form.output_neurons),
        "neuron": form.neuron,
        "adds": form.n_state > 0,
        "change": form.change,
        "drift": form.drift,
        "readout": form.readout,
        "constant": form.constant,
        "state_neurons": form.state_neurons,
        "output_neurons": form.output_neurons,
        "rectified": form.rectified,
        "bound": form.bound if np.isfinite(form.bound) else None,
        "scaled": _scaled(stage, [True] * form.n_inputs),
    }


def _scaled(stage: Stage, used: list[bool]) -> list[dict[str, Any]]:
    """The inputs that a stage reads."""
    form, ends = stage.form, stage.form.ends
    return [
        {
            "number": i,
            "source": stage.sources[i],
            "name": ends.inputs[i],
            "unit": ends.input_units[i],
            "offset": form.offset[i],
            "scale": form.scale[i],
        }
        for i in range(form.n_inputs)
        if used[i]
    ]


def _rest_lines(surrogate: Surrogate) -> list[Dict[str, Any]]:
    """Every delay line with the place of its channel in ``[inputs | outputs]``."""
    names = [port.name for port in surrogate.channels]
    return [{**line.to_dict(), "source": names.index(line.channel)} for line in surrogate.lines if line.length]


def _rest_spaces(surrogate: Surrogate) -> list[dict[str, Any]]:
    """Every state space with what its scaled inputs hold at rest."""
    found = []
    for stage in surrogate.stages:
        if isinstance(stage.state, HiddenState) and stage.state.size:
            form, places = stage.state_space, (*stage.sources, *stage.targets)
            channels = [
                {"source": source, "offset": offset, "scale": scale}
                for source, offset, scale, _ in zip(places, form.offset, form.scale, form.rest_channels, strict=False)
            ]
            bound = form.bound if np.isfinite(form.bound) else None
            rest = {"first": stage.first, "gain": form.gain, "rest": form.rest, "channels": channels, "bound": bound}
            found.append(rest | {"size": stage.state.size})
    return found
