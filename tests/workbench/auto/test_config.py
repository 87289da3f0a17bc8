"""A search is refused for what no search can do, before anything is loaded."""

import pytest

from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.models import ARX
from sysid.workbench.auto.config import AutoConfig
from sysid.workbench.auto.run import auto_of
from sysid.yaml_files import parse_yaml

SEARCH = {"kind": "auto", "name": "a", "data": "d", "mapping": "u -> y"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        pytest.param({"rest": {"u": 0.0}}, "rest names u, which is not the output", id="a rest of no output"),
        pytest.param({"minutes": 1.0, "iterations": 5}, "two budgets", id="two budgets"),
        pytest.param({"minuts": 1.0}, "unknown field 'minuts'", id="a misspelt field"),
    ],
)
def test_a_search_is_refused_with(change, words):
    with pytest.raises(ConfigError, match=words):
        check(AutoConfig, SEARCH | change, where="search.yaml")


def test_what_it_shares_with_a_sweep_comes_to_the_sweep():
    config = check(AutoConfig, SEARCH | {"rest": {"y": 2.0}, "seed": 7, "export": None}, where="search.yaml")
    swept = config.sweep(ARX(na=1, nb=[1], nk=[1]))
    assert (swept.rest, swept.seed, swept.export, swept.start) == ({"y": 2.0}, 7, None, config.start)


@pytest.mark.parametrize("said", ["1e-3", "no", "a\u2028b"])
def test_a_search_that_is_in_no_file_is_written_as_it_is_read(said):
    config = check(AutoConfig, SEARCH | {"description": said, "rest": {"y": 2.0}}, where="search.yaml")
    assert check(AutoConfig, parse_yaml(auto_of(config).text, where="again"), where="again") == config
