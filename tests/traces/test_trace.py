"""What traces say of themselves by name."""

from __future__ import annotations

import numpy as np
import pytest

import sysid
from sysid.errors import ChannelError, TraceError
from sysid.traces import Channel, Role, Trace, TraceSet

TRACE = Trace(name="EST01", sample_time=0.1, channels=(Channel(name="BP", unit="psi"),), values=np.zeros((5, 1)))


def test_a_trace_says_which_channels_it_has():
    assert "BP" in TRACE
    assert "XX" not in TRACE


@pytest.mark.parametrize("made", [lambda name: Channel(name=name, unit="V"), lambda name: Channel(name="u", unit=name)])
def test_half_a_character_is_refused_where_it_enters_and_the_remedy_is_whole(made):
    with pytest.raises(TraceError, match="half a character") as refused:
        made("u\ud800")
    assert "'u?'" in refused.value.remedy
    made("u?")


def test_a_trace_is_named_in_whole_characters():
    with pytest.raises(TraceError, match="half a character"):
        Trace(name="\udcff", sample_time=0.1, channels=TRACE.channels, values=TRACE.values)


def test_an_array_is_copied_unless_it_is_given_away_read_only() -> None:
    kept = np.zeros((3, 1))
    assert Trace(name="a", sample_time=0.1, channels=TRACE.channels, values=kept).values is not kept
    kept.setflags(write=False)
    assert Trace(name="a", sample_time=0.1, channels=TRACE.channels, values=kept).values is kept
    view = np.zeros((3, 2))[:, :1]
    view.setflags(write=False)
    assert Trace(name="a", sample_time=0.1, channels=TRACE.channels, values=view).values is not view


@pytest.mark.parametrize("size", [1e300, 1e-200])
def test_values_whose_squares_are_no_numbers_are_refused(size: float) -> None:
    name = TRACE.channel_names[0]
    sized = Trace(name="a", sample_time=0.1, channels=TRACE.channels, values=np.full((3, 1), size))
    with pytest.raises(TraceError, match="to be squared") as refused:
        sized.check_sizes([name])
    assert "power of ten" in refused.value.remedy
    some = np.array([[0.0], [1e-300], [1e99]])
    Trace(name="a", sample_time=0.1, channels=TRACE.channels, values=some).check_sizes([name])


def test_traces_are_shown_in_a_line_however_long_they_are() -> None:
    traces = [
        Trace(name=name, sample_time=0.1, channels=(Channel(name="u", unit="V"),), values=np.zeros((2000, 1)))
        for name in "ab"
    ]
    known = TraceSet(name="rig", traces=tuple(traces), roles={"a": Role.ESTIMATION})
    assert repr(known) == "<TraceSet rig: 1 estimation, 1 validation; 4,000 samples of 0.1 s; u [V]>"
    assert repr(traces[0]) == "<Trace a: 2,000 samples of 0.1 s; u [V]>"


def test_a_mask_of_each_channel_hides_a_sample_from_who_knows_that_channel_alone() -> None:
    mask = np.array([[True, True, True], [True, False, True], [False, True, True]])
    channels = tuple(Channel(name=name, unit="1") for name in "uyz")
    trace = Trace(name="a", sample_time=1.0, channels=channels, values=np.zeros((3, 3)), usable=mask)
    assert trace.usable_samples.tolist() == [True, False, False]
    assert trace.usable_of(["y"]).tolist() == [True, False, True]
    assert trace.seen_by(["z"]).usable is None
    seen = trace.seen_by(["u"]).usable
    assert seen is not None
    assert seen.tolist() == [True, True, False]
    each = trace.seen_by(["y"], each=True).usable
    assert each is not None
    assert each.tolist() == [[True] * 3, [True, False, True], [True] * 3]
    alike = Trace(name="a", sample_time=1.0, channels=channels, values=np.zeros((3, 3)), usable=mask[:, [1, 1, 1]])
    plain = Trace(name="a", sample_time=1.0, channels=channels, values=np.zeros((3, 3)), usable=mask[:, 1])
    assert alike.digest == plain.digest != trace.digest


def test_a_slice_of_a_trace_is_a_trace_with_all_that_belongs_to_its_samples() -> None:
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="m"))
    usable = np.arange(10) != 6
    whole = Trace(
        name="a",
        sample_time=0.5,
        channels=channels,
        values=np.arange(20.0).reshape(10, 2),
        start_time=100.0,
        usable=usable,
        weights=np.arange(10.0),
    )
    part = whole[5:8]
    assert part.time.tolist() == [102.5, 103.0, 103.5]
    assert part["y"].tolist() == [11.0, 13.0, 15.0]
    assert part.usable_samples.tolist() == [True, False, True]
    assert part.weights is not None
    assert part.weights.tolist() == [5.0, 6.0, 7.0]
    assert whole[-3:].usable is None
    assert "samples 5 to 7 of 10" in part.provenance


@pytest.mark.parametrize("window", [slice(5, 5), slice(20, 30), slice(None, None, 2), slice(None, None, -1)], ids=str)
def test_a_slice_that_is_no_part_of_a_record_is_refused(window: slice) -> None:
    with pytest.raises(TraceError, match="no part of a trace"):
        TRACE[window]


def stuck() -> Trace:
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="m"))
    values = np.random.default_rng(0).normal(size=(300, 2))
    return Trace(name="a", sample_time=0.1, channels=channels, values=values, start_time=40.0)


def test_a_stretch_is_masked_in_the_time_of_the_trace_with_both_its_ends():
    trace = stuck().masked("y", start=50.3, stop=51.2)
    lost = np.flatnonzero(~trace.usable_of(["y"]))
    assert (lost[0], lost[-1], len(lost)) == (103, 112, 10)
    assert trace.usable_of(["u"]).all()
    assert trace.provenance == ("y: 10 samples masked, from 50.3 s to 51.2 s",)
    both = trace.masked(stop=40.4)
    assert np.flatnonzero(~both.usable_of(["u"])).tolist() == [0, 1, 2, 3, 4]
    assert both.usable_of(["y"]).sum() == 300 - 15


@pytest.mark.parametrize(
    ("asked", "complaint"),
    [({}, "neither"), ({"start": 1.0, "stop": 2.0}, "holds no sample"), ({"channel": "y", "start": 0.0}, "leaves")],
)
def test_a_stretch_that_cannot_be_masked_is_refused_with_the_times_there_are(asked, complaint):
    with pytest.raises(TraceError, match=complaint) as refused:
        stuck().masked(**asked)
    assert "from 40 s to 69.9 s" in str(refused.value)
    with pytest.raises(ChannelError):
        stuck().masked("z", start=41.0)


def test_a_trace_is_masked_as_what_is_read_is():
    """By the same words, to the same samples and with the same note."""
    trace, mask = stuck(), {"channel": "y", "start": 10.3, "stop": 11.2}
    pair = (trace["u"], trace["y"])
    (read,) = sysid.data(pair, inputs="u", outputs="y", sample_time=0.1, repairs={"mask": [mask]})
    (made,) = sysid.data(pair, inputs="u", outputs="y", sample_time=0.1)
    made = made.masked(**mask)
    np.testing.assert_array_equal(read.usable_of(["y"]), made.usable_of(["y"]))
    assert made.provenance[-1] in read.provenance
