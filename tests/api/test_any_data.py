"""Any small data set through the short way: it is refused in words, or fitted with figures that its free run bears out.

What is drawn is what real records are like at their worst: inputs that never move, that repeat each other, outputs that
stand still, scales far from one, integers, a handful of samples, masked ones, several experiments of different lengths.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import sysid
from sysid.errors import UserError
from sysid.estimation import Status
from sysid.estimation.estimator import Options
from sysid.models import AbstractStructure
from sysid.traces import Role

Array = NDArray[np.float64]
Rng = np.random.Generator

INPUTS: dict[str, Callable[[Rng, int], Array]] = {
    "noise": lambda rng, n: rng.standard_normal(n),
    "steps": lambda rng, n: np.repeat(rng.standard_normal(n // 7 + 1), 7)[:n],
    "constant": lambda rng, n: np.full(n, rng.standard_normal()),
    "zero": lambda _, n: np.zeros(n),
    "one pulse": lambda _, n: (np.arange(n) == n // 3).astype(float),
    "ramp": lambda _, n: np.arange(n) / 10.0,
    "integers": lambda rng, n: rng.integers(-3, 4, n).astype(float),
    "far from zero": lambda rng, n: 1e5 + rng.standard_normal(n),
}

OUTPUTS: dict[str, Callable[[Rng, Array], Array]] = {
    "first order": lambda _, u: _run(u, 0.8),
    "first order in noise": lambda rng, u: _run(u, 0.8) + 0.1 * rng.standard_normal(len(u)),
    "oscillating": lambda _, u: _run(u, -0.9),
    "integrator": lambda _, u: _run(u, 1.0),
    "growing": lambda _, u: _run(u, 1.05),
    "static": lambda _, u: 2.0 * u.sum(axis=1),
    "squared": lambda _, u: _run(u, 0.7) ** 2,
    "noise": lambda rng, u: rng.standard_normal(len(u)),
    "constant": lambda rng, u: np.full(len(u), rng.standard_normal()),
    "zero": lambda _, u: np.zeros(len(u)),
    "counted": lambda _, u: np.round(_run(u, 0.8)),
}


def _run(u: Array, pole: float) -> Array:
    y = np.zeros(len(u))
    for k in range(1, len(u)):
        y[k] = pole * y[k - 1] + u[k - 1].sum()
    return y


@dataclass(frozen=True, kw_only=True)
class Case:
    """A data set, what is fitted to it, and how."""

    values: Any
    split: float | None
    repairs: dict[str, str] | None
    n_inputs: int
    structure: AbstractStructure
    training: Options | None
    start: sysid.Start

    @property
    def mapping(self) -> str:
        names = ["u"] if self.n_inputs == 1 else [f"u{j + 1}" for j in range(self.n_inputs)]
        return f"{'+'.join(names)} -> y"


@st.composite
def cases(draw: st.DrawFn) -> Case:
    n_inputs = draw(st.integers(1, 4))
    kinds = draw(st.lists(st.sampled_from([*INPUTS, "copy", "sum"]), min_size=n_inputs, max_size=n_inputs))
    output = draw(st.sampled_from(list(OUTPUTS)))
    lengths = draw(st.lists(_lengths(), min_size=1, max_size=3))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    scales = 10.0 ** np.array(draw(st.tuples(*[st.sampled_from([0, 0, 0, -12, -6, 3, 8, 12])] * 2)))
    masked = draw(st.sampled_from([0.0, 0.0, 0.02, 0.3]))
    values = [_record(rng, length, kinds=kinds, output=output, scales=scales, masked=masked) for length in lengths]
    structure, training = draw(_fits(n_inputs))
    return Case(
        values=values if len(values) > 1 else values[0],
        split=draw(st.sampled_from([None, 0.5, 0.7])),
        repairs={"nan": "mask"} if masked else None,
        n_inputs=n_inputs,
        structure=structure,
        training=training,
        start=draw(_starts()),
    )


def _lengths() -> st.SearchStrategy[int]:
    return st.one_of(st.integers(1, 30), st.integers(10, 60), st.integers(30, 150), st.integers(60, 500))


def _record(rng: Rng, length: int, *, kinds: list[str], output: str, scales: Array, masked: float) -> Any:
    columns: list[Array] = []
    for kind in kinds:
        if columns and kind in {"copy", "sum"}:
            columns.append(columns[0] if kind == "copy" else np.sum(columns, axis=0) * 2.0)
        else:
            columns.append(INPUTS.get(kind, INPUTS["noise"])(rng, length))
    u = np.column_stack(columns)
    y = OUTPUTS[output](rng, u) * scales[1]
    gaps = rng.random(length) < masked
    u, y = u * scales[0], np.where(gaps, np.nan, y)
    if length >= len(kinds):
        return u, y
    names = ["u"] if len(kinds) == 1 else [f"u{j + 1}" for j in range(len(kinds))]
    return {**dict(zip(names, u.T, strict=True)), "y": y}


KINDS = ["ARX", "VectorARX", "TF", "NARX", "NSS", "SS", "VectorSS", "VectorNSS", "OE", "BJ", "ARMAX"]


def _starts() -> st.SearchStrategy[sysid.Start]:
    return st.one_of(
        st.just(sysid.Start(kind="estimated")),
        st.builds(lambda n: sysid.Start(kind="estimated", n_measured=n), st.integers(1, 20)),
        st.just(sysid.Start(kind="rest")),
        st.just(sysid.Start(kind="first-sample")),
        st.builds(lambda n: sysid.Start(kind="measured", n_measured=n), st.integers(1, 20)),
    )


@st.composite
def _fits(draw: st.DrawFn, n_inputs: int) -> tuple[AbstractStructure, Options | None]:
    kind = draw(st.sampled_from(KINDS))
    each = st.tuples
    if kind in {"SS", "VectorSS"}:
        structure = sysid.LinearStateSpace if kind == "SS" else sysid.VectorStateSpace
        asked = {name: draw(st.booleans()) for name in ("feedthrough", "noise", "intercept")}
        method = draw(st.sampled_from(["prediction-error", "subspace"]))
        return structure(states=draw(st.integers(1, 4)), **asked), sysid.StateSpaceTraining(
            method=method, max_iterations=draw(st.integers(0, 15)), stable=draw(st.sampled_from([None, True, False]))
        )
    if kind in {"OE", "BJ", "ARMAX"}:
        nb, nf, nk = (draw(each(*[st.integers(low, 2)] * n_inputs)) for low in (1, 0, 0))
        na, nc, nd = (draw(st.integers(low, 2)) for low in (0, 0, 0))
        given: dict[str, AbstractStructure] = {
            "OE": sysid.OE(nb=nb, nf=nf, nk=nk),
            "BJ": sysid.BJ(nb=nb, nc=nc, nd=nd, nf=nf, nk=nk),
            "ARMAX": sysid.ARMAX(na=na, nb=nb, nc=nc, nk=nk, integrated=draw(st.booleans())),
        }
        return given[kind], sysid.PolynomialTraining(max_iterations=draw(st.integers(0, 15)))
    if kind in {"ARX", "VectorARX"}:
        nb, nk = (draw(each(*[st.integers(low, 3)] * n_inputs)) for low in (1, 0))
        arx = sysid.ARX if kind == "ARX" else sysid.VectorARX
        return arx(na=draw(st.integers(0, 3)), nb=nb, nk=nk, intercept=draw(st.booleans())), None
    if kind == "TF":
        poles = draw(each(*[st.integers(1, 2)] * n_inputs))
        zeros = tuple(draw(st.integers(0, p)) for p in poles)
        known = each(*[st.integers(0, 3)] * n_inputs)
        # Searched dead times of many inputs are tried in combination: seconds where the others take milliseconds.
        delays = draw(st.one_of(st.none(), known) if n_inputs <= 2 else known)
        domain = draw(st.sampled_from(["discrete", "continuous"]))
        transfer = sysid.TransferFunction(poles=poles, zeros=zeros, delays=delays, domain=domain)
        return transfer, sysid.TransferFunctionTraining(
            max_iterations=draw(st.integers(5, 15)),
            short_iterations=3,
            max_delay=None if delays is not None else 3 if n_inputs > 1 else 20,
        )
    training = sysid.Training(
        max_iterations=draw(st.integers(5, 15)), workers=1, starts=draw(st.sampled_from([1, 1, 2]))
    )
    if kind in {"NSS", "VectorNSS"}:
        network = sysid.NeuralStateSpace if kind == "NSS" else sysid.VectorNeuralStateSpace
        return network(states=draw(st.integers(1, 2)), neurons=draw(st.integers(0, 2))), training
    loop = draw(st.sampled_from(["open", "closed"]))
    lags, own = draw(st.sampled_from(["0:1", "1:2", "1"])), draw(st.integers(1, 2))
    return sysid.NARX(input_delays=lags, output_delays=own, neurons=draw(st.integers(1, 3))), replace(
        training, loop=loop
    )


def holds(case: Case) -> str:
    """Hold a case to its promise; returns how it ended."""
    try:
        traces = sysid.data(case.values, sample_time=0.1, split=case.split, repairs=case.repairs)
        fit = sysid.fit(
            traces,
            case.mapping,
            case.structure,
            case.training,
            start=case.start,
            stability=sysid.StabilityOptions(count=10),
        )
        compared = sysid.compare(traces, fit, start=case.start)
    except UserError as error:
        assert error.what
        assert error.remedy, error.what
        return error.what
    assert isinstance(fit, sysid.Fit)
    assert repr(fit)
    for printed in (fit.summary(), str(compared)):
        assert not {"nan", "inf", "-inf"} & set(printed.lower().replace(",", " ").split()), printed
    if not fit.status.usable:
        return fit.status.name
    reach = max(np.abs(t["y"]).max() for t in traces.with_role(Role.ESTIMATION)) + 1e-9
    for found in next(iter(compared.evaluations.values())).cases.values():
        for figures in (found.free_run, found.one_step):
            assert not np.isinf([figures.mse, figures.max_abs_error]).any(), (found.case, figures)
        assert np.isfinite(found.simulated).all()
        if found.role is Role.ESTIMATION and fit.status in {Status.CONVERGED, Status.EXACT}:
            assert np.abs(found.simulated).max() <= 1e4 * reach, (found.case, fit.status)
    return fit.status.name


@settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(case=cases())
def test_a_data_set_is_refused_in_words_or_fitted_with_figures_that_its_free_run_bears_out(case: Case) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        holds(case)
