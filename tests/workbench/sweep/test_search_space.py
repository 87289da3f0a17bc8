"""What a sweep can try, and what its YAML may say."""

from __future__ import annotations

from typing import Any

import pytest
import yaml

from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.kernels.neurons import NEURONS
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.search_space import parse_space

CHAPTER = {
    "kind": "NARX",
    "input_delays": {"from": 1, "to": 5},
    "output_delays": {"from": 1, "to": 5},
    "neurons": {"from": 1, "to": 20},
}


def labels(structures: list[dict[str, Any]], training: dict[str, Any] | None = None) -> list[str]:
    return [point.structure.label for point in parse_space(structures, training or {}, 2).points()]


def test_the_grid_is_numbered_as_in_the_published_sweep() -> None:
    points = parse_space([CHAPTER], {}, 2).points()
    assert len(points) == 500
    assert {p.number: p.structure.label for p in points if p.number in {5, 158, 257, 380}} == {
        5: "NARX 1/1/5",
        158: "NARX 2/3/18",
        257: "NARX 3/3/17",
        380: "NARX 4/4/20",
    }


SPACES = {
    "lag sets": (
        [{"kind": "NARX", "input_delays": {"among": ["0:1", [1, 2, 4]]}, "output_delays": 1, "neurons": 3}],
        ["NARX 0:1/1/3", "NARX 1..4(3)/1/3"],
    ),
    "orders, the same for every input": (
        [{"kind": "ARX", "na": 1, "nb": {"from": 2, "to": 3}, "nk": 1}],
        ["ARX [1; 2 2; 1 1]", "ARX [1; 3 3; 1 1]"],
    ),
    "orders, input by input": (
        [{"kind": "ARX", "na": 1, "nb": [{"from": 2, "to": 3}, 5], "nk": [1, {"from": 0, "to": 1}]}],
        ["ARX [1; 2 5; 1 0]", "ARX [1; 2 5; 1 1]", "ARX [1; 3 5; 1 0]", "ARX [1; 3 5; 1 1]"],
    ),
    "orders in a matrix": (
        [{"kind": "VectorARX", "na": [[2, {"from": 0, "to": 1}], [1, 2]], "nb": 1, "nk": {"from": 1, "to": 2}}],
        [f"VectorARX [2 {n}, 1 2; 1; {nk}]" for n in (0, 1) for nk in (1, 2)],
    ),
    "poles and zeros, without what is no transfer function": (
        [{"kind": "TransferFunction", "poles": {"from": 1, "to": 2}, "zeros": {"from": 1, "to": 2}, "delays": 1}],
        ["TF [1 1; 1 1; 1 1]", "TF [2 2; 1 1; 1 1]", "TF [2 2; 2 2; 1 1]"],
    ),
    "types of process models": (
        [{"kind": "ProcessModel", "type": {"among": ["P1D", "P2DU"]}}],
        ["P1D P1D", "P2DU P2DU"],
    ),
    "several structures": (
        [
            {"kind": "ARX", "na": {"from": 1, "to": 2}, "nb": 1, "nk": 1},
            {"kind": "NARX", "input_delays": 1, "output_delays": 1, "neurons": {"among": [2, 4]}},
        ],
        ["ARX [1; 1 1; 1 1]", "ARX [2; 1 1; 1 1]", "NARX 1/1/2", "NARX 1/1/4"],
    ),
    "kinds of neurons, all of them": (
        [{"kind": "NARX", "input_delays": 1, "output_delays": 1, "neurons": 2, "activation": "range"}],
        ["NARX 1/1/2", *(f"NARX 1/1/2 {kind}" for kind in NEURONS if kind != "tanh")],
    ),
    "one point twice": (
        [{"kind": "NARX", "input_delays": {"among": [2, "1:2"]}, "output_delays": 1, "neurons": 1}],
        ["NARX 2/1/1"],
    ),
}


@pytest.mark.parametrize(("structures", "expected"), SPACES.values(), ids=SPACES)
def test_ranges_make_points(structures: list[dict[str, Any]], expected: list[str]) -> None:
    assert labels(structures) == expected


def test_options_of_the_training_have_ranges_too() -> None:
    training = {"loop": "open", "regularisation": {"from": 1e-4, "to": 1e-2, "points": 3, "log": True}}
    network = {"kind": "NARX", "input_delays": 1, "output_delays": 1, "neurons": 2}
    points = parse_space([network], training, 2).points()
    assert [point.training["regularisation"] for point in points] == [1e-4, 1e-3, 1e-2]
    assert {point.training["loop"] for point in points} == {"open"}


def test_a_seed_belongs_to_a_point_and_not_to_its_place() -> None:
    small, large = parse_space([CHAPTER | {"input_delays": 4}], {}, 2), parse_space([CHAPTER], {}, 2)
    seeds = [
        {point.structure.label: point.seed(0) for point in space.points()}["NARX 4/4/20"] for space in (small, large)
    ]
    assert seeds[0] == seeds[1]
    assert len({point.seed(0) for point in large.points()}) == 500
    assert large.points()[0].seed(0) != large.points()[0].seed(1)


WRONG_SPACES = {
    "a misspelt field": ([CHAPTER | {"neuronz": 3}], {}),
    "an unknown kind": ([CHAPTER | {"kind": "NARKS"}], {}),
    "no point that is a structure": ([{"kind": "NARX", "input_delays": 0, "output_delays": 1, "neurons": 1}], {}),
    "lags for another number of inputs": ([CHAPTER | {"input_delays": [[1], [2], [3]]}], {}),
    "more points than can be tried": (
        [{"kind": "ARX", "na": "range", "nb": ["range", "range"], "nk": ["range", "range"]}],
        {},
    ),
    "a misspelt option": ([CHAPTER], {"lop": "open"}),
    "a wrong value in an option's range": ([CHAPTER], {"loop": {"among": ["open", "shut"]}}),
}


@pytest.mark.parametrize(("structures", "training"), WRONG_SPACES.values(), ids=WRONG_SPACES)
def test_what_cannot_be_tried_is_refused(structures: list[dict[str, Any]], training: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        parse_space(structures, training, 2).points()


SWEEP = {
    "kind": "sweep",
    "name": "s",
    "data": "d",
    "mapping": "u+v -> y",
    "structure": CHAPTER,
    "training": {"max_iterations": 40},
}

WRONG_SWEEPS = {
    "validation cases that choose": ({"choose": {"on": "cases"}}, "would choose the winner"),
    "a figure that there is not": ({"choose": {"by": "mse"}}, "unknown figure of merit"),
    "a grid with a number of trials": ({"method": {"name": "grid", "trials": 5}}, "does not take"),
    "random without one": ({"method": "random"}, "needs"),
    "a sampler led by run times": (
        {"method": {"name": "nsga-ii", "trials": 5}, "objectives": ["free_run_mse", "run_time"]},
        "depends on the load",
    ),
    "a sampler that drops trials": (
        {"method": {"name": "tpe", "trials": 5}, "pruning": [{"iterations": 5, "keep": 0.5}]},
        "cannot drop",
    ),
    "looks out of order": (
        {"pruning": [{"iterations": 9, "keep": 0.5}, {"iterations": 5, "keep": 0.5}]},
        "do not follow",
    ),
    "a look after the end": ({"pruning": [{"iterations": 40, "keep": 0.5}]}, "do not follow"),
    "records that shrink": (
        {"pruning": [{"iterations": 5, "keep": 0.5}, {"iterations": 9, "record": 0.5, "keep": 0.5}]},
        "do not follow",
    ),
    "a misspelt field": ({"methd": "grid"}, "unknown field"),
    "a rest of no output": ({"rest": {"u": 0.0}}, "rest names u, which is not the output"),
    "no range that can be read": ({"structure": CHAPTER | {"neurons": {"from": 9}}}, "is not a range"),
    "something by hand that is no structure": ({"beside": [{"kind": "NARX", "neurons": 3}]}, "lacks"),
}


@pytest.mark.parametrize(("change", "words"), WRONG_SWEEPS.values(), ids=WRONG_SWEEPS)
def test_a_sweep_is_refused_with(change: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        check(SweepConfig, SWEEP | change, where="sweep.yaml")


def test_validation_cases_choose_only_in_a_reproduction_that_says_so() -> None:
    config = check(SweepConfig, SWEEP | {"choose": {"on": "cases"}, "reproduces": "a paper"}, where="s.yaml")
    assert config.choose.on == "cases"


@pytest.mark.parametrize("name", ["open-loop-sweep", "closed-loop-sweep"])
def test_the_built_in_sweeps_try_five_hundred_networks(name: str) -> None:
    from sysid.workbench.fits.config import find_pipeline
    from sysid.workbench.sweep.config import SweepConfig
    from sysid.workbench.sweep.sweep_steps import Sweep

    config = Sweep.read(SweepConfig, find_pipeline(name)).config
    assert len(config.space().points()) == 500
    assert (config.choose.on == "cases") == (config.reproduces is not None)


@pytest.mark.parametrize(
    ("fields", "name", "points"),
    [
        ({"kind": "NARX", "input_delays": 1, "output_delays": 1, "neurons": [2, 5]}, "neurons", 2),
        ({"kind": "NARX", "input_delays": 1, "output_delays": 1, "neurons": "2:5"}, "neurons", 4),
        ({"kind": "HammersteinWiener", "states": [1, 2, 3]}, "states", 3),
        ({"kind": "SS", "states": "1..2"}, "states", 2),
        ({"kind": "PolynomialNARX", "terms": [3, 5]}, "terms", 2),
    ],
)
def test_several_values_where_one_stands_are_refused_with_the_range_that_was_meant(
    fields: dict[str, Any], name: str, points: int
) -> None:
    with pytest.raises(ConfigError) as refused:
        parse_space([fields], {}, 2).points()
    meant = yaml.safe_load(str(refused.value.remedy).removeprefix("to try each, write "))
    assert set(meant) == {name}
    assert len(parse_space([{**fields, **meant}], {}, 2).points()) == points


def test_a_number_that_is_none_keeps_its_own_remedy() -> None:
    with pytest.raises(ConfigError, match="neurons: 20"):
        parse_space([{"kind": "NARX", "input_delays": 1, "output_delays": 1, "neurons": -3}], {}, 2).points()
