"""Orders of polynomial models: taken, or refused in words."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError
from sysid.models import ARMAX, BJ


@given(
    st.dictionaries(
        st.sampled_from(["na", "nc", "nb", "nk"]),
        st.one_of(st.integers(-3, 10**12), st.lists(st.integers(-2, 300), max_size=3), st.text(max_size=2), st.none()),
    )
)
def test_orders_are_taken_or_refused_in_words(given_orders: dict) -> None:
    try:
        orders = ARMAX(**{"na": 1, "nb": (1,), "nc": 1, "nk": (1,)} | given_orders)
    except ConfigError as error:
        assert error.remedy
    else:
        assert orders.n_parameters == len(orders.names(tuple(f"u{j}" for j in range(len(orders.nb)))))


def test_box_jenkins_without_an_input_is_refused_with_what_it_is() -> None:
    with pytest.raises(ConfigError, match=r"write for example ARMAX with na: 2, nb: \[\], nc: 1, nk: \[\]"):
        BJ(nb=(), nc=1, nd=2, nf=(), nk=())
