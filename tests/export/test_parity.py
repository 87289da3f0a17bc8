"""Parity: a file that does not reproduce its model is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal

import sysid
from sysid.errors import ParityError
from sysid.export import EXPORTERS, Surrogate, check_parity, parity_cases, random_cases
from sysid.export.differences import largest_difference
from sysid.export.expected_runs import ParityCase
from sysid.export.forms.stage import Port
from sysid.export.parity import SHARES, Allowed
from sysid.export.stability import UnboundedRunWarning, state_unbounded
from sysid.models import ARX, NARX, ARXModel, Mapping, Start, StartKind
from tests.export.cascades import build_limited
from tests.export.conftest import ROWS, usable


def written(row, surrogate, folder):
    return [file for file in usable(row.format).write(surrogate, folder) if file.dtype == row.dtype]


@pytest.mark.parametrize(
    ("output", "expected", "difference"),
    [
        pytest.param([1.0, 2.0], [1.0, 2.0], 0.0, id="equal"),
        pytest.param([1.0, 2.5], [1.0, 2.0], 0.5, id="one differs"),
        pytest.param([1.0, np.nan], [1.5, np.nan], 0.5, id="both not a number"),
        pytest.param([1.0, np.nan], [1.0, 2.0], np.inf, id="only the file not a number"),
        pytest.param([1.0, 2.0], [1.0, np.nan], np.inf, id="only the model not a number"),
        pytest.param([np.inf], [np.inf], 0.0, id="the same infinity"),
        pytest.param([np.inf], [-np.inf], np.inf, id="opposite infinities"),
        pytest.param([], [], 0.0, id="no samples"),
    ],
)
def test_largest_difference(output, expected, difference):
    assert largest_difference(np.array(output), np.array(expected)) == difference


def passes(row, model, surrogate, traces, begin, folder):  # noqa: PLR0917 - called twice, just below
    cases, sequences = parity_cases(surrogate, traces, begin), random_cases(surrogate, sequences=3, samples=50)
    for file in written(row, surrogate, folder):
        allowed = Allowed.of(cases, file.dtype)
        parity = check_parity(file, folder, cases, sequences, allowed=allowed, outputs=surrogate.outputs)
        largest = max(np.abs(case.output).max() for case in cases)
        assert parity.tolerance == pytest.approx(SHARES[row.dtype] * largest, rel=1e-12)
        assert max(parity.largest_difference, parity.random_difference) <= parity.tolerance
        assert parity.case in traces.names
        assert (parity.output, parity.unit, parity.random_sequences) == (surrogate.outputs[0].name, "psi", 3)
        assert parity.share == SHARES[row.dtype]
        assert parity.samples == sum(len(trace) for trace in traces) - 3 * begin.n_measured + 3 * 50


SOME = pytest.mark.parametrize(
    "row", [ROWS[name] for name in ("ONNX, step", "ONNX float32, sequence", "C", "C, float", "FMI 3.0")]
)
"""Of each number type, and through a runner of each sort; what each file computes is the contract's matter."""


@SOME
def test_files_of_the_model_pass(row, fit, declared, traces, tmp_path):
    passes(row, fit.model, declared(fit.model), traces, Start(), tmp_path)


@pytest.mark.parametrize(
    "begin",
    [Start(kind=StartKind.FIRST_SAMPLE), Start(kind=StartKind.MEASURED, n_measured=2)],
    ids=["first sample", "measured, shorter than the lags"],
)
def test_files_of_the_model_pass_for_every_start(*, rows, fit, declared, traces, begin, tmp_path):
    passes(rows["ONNX, step"], fit.model, declared(fit.model), traces, begin, tmp_path)


@SOME
def test_files_of_another_model_are_refused_with_the_worst_case(*, row, fit, declared, traces, narx, tmp_path):
    other = narx(NARX(input_delays=4, output_delays=4, neurons=20), seed=99)
    cases = parity_cases(declared(fit.model), traces, Start())
    expected = {case.name: np.abs(other.simulate(case.inputs) - case.output[:, 0]).max() for case in cases}
    worst = max(expected, key=expected.get)
    for file in written(row, declared(other), tmp_path):
        with pytest.raises(ParityError, match=f"(?s){file.name} does not reproduce.*case {worst}"):
            allowed = Allowed.of(cases, file.dtype)
            check_parity(file, tmp_path, cases, (), allowed=allowed, outputs=declared(other).outputs)


def test_a_difference_on_a_random_sequence_alone_is_refused(fit, declared, traces, tmp_path):
    surrogate = declared(fit.model)
    cases, sequences = (
        parity_cases(declared(fit.model), traces, Start()),
        random_cases(surrogate, sequences=2, samples=20),
    )
    sequences[1].output[7] += 1e-6
    (file, _) = EXPORTERS["onnx"].write(surrogate, tmp_path)
    with pytest.raises(ParityError, match=r"(?s)case random 2.*1e-06 psi"):
        check_parity(
            file, tmp_path, cases, sequences, allowed=Allowed.of(cases, "float64", 1e-9), outputs=surrogate.outputs
        )


def test_where_the_model_grows_without_bound_there_is_nothing_to_reproduce(declared, traces, tmp_path):
    """In float32 it does so sooner: such a file was refused as if it were wrong."""
    orders = ARX(na=1, nb=(1, 1), nk=(1, 1))
    explosive = ARXModel(
        orders=orders, coefficients=np.array([0.1, 0.1, 1e30]), intercept=0.0, mapping=Mapping.parse("BP+AR -> BC"),
        sample_time=0.1, input_units=("psi", "psi"), output_unit="psi", rest_output=0.0,
    )  # fmt: skip
    surrogate = declared(explosive)
    (file,) = written(ROWS["C, float"], surrogate, tmp_path)
    sequences = random_cases(surrogate, sequences=2, samples=50)
    first = sequences[0]
    cases = (replace(first, name="short", inputs=first.inputs[:1], output=first.output[:1]),)
    assert not any(np.isfinite(case.output).all() for case in sequences)
    allowed = Allowed.of(cases, "float32")
    assert (
        check_parity(file, tmp_path, cases, sequences, allowed=allowed, outputs=surrogate.outputs).random_sequences == 0
    )
    manifest = {"fit": {"status": "CONVERGED", "status_text": "", "notes": []}}
    with pytest.warns(UnboundedRunWarning, match="On 2 of 2 random sequences"):
        state_unbounded(manifest, sequences)
    assert manifest["fit"]["status"] == "UNSTABLE"


def run_of(*outputs: list[float]) -> ParityCase:
    values = np.array(outputs).T
    return ParityCase(name="a", inputs=values, state=values[0], output=values, amplification=1.0)


@pytest.mark.parametrize("unit", [1e6, 1.0, 1e-6], ids="{:g}".format)
def test_what_is_allowed_is_the_same_in_whatever_unit_and_for_each_output_its_own(unit):
    cases = (run_of([0.0, 300.0 * unit], [0.0, -2e-6]), run_of([310.0 * unit], [1e-6]))
    np.testing.assert_allclose(Allowed.of(cases, "float64").each, [310e-9 * unit, 2e-15])
    np.testing.assert_allclose(Allowed.of(cases, "float32").each, [310e-5 * unit, 2e-11])
    # A number that was asked for is in the outputs' unit; what is 0 throughout has no size.
    assert Allowed.of(cases, "float64", 0.25).each.tolist() == [0.25, 0.25]
    assert Allowed.of((run_of([0.0]),), "float64").each.tolist() == [1e-9]


@pytest.mark.parametrize("level", [0.0, 1e5])
def test_what_a_channel_far_from_0_does_to_another_output_is_rounding(level):
    """A pressure at 100 kPa that moves by 50 Pa is rounded so coarsely that a strain that it moves was refused."""
    moves = np.tile([-1.0, 1.0], 50)
    case = replace(run_of([*(level + 50.0 * moves)], [*(5e-10 * moves)]), amplification=80.0)
    ulp = np.finfo(np.float64).eps * level / 50.0
    expected = [1e-9 * (level + 50.0), max(5e-19, 5e-10 * 1e3 * (ulp - 10.0 * np.finfo(np.float64).eps) * 80.0)]
    np.testing.assert_allclose(Allowed.of((case,), "float64").over(case), expected)
    # Not more than what is told as lost by itself.
    lost = Allowed.of((case,), "float64").over(replace(case, amplification=1e300))
    assert lost[1] <= max(5e-19, 5e-10 * 1e3 * ulp * 1e6)


def test_of_several_outputs_each_is_held_to_its_own_and_the_nearest_is_told(tmp_path, monkeypatch):
    small, large = (
        Port(name=name, unit=unit, identifier=name, level=0.0) for name, unit in (("small", "m"), ("large", "Pa"))
    )
    case = run_of([1e-6, 2e-6], [1e6, 2e6])
    file = SimpleNamespace(name="a", format="c", dtype="float64")

    def off_by(*by: float) -> None:
        def run(*_: object) -> SimpleNamespace:
            return SimpleNamespace(output=case.output[:, np.newaxis] + np.array(by))

        monkeypatch.setattr(
            "sysid.export.parity.exporter", lambda _: SimpleNamespace(load=lambda *_: run, begins=False)
        )

    off_by(1e-15, 1e-4)
    allowed = Allowed.of((case,), "float64")
    found = check_parity(file, tmp_path, (case,), (), allowed=allowed, outputs=(small, large))
    assert (found.output, found.unit) == ("small", "m")
    assert found.largest_difference == pytest.approx(1e-15, rel=1e-3)
    assert found.tolerance == pytest.approx(2e-15)
    off_by(1e-12, 1e-4)  # far less than the other may be off, and far too much for this one
    with pytest.raises(ParityError, match=r"(?s)1e-12 m") as caught:
        check_parity(file, tmp_path, (case,), (), allowed=allowed, outputs=(small, large))
    assert caught.value.tolerance == pytest.approx(2e-15)


def test_random_sequences_fill_the_declared_range_and_never_leave_it(fit, declared):
    surrogate = declared(fit.model)
    drawn = np.stack([case.inputs for case in random_cases(surrogate)])
    assert drawn.shape == (100, 400, 2)
    assert (drawn.min(axis=(0, 1)) == [0.0, 0.0]).all()
    assert (drawn.max(axis=(0, 1)) == [95.0, 95.0]).all()


def test_random_sequences_are_numbers_that_float32_can_hold(fit):
    surrogate = Surrogate.of(fit.model, {"BP": (0.1, 90.1), "AR": (1.0 / 3.0, 66.7)})
    drawn = np.stack([case.inputs for case in random_cases(surrogate)])
    np.testing.assert_array_equal(drawn, drawn.astype(np.float32))
    assert (drawn.min(axis=(0, 1)) >= [0.1, 1.0 / 3.0]).all()
    assert (drawn.max(axis=(0, 1)) <= [90.1, 66.7]).all()


def test_cases_of_a_cascade_need_its_inputs_alone(limited, command):
    surrogate = Surrogate.of(limited)
    for case, trace in zip(parity_cases(surrogate, command, Start()), command, strict=True):
        expected = limited.simulate(trace.columns(("STP", "FLOW"))).values[:, 2:]
        np.testing.assert_array_equal(case.output, expected)
        np.testing.assert_array_equal(case.state, surrogate.at_rest(case.inputs[0]))


def test_without_a_declared_range_sequences_keep_to_the_scaling(fit):
    drawn = np.stack([case.inputs for case in random_cases(Surrogate.of(fit.model), sequences=20)])
    np.testing.assert_allclose(drawn.min(axis=(0, 1)), [0.0, 50.0], atol=1e-12)
    np.testing.assert_allclose(drawn.max(axis=(0, 1)), [90.0, 90.0], atol=1e-12)


@pytest.mark.parametrize(("pole", "expected"), [(0.5, 0.5), (0.99, 0.99), (1.02, 1.02**400)])
def test_amplification_is_what_becomes_of_a_small_change(pole, expected):
    model = ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(0,)),
        coefficients=np.array([0.0, -pole]),
        intercept=0.0,
        mapping=Mapping.parse("BP -> BC"),
        sample_time=0.1,
        input_units=("psi",),
        output_unit="psi",
        rest_output=0.0,
    )
    case = random_cases(Surrogate.of(model), sequences=1)[0]
    assert case.amplification == pytest.approx(expected, rel=1e-6)
    assert case.reached == (399 if pole > 1.0 else 0)


def test_an_unstable_model_is_held_to_the_size_that_its_outputs_have(tmp_path: Path) -> None:
    u = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, 6), 10)
    y = signal.lfilter([0.0, 0.1], [1.0, -1.05], u)
    fitted = sysid.fit(sysid.data((u, y), sample_time=0.1), "u -> y", sysid.ARX(na=1, nb=(1,), nk=(1,)))
    fitted.save(tmp_path / "unstable", formats=("c",))
    assert (tmp_path / "unstable" / "model.json").is_file()


BEGIN = [name for name, one in EXPORTERS.items() if one.begins]


@pytest.mark.parametrize("format_name", BEGIN)
def test_a_file_begins_at_rest_by_itself(format_name, inputs, tmp_path):
    """A cascade with levels that follow inputs: the check runs it from there, beside the states that it is handed."""
    surrogate = Surrogate.of(build_limited())
    file = usable(format_name).write(surrogate, tmp_path)[0]
    run, u = EXPORTERS[format_name].load(file, tmp_path), inputs(60, len(surrogate.inputs))
    allowed = SHARES[file.dtype] * np.abs(surrogate.simulate(u)).max() * 10.0
    assert largest_difference(run(u[:, np.newaxis], None).output[:, 0], surrogate.simulate(u)) <= allowed


@pytest.mark.parametrize("format_name", ["c", "cpp", "fmi3", "arduino"])
def test_a_file_that_begins_elsewhere_is_refused(format_name, tmp_path, monkeypatch):
    """From the states that it is handed it is right: only its own beginning shows the fault."""
    surrogate = Surrogate.of(build_limited())
    writer = usable(format_name)
    file = writer.write(surrogate, tmp_path)[0]
    right, elsewhere = writer.load(file, tmp_path), surrogate.at_rest(np.full(len(surrogate.inputs), 7.0))

    def wrong(u, state):
        return right(u, np.tile(elsewhere, (u.shape[1], 1)) if state is None else state)

    monkeypatch.setattr(type(writer), "load", lambda *_: wrong)
    sequences = random_cases(surrogate, sequences=3, samples=50)
    allowed = Allowed.of(sequences, file.dtype)
    with pytest.raises(ParityError, match="begun by the file itself"):
        check_parity(file, tmp_path, sequences, sequences, allowed=allowed, outputs=surrogate.outputs)
    monkeypatch.setattr(type(writer), "begins", False)
    check_parity(file, tmp_path, sequences, sequences, allowed=allowed, outputs=surrogate.outputs)
