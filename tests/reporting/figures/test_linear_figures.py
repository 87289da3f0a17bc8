"""Pictures of transfer functions show the model, and how sure it is."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import signal

import sysid
from sysid.estimation import FitResult, TransferFunctionTraining, fit_transfer_function
from sysid.models import Mapping, TransferFunction
from sysid.reporting.figures.linear_figures import bode_figure, pole_zero_figure, step_figure
from sysid.reporting.figures.svg import svg
from sysid.reporting.frequency import FrequencyUnit
from sysid.reporting.linear.computing import bode_of, step_of
from sysid.reporting.linear.step_responses import band, filter_step
from sysid.reporting.linear_views import linear_views
from sysid.reporting.sections.modes_table import modes_table
from tests.estimation.linear_systems import steps, trace_of


def fitted(noise: float, domain: str) -> FitResult:
    rng = np.random.default_rng(0)
    u = steps(600, 1, rng)
    y = signal.lfilter([0.0, 1.0, 0.5], [1.0, -1.5, 0.7], u[:, 0]) + noise * rng.normal(size=600)
    orders = TransferFunction(poles=(2,), zeros=(1,), delays=(1,) if domain == "discrete" else (0,), domain=domain)
    quick = TransferFunctionTraining(scattered_starts=0)
    return fit_transfer_function([trace_of(u, y)], Mapping.parse("u1 -> y"), orders, quick, rest_output=0.0)


@pytest.mark.parametrize("domain", ["discrete", "continuous"])
def test_bode_shows_the_response_within_its_band(domain: str) -> None:
    fit = fitted(0.3, domain)
    above, below = bode_figure(bode_of([(fit.model, fit.uncertainty)]), FrequencyUnit.RADIANS).axes
    frequency, gain = above.lines[0].get_data()
    np.testing.assert_allclose(gain, np.abs(fit.model.response(0, np.asarray(frequency))))
    outline = above.collections[0].get_paths()[0].vertices
    assert outline[:, 1].min() <= gain.min()
    assert outline[:, 1].max() >= gain.max()
    assert "degrees" in below.get_ylabel()


def test_a_band_leaves_out_a_fortieth_at_either_end_of_what_comes_next() -> None:
    draws = np.arange(1, 200)[:, np.newaxis] / 200.0  # where 199 draws of a uniform number lie on average
    np.testing.assert_allclose(band(draws)[:, 0], [0.025, 0.975], rtol=1e-12)


def test_noise_widens_the_cloud_of_poles() -> None:
    spreads = []
    for noise in (0.01, 1.0):
        fit = fitted(noise, "discrete")
        axes = pole_zero_figure(linear_views(fit.model, fit.uncertainty)).axes[0]
        cloud = axes.lines[0].get_xydata()
        spreads.append(np.std(np.abs(cloud[:, 0] + 1j * cloud[:, 1])))
        np.testing.assert_allclose(np.sort(axes.lines[1].get_xdata()), np.sort(fit.model.poles(0).real))
    assert spreads[1] > 20.0 * spreads[0]


def test_the_step_response_ends_at_the_gain() -> None:
    fit = fitted(0.1, "discrete")
    figure = step_figure(step_of([(fit.model, None)], samples=400))
    y = figure.axes[0].lines[0].get_ydata()
    assert y[-1] == pytest.approx(fit.model.response(0, np.array([0.0]))[0].real, rel=1e-6)
    assert svg(figure, title="Step", description="Step response", name="step").startswith("<svg")


def test_it_is_that_of_another_library() -> None:
    fit = fitted(0.1, "discrete")
    (A, B, C, D), n = fit.model.matrices, 60
    _, (exact,) = signal.dstep((A, B[:, :1], C, D[:, :1], fit.model.sample_time), n=n)
    drawn = step_figure(step_of([(fit.model, None)], samples=n)).axes[0].lines[0].get_ydata()
    np.testing.assert_allclose(drawn, exact[:, 0], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("n_b", "n_f", "n"), [(1, 1, 5), (4, 2, 50), (2, 5, 3), (3, 3, 0)])
def test_all_draws_at_once_are_filtered_as_each_alone(n_b: int, n_f: int, n: int) -> None:
    rng = np.random.default_rng(n_b)
    b, f = rng.standard_normal((7, n_b)), 0.2 * rng.standard_normal((7, n_f))
    f[:, 0] = 2.0
    found = np.zeros((7, n))
    filter_step(b, f, found)
    alone = [signal.lfilter(*one, np.ones(n)) for one in zip(b, f, strict=True)]
    np.testing.assert_allclose(found, np.reshape(alone, (7, n)), rtol=1e-12, atol=1e-12)


def test_a_zero_far_off_is_counted_and_does_not_shrink_the_circle() -> None:
    fit = fitted(0.01, "discrete")
    far = dataclasses.replace(fit.model, taps=tuple(np.array([0.01, 1.0]) for _ in fit.model.taps))
    assert np.abs(far.zeros(0)).max() > 1.5
    axes = pole_zero_figure(linear_views(far, None)).axes[0]
    assert axes.get_xlim() == (-1.5, 1.5)
    assert "zeros (1 outside)" in [text.get_text() for text in axes.get_legend().get_texts()]


def test_the_band_of_a_step_response_holds_its_line() -> None:
    """The line goes in steps: a band that goes straight from sample to sample lay beside it."""
    fit = fitted(0.01, "discrete")
    axes = step_figure(step_of([(fit.model, fit.uncertainty)])).axes[0]
    (band,) = axes.collections
    x, y = axes.lines[0].get_data()
    path = band.get_paths()[0]
    late = [(x[k] + 0.9 * (x[k + 1] - x[k]), y[k]) for k in range(1, 6)]
    assert path.contains_points(late, radius=1e-9).all()


def test_poles_have_named_axes_and_narrow_panels_one_legend() -> None:
    rng = np.random.default_rng(0)
    u = steps(400, 3, rng)
    y = signal.lfilter([0.0, 0.3], [1.0, -0.7], u.sum(axis=1)) + 0.01 * rng.normal(size=400)
    fit = sysid.fit(sysid.data((u, y), sample_time=1.0), "u1+u2+u3 -> y", sysid.ARX(na=1, nb=1, nk=1))
    figure = pole_zero_figure(linear_views(fit.model, fit.uncertainty))
    assert {axes.get_xlabel() for axes in figure.axes} == {"real part"}
    assert figure.axes[0].get_ylabel() == "imaginary part"
    assert [axes.get_legend() is not None for axes in figure.axes] == [True, *[False] * (len(figure.axes) - 1)]
    assert figure.get_figheight() < figure.get_figwidth() / len(figure.axes) + 1.0


def test_an_output_without_any_response_has_a_bode_diagram_and_no_warning() -> None:
    """Its coefficients are 0 with a deviation: the draws' phases were told by a quotient of 0."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, 50), 8)
    y = np.convolve(u, 0.1 * 0.9 ** np.arange(400))[:400] + 0.01 * rng.standard_normal(400)
    traces = sysid.data((u, np.column_stack([y, np.full(400, 3.0)])), sample_time=1.0)
    fit = sysid.fit(traces, "u -> y1+y2", sysid.LinearStateSpace(states=1))
    found = fit.bode()
    assert np.all(found.values[:, 1] == 0.0)
    assert "y2 from u: no effect in the model" in str(found)
    assert np.all(found.phase_low[:, 0] <= found.phase[:, 0]) and np.all(found.phase[:, 0] <= found.phase_high[:, 0])


def slow(pole: float) -> FitResult:
    """Sampled so fast that it stands beside the circle."""
    rng = np.random.default_rng(0)
    u = steps(3000, 1, rng)
    y = signal.lfilter([0.0, 1.0 - pole], [1.0, -pole], u[:, 0]) + 1e-4 * rng.normal(size=3000)
    return sysid.fit(sysid.data((u, y), sample_time=0.01), "u -> y", sysid.ARX(na=1, nb=1, nk=1))


def test_a_response_is_shown_until_it_has_settled_however_fast_it_is_sampled() -> None:
    found = step_of([(slow(0.999).model, None)])
    assert len(found.time) > 4000
    assert found.values[-1, 0] == pytest.approx(found.gain[0], rel=0.02)


def test_a_pole_beside_the_circle_has_digits_enough_to_tell() -> None:
    fit = slow(0.999)
    table = modes_table("slow", fit)
    assert table is not None
    (text,) = [row[0].text for row in table.rows]
    assert abs(1.0 - float(text)) == pytest.approx(1e-3, rel=0.2)


@pytest.mark.parametrize(("outputs", "rows", "columns"), [(1, 1, 2), (2, 2, 2), (3, 2, 3)])
def test_pairs_of_several_outputs_have_room_for_their_names(outputs: int, rows: int, columns: int) -> None:
    """Four of them stood in one row: legends were cut off, and lay over curves and axes."""
    rng = np.random.default_rng(0)
    u = rng.standard_normal((400, 2))
    y = np.column_stack([np.convolve(u @ [1.0, 0.5 + k], 0.5 * 0.8 ** np.arange(30))[:400] for k in range(outputs)])
    names = ["temperature", "pressure", "level"][:outputs]
    data = sysid.data((u, y), outputs=names, sample_time=1.0)
    model = sysid.fit(data, f"u1+u2 -> {'+'.join(names)}", sysid.LinearStateSpace(states=2, noise=False)).model
    bode, step, views = bode_of([(model, None)]), step_of([(model, None)], samples=20), linear_views(model, None)
    for figure, panels in ((bode_figure(bode), 2), (step_figure(step), 1), (pole_zero_figure(views), 1)):
        seen = [one for one in figure.axes if one.get_visible()]
        assert len(seen) == panels * len(bode.names)
        assert figure.get_size_inches()[0] == pytest.approx(7.6)
        assert seen[0].get_gridspec().get_geometry() == (panels * rows, columns)
        titles = [text for one in seen if (text := one.get_title(loc="left"))]
        assert all(title.startswith(name) for title, name in zip(titles, bode.names, strict=True))
