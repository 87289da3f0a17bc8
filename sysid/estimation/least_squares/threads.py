"""One thread for small linear algebra: more of them cost more than they give at these sizes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module

from threadpoolctl import ThreadpoolController


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """A context in which BLAS works in one thread, or a decorator of a function that does.

    Two threads that wake for matrices of a few hundred rows were measured eight times slower than one where another
    process works on the same two cores; and sums in another order, as many threads make them, are other sums.

    The libraries are looked for once in a process: each look reads the process's memory map, which took a fifth of the
    time of a transfer function's search.

    Yields:
        Nothing; on its way out the number of threads is as it was.
    """
    with _controller().limit(limits=1, user_api="blas"):
        yield


@cache
def _controller() -> ThreadpoolController:
    import_module("scipy.linalg")  # brings a BLAS of its own beside NumPy's: only what is loaded is found
    return ThreadpoolController()
