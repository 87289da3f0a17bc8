"""What the doctests of the package need, which lie outside of ``tests``."""

import linecache

import pytest


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Drop the lines of generated code before a doctest.

    A doctest begins with ``linecache.checkcache()``. SQLAlchemy keeps the lines of what it generates there and takes
    them out when their function is garbage. Where that happens during the check, Python 3.11 raises a ``KeyError``.
    """
    if isinstance(item, pytest.DoctestItem):
        for name in [name for name in linecache.cache if name.startswith("<sqlalchemy")]:
            linecache.cache.pop(name, None)
