"""What stands before a record's first sample."""

import numpy as np
import pytest

from sysid.errors import ConfigError, TraceError
from sysid.models import History, Start, StartKind

INPUTS = np.arange(10.0).reshape(5, 2)
OUTPUT = np.array([7.0, 8.0, 9.0, 10.0, 11.0])


def test_rest_takes_nothing_from_the_measured_output():
    history = Start().history(INPUTS, OUTPUT * np.nan, rest_output=3.0)
    inputs, output = history.padded(2)
    assert inputs.tolist() == [[0.0, 1.0], [0.0, 1.0]]
    assert output.tolist() == [3.0, 3.0]


def test_first_sample_holds_the_first_measured_output():
    history = Start(kind=StartKind.FIRST_SAMPLE).history(INPUTS, OUTPUT, rest_output=3.0)
    assert history.padded(2)[1].tolist() == [7.0, 7.0]


def test_measured_takes_its_samples_and_no_more():
    history = Start(kind=StartKind.MEASURED, n_measured=3).history(INPUTS, OUTPUT, rest_output=3.0)
    inputs, output = history.padded(4)
    assert inputs.tolist() == [[0.0, 1.0], [0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]
    assert output.tolist() == [7.0, 7.0, 8.0, 9.0]


def test_nothing_is_padded_for_a_model_without_memory():
    assert History.at_rest(inputs=[1.0], output=2.0).padded(0)[1].size == 0


@pytest.mark.parametrize("fields", [{"n_measured": 3}, {"kind": StartKind.MEASURED}], ids=["too many", "too few"])
def test_a_number_of_samples_goes_with_a_measured_start_alone(fields):
    with pytest.raises(ConfigError, match="does not go with the kind of start"):
        Start(**fields)


def test_a_record_shorter_than_its_start_is_refused():
    with pytest.raises(TraceError, match="too short for its start"):
        Start(kind=StartKind.MEASURED, n_measured=5).history(INPUTS, OUTPUT, rest_output=0.0)


def test_a_history_of_unequal_parts_is_refused():
    with pytest.raises(TraceError, match=r"shapes \(2, 1\) and \(3,\)"):
        History(inputs=np.zeros((2, 1)), output=np.zeros(3))


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("rest", Start()),
        ("first-sample", Start(kind=StartKind.FIRST_SAMPLE)),
        ("estimated", Start(kind=StartKind.ESTIMATED)),
        ("measured=50", Start(kind=StartKind.MEASURED, n_measured=50)),
        ({"measured": 50}, Start(kind=StartKind.MEASURED, n_measured=50)),
        ({"estimated": 20}, Start(kind=StartKind.ESTIMATED, n_measured=20)),
        (Start(), Start()),
    ],
    ids=str,
)
def test_a_start_is_read_as_people_write_it(written: object, meant: Start):
    assert Start.of(written) == meant


@pytest.mark.parametrize(
    "written", ["measured", "measured=-1", "measured=1.5", "Rest", {"rest": 5}, {}, 5, None], ids=str
)
def test_what_is_no_start_is_refused_in_words(written: object):
    with pytest.raises(ConfigError, match=r"not a way to start|does not go with the kind"):
        Start.of(written)
