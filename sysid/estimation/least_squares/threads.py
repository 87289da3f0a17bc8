"""One thread for small linear algebra: more of them cost more than they give at these sizes."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController


def one_blas_thread() -> AbstractContextManager[Any]:
    """A context in which BLAS works in one thread.

    The libraries are looked for once in a process: each look reads the process's memory map, which took a fifth of the
    time of a transfer function's search.

    Returns:
        The context; on its way out the number of threads is as it was.
    """
    limited: AbstractContextManager[Any] = _controller().limit(limits=1, user_api="blas")
    return limited


@cache
def _controller() -> ThreadpoolController:
    # NumPy's and SciPy's are there: whoever comes here has imported both.
    return ThreadpoolController()
