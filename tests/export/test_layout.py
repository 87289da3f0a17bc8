"""The state's layout: the same tables serve every format."""

from __future__ import annotations

import numpy as np

from sysid.export import StateLayout, Surrogate
from sysid.models import NARX, History
from tests.export.cascades import build_equations, wired_equation


def test_lines_are_as_long_as_each_channels_longest_lag(narx):
    layout = StateLayout.of(narx(NARX(input_delays=[[0], [1, 2, 4]], output_delays=[2, 5], neurons=1)))
    assert [(line.channel, line.first, line.length) for line in layout.lines] == [
        ("BP", 0, 0),
        ("AR", 0, 4),
        ("BC", 4, 5),
    ]
    assert layout.size == 9


def test_a_system_at_rest_is_its_scaled_values(narx):
    layout = StateLayout.of(narx(NARX(input_delays=2, output_delays=3, neurons=1)))
    state = layout.from_history(History.at_rest(inputs=[90.0, 50.0], output=0.0))
    np.testing.assert_allclose(state, [1.0, 1.0, -1.0, -1.0, -0.95, -0.95, -0.95])


def test_a_caller_builds_the_state_at_rest_from_the_dictionary_alone(model):
    layout, values = StateLayout.of(model), {"BP": 88.0, "AR": 70.0, "BC": 12.0}
    lines = layout.to_dict()["lines"]
    by_hand = [
        (values[line["channel"]] - line["offset"]) / line["scale"] for line in lines for _ in range(line["length"])
    ]
    history = History.at_rest(inputs=[values[name] for name in model.mapping.inputs], output=values["BC"])
    np.testing.assert_array_equal(layout.from_history(history), by_hand)


def test_newest_sample_stands_first(narx):
    layout = StateLayout.of(narx(NARX(input_delays=2, output_delays=1, neurons=1), n_inputs=1))
    state = layout.from_history(History(inputs=[[0.0], [45.0], [90.0]], output=[0.0, 38.0, 78.0]))
    np.testing.assert_allclose(state, [1.0, 0.0, 1.0])


def test_next_columns_shift_every_line_by_one_sample(model):
    layout = StateLayout.of(model)
    n_inputs, depth = len(layout.inputs), max(line.length for line in layout.lines) + 1
    rng = np.random.default_rng(0)
    u, y = rng.normal(size=(depth + 1, n_inputs)), rng.normal(size=depth + 1)
    before = layout.from_history(History(inputs=u[:-1], output=y[:-1]))
    after = layout.from_history(History(inputs=u[1:], output=y[1:]))
    new = layout.from_history(History.at_rest(inputs=u[-1], output=y[-1]))
    heads = [new[line.first] if line.length else np.nan for line in layout.lines]
    np.testing.assert_array_equal(np.concatenate([heads, before])[layout.next_columns()], after)


def test_columns_are_where_samples_stand(model):
    layout = StateLayout.of(model)
    names = [f"{name}-0" for name in model.mapping.inputs]
    names += [f"{line.channel}-{lag}" for line in layout.lines for lag in range(1, line.length + 1)]
    for channel, own in enumerate((*model.recursion.lags.inputs, model.recursion.lags.output)):
        for lag in own:
            assert names[layout.column(channel, lag)] == f"{layout.lines[channel].channel}-{lag}"


def test_equations_add_past_samples_alone_to_the_state_of_a_whole():
    surrogate = Surrogate.of(build_equations(), {})
    assert surrogate.state_size == sum(line.length for line in surrogate.lines)
    assert "equations" not in surrogate.state_text()
    alone = Surrogate.of(wired_equation("TOP = max(BP, STP[k-2])", "BP", "STP"), {})
    assert (alone.state_size, alone.state_text()["equations"][0]["names"]) == (3, ["none"])
