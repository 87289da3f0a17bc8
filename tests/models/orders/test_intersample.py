"""What inputs do between samples, as people write it, and the exact samples of a system that they drive."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from sysid.errors import ConfigError
from sysid.models import GreyBox, Mapping, TransferFunction, structure_from_dict
from sysid.models.converting.orthonormal_basis import Domain, basis_of
from sysid.models.converting.realisation import realise
from sysid.models.orders.intersample import intersample_of, moving


@pytest.mark.parametrize(
    ("given", "by_input"),
    [("zoh", (False, False)), ("foh", (True, True)), ({"v": "foh"}, (False, True)), ([("u", "foh")], (True, False))],
)
def test_it_is_one_for_all_inputs_or_by_input(given, by_input) -> None:
    assert moving(intersample_of(given), ("u", "v")) == by_input


@pytest.mark.parametrize("given", ["linear", 1, {"u": "bl"}, {"u": None}, ["foh"]])
def test_what_inputs_do_not_do_is_refused(given) -> None:
    with pytest.raises(ConfigError, match="inputs do no such thing") as caught:
        intersample_of(given)
    assert caught.value.remedy


RATE = "dx/dt = -x + u + v; y = x"


@pytest.mark.parametrize(
    "structure",
    [
        TransferFunction(poles=(1, 2), zeros=(0, 1), domain=Domain.CONTINUOUS, intersample={"v": "foh"}),
        GreyBox(equations=RATE, intersample="foh"),
        GreyBox(equations=RATE, intersample={"v": "foh"}),
    ],
    ids=lambda one: one.label,
)
def test_structures_are_what_they_write(structure) -> None:
    written = structure.to_dict()
    assert written["intersample"] == (structure.intersample if structure.intersample == "foh" else {"v": "foh"})
    assert structure_from_dict(written) == structure
    structure.check_mapping(Mapping.parse("u+v -> y"))


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: GreyBox(equations="y = 2*u", intersample="foh"), "no equation has a rate"),
        (lambda: GreyBox(equations=RATE, intersample={"w": "foh"}), "w is no input"),
        (lambda: TransferFunction(poles=(1,), zeros=(0,), intersample="foh"), "knows nothing of its inputs between"),
        (
            lambda: TransferFunction(
                poles=(1,), zeros=(0,), domain=Domain.CONTINUOUS, intersample={"w": "foh"}
            ).check_mapping(Mapping.parse("u -> y")),
            "w is no input",
        ),
    ],
)
def test_what_moves_nowhere_is_refused(build, words) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        build()
    assert caught.value.remedy


def test_a_system_is_sampled_with_its_input_straight_from_sample_to_sample() -> None:
    basis = basis_of((np.array([9.0, 2.0, 1.0]),), 2, Domain.CONTINUOUS)  # of which one tap acts at once
    system = realise(basis, Domain.CONTINUOUS)
    t, u = 0.3 * np.arange(60), np.concatenate([[0.0], np.random.default_rng(0).normal(size=59)])
    sampled, x = system.sampled(0.3, moving=True), np.zeros(2)
    found = []
    for value in u:
        found.append(sampled.C @ x + sampled.D * value)
        x = sampled.A @ x + sampled.B * value
    expected = lsim((system.A, system.B[:, None], system.C, system.D[:, None]), u, t, interp=True)[1]
    np.testing.assert_allclose(np.array(found), expected, atol=1e-12)


def test_labels_say_that_inputs_move() -> None:
    moving, held, one = (
        [TransferFunction(poles=(1, 1), zeros=(0, 0), domain=Domain.CONTINUOUS, intersample=given).label,
         GreyBox(equations=RATE, intersample=given).label]
        for given in ("foh", "zoh", {"v": "foh"})
    )  # fmt: skip
    assert all(" foh" in label for label in (*moving, *one))
    assert not any("foh" in label for label in held)
