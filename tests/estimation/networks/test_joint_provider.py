"""Sensitivities through a cascade against finite differences, whatever its wiring."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.errors import ChannelError, ConfigError
from sysid.estimation.least_squares.counted_rows import counted_rows
from sysid.estimation.networks.program_provider import LEAST
from sysid.estimation.networks.together.provider import CascadeProvider
from sysid.estimation.networks.together.training import unit_errors
from sysid.models import Cascade, Limit
from sysid.testing import finite_difference_jacobian
from sysid.traces import Channel, Trace
from tests.models.cascades.cascades import CASCADES, command, equation, lag, linear, network, service


def trace(cascade: Cascade, n: int = 60, seed: int = 0, *, usable=None) -> Trace:
    """A record with the cascade's inputs, and noise for its outputs."""
    names = cascade.wiring.channels
    noise = np.random.default_rng(seed).uniform(0.0, 90.0, (n, len(cascade.outputs)))
    return Trace(
        name=f"record {seed}",
        sample_time=0.1,
        channels=tuple(Channel(name=name, unit="psi") for name in names),
        values=np.column_stack([command(n, len(cascade.inputs), seed), noise]),
        usable=usable,
    )


def provider(cascade: Cascade, n: int = 60, **fields) -> CascadeProvider:
    errors = {name: 0.5 + i for i, name in enumerate(cascade.outputs)}
    return CascadeProvider(**{"cascade": cascade, "traces": (trace(cascade, n), trace(cascade, n // 2, 1)), "errors": errors} | fields)  # fmt: skip  # noqa: E501


def check(one: CascadeProvider, atol: float = 2e-6) -> None:
    theta = one.theta
    assert_allclose(one.jacobian(theta), finite_difference_jacobian(one.residuals, theta), rtol=1e-5, atol=atol)


@pytest.mark.parametrize("cascade", CASCADES.values(), ids=CASCADES)
def test_sensitivities_equal_finite_differences(cascade):
    check(provider(cascade))


@pytest.mark.parametrize("window", [7, 30])
def test_sensitivities_over_windows_equal_finite_differences(window: int) -> None:
    check(provider(service(), window=window))


def test_windows_begin_with_what_is_measured() -> None:
    """What a whole put out itself is exact over every window; one as long as the trace is the trace."""
    truth = service()
    record = truth.simulate(command(90, len(truth.inputs), 0)).trace("its own")
    for window in (1, 7, 40):
        one = provider(truth, traces=(record,), window=window)
        assert one.n_samples == provider(truth, traces=(record,)).n_samples
        assert one.loss(one.theta) == pytest.approx(0.0, abs=1e-18)
        off = 1.02 * one.theta
        assert 0.0 < one.loss(off) < provider(truth, traces=(record,)).loss(off)
    long = provider(truth, window=60)
    assert_array_equal(long.residuals(long.theta), provider(truth).residuals(long.theta))


def test_no_window_begins_with_what_stands_under_a_mask() -> None:
    truth = service()
    record = truth.simulate(command(90, len(truth.inputs), 0)).trace("its own")
    usable = np.ones(90, dtype=np.bool_)
    usable[20:45] = False
    broken = record.values.copy()
    broken[np.ix_(~usable, [name in truth.outputs for name in record.channel_names])] = 1e3
    one = provider(truth, traces=(replace(record, values=broken, usable=usable),), window=30)
    assert one.loss(one.theta) == pytest.approx(0.0, abs=1e-18)


@pytest.mark.parametrize("trained", [("BP",), ("AR",), ("BC",), ("BP", "BC")], ids="+".join)
def test_some_members_alone_are_trained(trained):
    one = provider(service(), trained=trained)
    assert len(one.theta) == sum(service().member(name).n_parameters for name in trained)
    check(one)


def test_equations_are_trained_by_their_parameters_with_the_others():
    whole = CASCADES["equations in a circle"]
    assert {member.mapping.output for member in provider(whole).members} == {"BP", "AR", "x", "y", "BC"}
    alone = provider(whole, trained=("x",))
    assert_array_equal(alone.theta, [0.9, 1.0])
    assert alone.at([0.8, 1.1]).member("x").parameters == {"share": 0.8, "root": 1.1}
    check(alone)
    with pytest.raises(ConfigError, match="cannot be trained with the others"):
        provider(whole, trained=("ER",))


def test_the_sensitivities_of_parameters_equal_a_complex_step():
    """A tank that an equation fills and a linear member empties, written once more in complex numbers."""
    flow = equation("x = k*max(STP - p*BP[k-1], 0)^1.5/(1 + p)", "STP", "BP", free={"k": 0.4, "p": 0.7})
    tank, n = linear("x -> BP"), 200
    whole = Cascade(models=(flow, tank), limits={"x": Limit(high=80.0)})
    one = provider(whole, n=n, trained=("x",), errors={"BP": 1.0, "x": 1.0})
    (b0, b1, a1, a2), u = tank.coefficients, one.traces[0]["STP"]

    def run(k: complex, p: complex) -> np.ndarray:
        x, y = [0.0 + 0j], [90.0 + 0j] * 2
        for t in range(n):
            head = u[t] - p * y[-1]
            filled = k * head**1.5 / (1 + p) if head.real > 0.0 else 0j
            x.append(filled if filled.real < 80.0 else 80.0 + 0j)
            y.append(b0 * x[-1] + b1 * x[-2] + a1 * y[-1] + a2 * y[-2])
        return np.concatenate([y[2:], x[1:]])

    expected = np.column_stack([run(0.4 + 1e-30j, 0.7), run(0.4, 0.7 + 1e-30j)]).imag / 1e-30
    assert_allclose(one.jacobian(one.theta)[: 2 * n], expected, rtol=1e-9, atol=1e-9)


def test_a_whole_of_equations_alone_has_nothing_to_train():
    whole = CASCADES["equations in a circle"].upstream_of(["ER"], given=("STP", "y", "BP", "x"))
    with pytest.raises(ConfigError, match="nothing is left to train"):
        provider(whole)


def test_a_target_upstream_of_what_is_trained_does_not_move():
    one = provider(service(), trained=("AR",), errors={"BP": 1.0, "BC": 2.0})
    J = one.jacobian(one.theta)
    assert not J[:60].any()
    assert J[60:120].any()
    check(one)


def test_an_output_held_by_a_channel_moves_with_it():
    cascade = replace(service(), limits={"AR": Limit(high="BP"), "BC": Limit(low="AR")})
    held = cascade.simulate_trace(trace(cascade)).activity
    assert held["AR"].high > 0
    assert held["BC"].low > 0
    check(provider(cascade))


@pytest.fixture
def short_blocks(monkeypatch):
    """Blocks are as short as those of large wholes."""
    monkeypatch.setattr("sysid.estimation.networks.program_provider.BLOCK", LEAST)


@pytest.mark.usefixtures("short_blocks")
def test_blocks_join_without_a_seam():
    one = provider(service(), n=2 * LEAST + 57)
    theta, direction = one.theta, np.random.default_rng(4).standard_normal(len(one.theta))
    width = 1e-6
    expected = (one.residuals(theta + width * direction) - one.residuals(theta - width * direction)) / (2 * width)
    assert_allclose(one.jacobian(theta) @ direction, expected, rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize(("stride", "moves"), [(1, np.inf), (3, np.inf), (7, np.inf), (7, 150.0)])
@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.usefixtures("short_blocks")
@pytest.mark.parametrize("each", [False, True], ids=["samples", "each channel"])
def test_normal_equations_equal_the_dense_ones(stride, moves, workers, each):
    cascade = service()
    usable = np.random.default_rng(5).random((LEAST + 90, len(cascade.wiring.channels) if each else 1)) > 0.2
    usable = usable if each else usable[:, 0]
    traces = (trace(cascade, LEAST + 90, usable=usable), trace(cascade, 50, 1))
    errors = {"BC": 2.0, "BP": 0.5}
    one = provider(cascade, traces=traces, errors=errors, stride=stride, moves=moves, workers=workers)
    counts, scale = [t.counted(cascade.inputs, errors) for t in traces], list(errors.values())
    over = [np.where(own, t.columns(list(errors)) / scale, np.nan) for t, own in zip(traces, counts, strict=True)]
    rows = [counted_rows(one, stride, moves) for one in over]
    weights = np.concatenate([one[own].T.ravel() for one, own in zip(counts, rows, strict=True)])
    weights = weights.astype(float)
    at, J, e = one.linearise(one.theta), one.jacobian(one.theta), one.residuals(one.theta)
    assert one.n_samples == weights.sum()
    assert_allclose(at.loss, 0.5 * np.sum(weights * e**2), rtol=1e-12)
    assert_allclose(at.loss, one.loss(one.theta), rtol=1e-12)
    assert_allclose(at.gradient, J.T @ (weights * e), rtol=1e-9, atol=1e-9)
    assert_allclose(at.gauss_newton, J.T @ (weights[:, None] * J), rtol=1e-9, atol=1e-9)


def test_beyond_the_robust_scale_a_trace_counts_by_the_logarithm_of_its_error():
    """The gradient against finite differences of the loss; the matrix is that of the squares, weighted by trace."""
    one = provider(service(), robust_scale=20.0, stride=2)
    theta, at = one.theta, one.linearise(one.theta)
    assert_allclose(at.loss, one.loss(theta))
    slopes = finite_difference_jacobian(lambda there: np.array([one.loss(there)]), theta)[0]
    assert_allclose(at.gradient, slopes, rtol=1e-4, atol=1e-6 * np.abs(slopes).max())
    J, weights, H = one.jacobian(theta), [], at.gauss_newton
    for residual in np.split(one.residuals(theta), np.cumsum([30, 30, 30, 15, 15])):
        weights += [1.0 / (1.0 + np.mean(residual**2) / 20.0**2)] * len(residual)
    assert min(weights) < 0.9
    assert_allclose(H, J.T @ (np.array(weights)[:, None] * J), rtol=1e-9, atol=1e-9 * H.max())


def test_long_rows_count_less_in_the_matrix_and_not_in_the_loss():
    plain = provider(service(), stride=2)
    one = provider(service(), stride=2, leverage=1.5)
    theta, J = one.theta, one.jacobian(one.theta)
    lengths = np.linalg.norm(J, axis=1)
    weights = np.minimum(1.0, 1.5 * np.median(lengths[lengths > 0.0]) / np.maximum(lengths, 1e-300)) ** 2
    assert 0.1 < np.mean(weights < 1.0) < 0.9
    at = one.linearise(theta)
    assert_allclose(at.gradient, J.T @ (weights * one.residuals(theta)), rtol=1e-9, atol=1e-9)
    assert_allclose(at.gauss_newton, J.T @ (weights[:, None] * J), rtol=1e-9, atol=1e-9)
    assert at.loss == plain.linearise(theta).loss == pytest.approx(one.loss(theta))


def test_a_gap_does_not_make_a_trace_count_as_better_than_it_is():
    usable = np.arange(60) >= 40
    one = provider(service(), traces=(trace(service(), usable=usable),), robust_scale=20.0)
    S = np.mean(one.residuals(one.theta).reshape(3, 60)[:, usable] ** 2, axis=1)
    assert_allclose(one.loss(one.theta), 0.5 * np.sum(20 * 20.0**2 * np.log1p(S / 20.0**2)))


def test_what_stands_under_the_mask_of_one_output_changes_nothing():
    """Neither loss nor step, nor which samples count; the other outputs count where it is masked."""
    cascade, filled = service(), []
    names, hidden = cascade.wiring.channels, np.arange(60) % 7 == 3
    usable = np.ones((60, len(names)), dtype=bool)
    usable[hidden, names.index("BC")] = False
    for fill in (0.0, 80.0):
        values = trace(cascade).values.copy()
        values[hidden, names.index("BC")] = fill
        record = replace(trace(cascade), values=values, usable=usable)
        one = provider(cascade, traces=(record,), stride=3, moves=4.0, robust_scale=20.0)
        filled.append((one.n_samples, one.linearise(one.theta), unit_errors(cascade, [record], None)))
    (n, at, errors), (n2, at2, errors2) = filled
    assert (n, at.loss, errors) == (n2, at2.loss, errors2)
    assert_array_equal(at.gauss_newton, at2.gauss_newton)
    assert_array_equal(at.gradient, at2.gradient)
    assert provider(cascade, traces=(record,)).n_samples == 3 * 60 - hidden.sum()


def test_parameters_go_in_and_come_out():
    cascade = CASCADES["a linear member"]
    one = provider(cascade)
    inputs = command()
    assert_array_equal(one.at(one.theta).simulate(inputs).values, cascade.simulate(inputs).values)
    moved = one.theta + 0.01
    assert_array_equal(provider(one.at(moved)).theta, moved)


def test_a_model_with_a_state_of_its_own_may_come_before_what_is_trained():
    cascade = Cascade(models=(lag("STP -> BP"), network("BP -> AR", seed=2), linear("BP+AR -> BC")))
    one = provider(cascade, trained=("AR", "BC"))
    check(one)
    with pytest.raises(ConfigError, match="cannot be trained with the others"):
        provider(cascade)


@pytest.mark.parametrize("fields", [{"errors": {"XX": 1.0}}, {"errors": {}}, {"trained": ("XX",)}], ids=str)
def test_names_that_are_no_outputs_are_refused(fields):
    with pytest.raises(ChannelError, match="missing channel"):
        provider(service(), **fields)


def test_a_loss_that_is_not_a_number_is_infinite():
    one = provider(service())
    assert one.loss(np.full(len(one.theta), np.nan)) == np.inf


def test_a_start_that_runs_away_overflows_without_a_warning():
    one = provider(Cascade(models=(linear("STP -> BP"),)), n=1200)
    with np.errstate(all="raise"):  # what one has asked for elsewhere does not matter either
        found = one.linearise(2.0 * one.theta)
    assert not np.isfinite(found.gauss_newton).any()


@pytest.mark.parametrize("window", [None, 20])
def test_mean_squares_and_variances_are_of_what_counts(window) -> None:
    truth, usable = service(), np.arange(60) >= 25
    record = trace(truth, usable=usable)
    errors = {"BP": 0.5, "BC": 2.0}
    one = provider(truth, traces=(record, trace(truth, seed=1)), errors=errors, window=window)
    theta = one.theta + 0.05
    away = {name: [] for name in errors}
    for part, seen in ((record, usable), (trace(truth, seed=1), np.ones(60, dtype=bool))):
        if window is None:
            run = one.at(theta).simulate_trace(part)
            for name, error in errors.items():
                away[name].append((run[name] - part[name])[seen] / error)
    if window is None:
        assert_allclose(one.mean_squares(theta), [np.mean(np.concatenate(some) ** 2) for some in away.values()])
    assert_allclose(
        one.variances,
        [
            np.var(np.concatenate([record[name][usable], trace(truth, seed=1)[name]])) / e**2
            for name, e in errors.items()
        ],
    )
    assert_allclose(one.mean_squares(theta).sum() * one.n_samples, 2 * 2.0 * one.loss(theta), rtol=1e-12)
