"""What a reference is named by, and what has to be said beside it: one way for FMUs, functions and programs."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.references.callable import CallableReference
from sysid.references.config import ReferenceConfig
from sysid.references.described import Wish
from sysid.references.proposal import proposed
from sysid.references.sources import source_of

NOTHING = Wish(ranges={}, parameters={})
SAID = Wish(
    ranges={"u": (0.0, 2.0)}, parameters={"tau": (1.0, 3.0)}, outputs=("y",), sample_time=0.5, duration=20.0,
    units={"u": {"unit": "V"}, "y": {"unit": "bar", "reference": "gauge"}},
)  # fmt: skip
PROGRAM = "python sim.py --in {inputs} --out {outputs} --tau {tau}"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "slow").mkdir()
    (tmp_path / "slow" / "lag.py").write_text("import gain\n\ndef lag(time, u, p):\n    return gain.of * u\n")
    (tmp_path / "slow" / "gain.py").write_text("of = 3.0\n")
    (tmp_path / "sim.py").write_text("import sys\n\nrows = sys.argv\nraise SystemExit\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("text", "name", "fields"),
    [
        ("slow/lag.py:lag", "lag", {"python": "lag.py:lag", "folder": "slow"}),
        ("package.module:function", "function", {"python": "package.module:function", "folder": "."}),
        (PROGRAM, "sim", {"program": PROGRAM.split(), "folder": "."}),
        ("slow/a.fmu", "a", {"fmu": "slow/a.fmu"}),
    ],
)
def test_a_reference_is_known_by_its_name(text: str, name: str, fields: dict[str, object], place: Path) -> None:
    found = source_of(text)
    whole = {key: str(place / str(fields[key])) for key in ("folder", "fmu") if key in fields}
    assert (found.name, found.reference) == (name, {**fields, **whole})


@pytest.mark.usefixtures("place")
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("slow/lag.py", "say slow/lag.py:lag"),
        ("slow/lag.py:lga", "lag"),
        ("sim.py", "'python sim.py {inputs} {outputs}'"),
        ("slow/log.py:lag", "check the path"),
        ("python sim.py {inputs}", "'solver --in {inputs} --out {outputs}'"),
        ("python 'sim.py {inputs} {outputs}", "correct the quotes"),
    ],
)
def test_what_names_none_is_refused_with_what_would(text: str, said: str) -> None:
    with pytest.raises(ConfigError) as caught:
        source_of(text)
    assert said in str(caught.value.remedy)


@pytest.mark.usefixtures("place")
@pytest.mark.parametrize("text", ["slow/lag.py:lag", PROGRAM])
def test_what_is_said_by_options_is_a_whole_pipeline(text: str) -> None:
    content = proposed(source_of(text), SAID).content
    config = ReferenceConfig.model_validate(content["reference"])
    assert (config.inputs["u"].unit, config.inputs["u"].range) == ("V", (0, 2))
    assert config.outputs["y"].reference.value == "gauge"
    assert (config.parameters["tau"].range, config.sample_time) == ((1, 3), 0.5)
    assert content["experiment"] == {"duration": 20.0}


@pytest.mark.usefixtures("place")
def test_all_that_nobody_says_is_asked_for_at_once_by_option_or_by_line(place: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        proposed(source_of("slow/lag.py:lag"), NOTHING)
    options = "--range NAME=LOW:HIGH --output NAME --sample-time SECONDS --duration SECONDS"
    assert caught.value.remedy == f"say it: {options}"
    table = place / "lag.yaml"
    table.write_text("reference: {python: lag.py:lag, folder: slow, inputs: {u: {unit: V}}, sample_time: 0.5}\n")
    with pytest.raises(ConfigError) as caught:
        proposed(source_of("lag.yaml"), NOTHING)
    lines = "reference: {inputs: {u: {unit: V, range: [LOW, HIGH]}}}; reference: {outputs: {NAME: {unit: V}}}; "
    assert caught.value.remedy == f"write in lag.yaml: {lines}experiment: {{duration: SECONDS}}"


def test_a_table_and_options_together_are_a_pipeline_and_what_both_say_is_refused(place: Path) -> None:
    (place / "lag.yaml").write_text(
        "reference:\n  python: lag.py:lag\n  folder: slow\n  inputs: {u: {unit: V, range: [0, 2], rate: 4}}\n"
        "  outputs: {y: {}}\nexperiment: {excitations: [aprbs]}\n"
    )
    source = source_of("lag.yaml")
    content = proposed(source, Wish(ranges={}, parameters={}, sample_time=0.5, duration=20.0)).content
    reference = ReferenceConfig.model_validate(content["reference"])
    assert (reference.inputs["u"].rate, reference.folder) == (4.0, str(place / "slow"))
    assert content["experiment"] == {"excitations": ["aprbs"], "duration": 20.0}
    with pytest.raises(ConfigError, match="--range u, --output stands in the file too"):
        proposed(source, SAID)


def test_a_function_of_a_file_is_another_where_a_file_is_that_it_imports(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = ReferenceConfig.model_validate(proposed(source_of("slow/lag.py:lag"), SAID).content["reference"])
    monkeypatch.syspath_prepend(place)  # what loading puts before it goes with it
    digests = []
    for of in ("3.0", "4.25"):
        (place / "slow" / "gain.py").write_text(f"of = {of}\n")
        loaded = CallableReference(config)
        assert loaded.beside == (str(place / "slow" / "gain.py"),)
        digests.append(loaded.digest)
        for name in ("lag", "gain"):
            del sys.modules[name]
    assert digests[0] != digests[1]


@pytest.mark.parametrize(
    "text",
    [
        "slow, other = map(wrap, (a, b))",
        "slow: Callable[..., object] = wrap(a)",
        "try:\n    from fast import slow\nexcept ImportError:\n    slow = wrap(a)",
        "if True:\n    def slow(t, u, p): ...",
    ],
    ids=["with others", "with its type", "of a library that may lack", "below a condition"],
)
def test_a_function_may_be_made_in_any_way_at_the_top_of_its_file(tmp_path: Path, text: str) -> None:
    (tmp_path / "model.py").write_text(text + "\n\ndef inside():\n    hidden = 1\n")
    assert source_of("model.py:slow", folder=tmp_path).name == "slow"
    with pytest.raises(ConfigError, match="has no function hidden"):
        source_of("model.py:hidden", folder=tmp_path)
