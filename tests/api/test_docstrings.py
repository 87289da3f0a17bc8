"""What the short way hands out tells its arguments, what they are in, and what comes back."""

from __future__ import annotations

import inspect

import pytest

import sysid

CLASSES = (sysid.Fit, sysid.SystemFit, sysid.Comparison, sysid.OrderSearch)
METHODS = [
    pytest.param(method, id=f"{kind.__name__}.{name}")
    for kind in CLASSES
    for name, method in vars(kind).items()
    if inspect.isfunction(method) and not name.startswith("_")
]


@pytest.mark.parametrize("method", METHODS)
def test_a_public_method_tells_what_it_takes_and_gives(method: object) -> None:
    told, signature = inspect.getdoc(method) or "", inspect.signature(method)  # type: ignore[arg-type]
    for name in list(signature.parameters)[1:]:
        assert f"\n    {name}: " in told, name
    assert "Returns:" in told or signature.return_annotation in {"None", None}
