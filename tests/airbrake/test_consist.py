"""The train: its nodes as the listing numbers them, and the volumes of Appendix C."""

import pytest

from sysid.airbrake.consist import Consist
from sysid.errors import ConfigError


def test_the_dissertations_train_has_101_vehicles() -> None:
    consist = Consist(pairs=50)
    assert consist.vehicles == 101
    assert consist.valve_nodes[:2] == (3, 5)
    assert consist.valve_nodes[-1] == 101


def test_a_locomotive_inside_moves_what_is_behind_it() -> None:
    consist = Consist(pairs=3, locomotives=(1, 3))
    assert consist.vehicles == 9
    assert consist.valve_nodes == (3, 6, 8)
    assert consist.port_nodes == (4, 9)


def test_volumes_are_those_of_the_listing() -> None:
    consist = Consist()
    assert consist.pipe.volume == pytest.approx(8.3132e-3, rel=1e-4)
    assert consist.cylinder.volume == pytest.approx(0.013744, rel=1e-4)
    assert consist.charged == pytest.approx(721_853, abs=1)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"pairs": 0}, "needs wagons"),
        ({"pairs": 2, "locomotives": (3,)}, "outside the train"),
        ({"running_pressure": 6.2}, "no running pressure"),
    ],
    ids=["no wagons", "locomotive outside", "bar for psi"],
)
def test_what_is_no_train_is_refused(options: dict, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        Consist(**options)
