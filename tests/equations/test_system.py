"""Which names are what, and which cannot be."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sysid.equations import System
from sysid.equations.system import written_name
from sysid.errors import ConfigError


def test_names_are_sorted() -> None:
    system = System.read("dx/dt = -k*x + q; z[k+1] = x; q = u + pi; y = q(t - 1) + v", ["k"])
    assert (system.continuous, system.discrete, tuple(system.definitions)) == (("x",), ("z",), ("q", "y"))
    assert system.others == ("u", "v")
    assert system.order == ("q", "y")


def test_words_of_the_language_are_names_in_double_quotes() -> None:
    """Channels are called as they are called, and their equations are written by those who do not know."""
    system = System.read('"max" = "t" + max("pi", pi) + "a ""b""" + "and"[k-1]', [])
    assert tuple(system.definitions) == ("max",)
    assert system.others == ("t", "pi", 'a "b"', "and")


@example(";")
@example("and")
@given(st.text(st.characters(exclude_categories=["C"]), min_size=1))
def test_any_name_is_read_as_it_was_written(name: str) -> None:
    system = System.read(f"y_ = pi + {written_name(name)}\nz_ = y_", [])
    assert system.others == (name,)
    if name != "y_":
        assert tuple(System.read(f"{written_name(name)} = 1 + u_", []).definitions) == (name,)


def test_definitions_are_ordered_by_what_they_need() -> None:
    assert System.read("c = b + 1; b = a + 1; a = u", []).order == ("a", "b", "c")


@pytest.mark.parametrize(
    ("text", "parameters", "words", "remedy"),
    [
        ("y = u; y = 2*u", [], "y has two equations", "remove one"),
        ("k = 2; y = k*u", ["k"], "k is a parameter and has an equation", "remove k"),
        ("min = u; y = min", [], "min is a word of the language", "min_"),
        ("y = u", ["tanh"], "tanh is a word of the language", "tanh_"),
        ("y = sinus(u)", [], "there is no function sinus", "did you mean sin"),
        ("y = k(u + 1)", ["k"], "there is no function k", r"k\*\(...\)"),
        ("y = clamp(u, 0)", [], "clamp takes 3 arguments", "give it those"),
        ("y = sqrt(u, u)", [], "sqrt takes 1 argument", "give it those"),
        ("y = clamp(u, high=1, low=0)", [], "clamp has no such option here", "leave the names out"),
        ("y = u", ["k"], "no equation reads the parameter k", "remove k"),
        ("y = k_1*u", ["k1"], "no equation reads the parameter k1", "did you mean k_1"),
        ("y = z + u; z = 2*y", [], "y needs itself: y -> z -> y|z needs itself: z -> y -> z", "a sample ago"),
    ],
)
def test_names_that_cannot_be_are_refused(text: str, parameters: list[str], words: str, remedy: str) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        System.read(text, parameters)
    assert caught.match(remedy)


@pytest.mark.parametrize(
    ("inputs", "outputs", "words", "remedy"),
    [
        (("u",), ("y",), "nothing says what v is", "add v: 1 to the parameters"),
        (("u", "V"), ("y",), "nothing says what v is", "add v"),
        (("u", "v", "x"), ("y",), "the input x is computed by the equations", "rename x"),
        (("u", "v"), ("y2",), "no equation computes the output y2", "y2 = y"),
    ],
)
def test_channels_that_the_equations_do_not_know_are_refused(
    inputs: tuple[str, ...], outputs: tuple[str, ...], words: str, remedy: str
) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        System.read("dx/dt = u - x; y = x + v", []).check_names(inputs, outputs)
    assert caught.match(remedy)
